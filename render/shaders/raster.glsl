// What the raster pass knows of a scene (render/raster/raster_buffers.h has the same, std430); lengths in mm.
struct Light {
  vec4 along;      // in which it shines, of length 1; w: 0 directional, 1 point, 2 spot, 3 disc
  vec4 position;   // w: its shadow map, or -1
  vec4 strength;   // irradiance W/mm^2, or intensity W/sr
  vec4 cone;       // half angle and blur, radians; z: side of a shadow texel at distance 1 (directional: anywhere), w: texels a side
  vec4 map[4];     // rows: clip coordinates in the shadow map from scene
};
struct Object {
  vec4 optics;       // 1: translucent, ior, specular model (0 none, 1 Cook-Torrance, 2 Ward), roughness
  vec4 marks;        // w: their radiance
};
struct Vertex {
  vec4 place;   // w: its object
  vec4 normal;  // w: the share of the sky it sees
  vec4 matte;   // Lambert's reflectance
};
struct Glow {
  float fluence[3];  // phi, W/mm^2
  float flux[3];     // J_n, W/mm^2
  float mark;
  float unused;
};
