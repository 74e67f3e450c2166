// What both stages know of one picture (render/scene_buffer.h fills it), and where a block's faces are.
//   Faces: 0 x_min, 1 x_max ... 5 z_max; face cells as a raster: (y, z) on x faces, (x, z) on y faces, (x, y) on z faces.
layout(std430, binding = 0) readonly buffer Scene {
  vec4 camera_from_sample[3];  // rows: rotation | translation, mm
  vec4 centre;                 // of the camera, in the sample's frame
  vec4 focal;                  // fx fy cx cy, pixels
  vec4 distortion;             // k1 k2 p1 p2
  vec4 optics;                 // k3, eta, depth of the near plane in mm, samples per axis
  vec4 spacing;                // of cells, mm
  ivec4 cells;                 // nx ny nz, segments per face edge
  ivec4 visible;               // up to three faces that look at the camera, and how many
  ivec4 first[2];              // first cell of each face in the field
} scene;

layout(push_constant) uniform Tile {
  ivec2 origin;  // of this tile in the picture, in samples
  ivec2 size;    // in samples
} tile;

struct FacePlane { int axis; int u; int v; float at; };  // perpendicular axis, raster axes, position in mm

FacePlane plane_of(int face) {
  const int axis = face / 2;
  const float at = face % 2 == 1 ? scene.cells[axis] * scene.spacing[axis] : 0.0;
  return FacePlane(axis, axis == 0 ? 1 : 0, axis == 2 ? 1 : 2, at);
}

// Brown's distortion of normalised image coordinates (base/camera_model.h).
vec2 distort(vec2 p) {
  const vec4 d = scene.distortion;
  const float r2 = dot(p, p);
  const float radial = 1.0 + r2 * (d.x + r2 * (d.y + r2 * scene.optics.x));
  return p * radial + vec2(2.0 * d.z * p.x * p.y + d.w * (r2 + 2.0 * p.x * p.x),
                           d.z * (r2 + 2.0 * p.y * p.y) + 2.0 * d.w * p.x * p.y);
}
