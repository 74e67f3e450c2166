// What the kernels of one channel's objective share (reconstruct/vulkan/device_objective.h). Cells are stored x fastest;
// a face is the raster of base/block.h; fields of four right-hand sides lie group after group, as in grid.glsl.
layout(local_size_x = 128) in;  // along the cells or the face, as in grid.glsl

layout(push_constant) uniform Push {
  ivec4 cells;   // nx ny nz, and their product
  ivec4 coarse;  // the same of the next coarser grid
  ivec4 ratio;   // fine cells to a coarse one along each axis, 1 or 2; and flags
  ivec4 face;    // which face (0 x_min ... 5 z_max), groups of four, the seen face where face is the lit one
  vec4 size;     // hx hy hz, and their product V
  vec4 surface;  // 2 A; 4 / (1 - R_phi)
  vec4 smoothness;  // lambda a / (h l) of faces across x, y, z; and 1 / e^2 of total variation, over lambda V / l
} push;

const int kCollimated = 1;
const int kCentroid = 2;
const int kLit = 4;    // the face at hand is the lit one
const int kSeen = 8;   // the face at hand is the seen one
const int kFirst = 16; // sums over the illuminations start here
const int kAlongRays = 32;  // the camera sees along refracted rays
bool has(int flag) { return (push.ratio.w & flag) != 0; }

ivec3 cell_of(int t, ivec4 n) { return ivec3(t % n.x, t / n.x % n.y, t / (n.x * n.y)); }
int stride_of(int axis) { return axis == 0 ? 1 : axis == 1 ? push.cells.x : push.cells.x * push.cells.y; }
float area_of(int axis) { return push.size.w / push.size[axis]; }
// g_b = 1 / (2 A + h / (2 kappa)), per area
float surface_conductance(int axis, float kappa) { return 1.0 / (push.surface.x + push.size[axis] / (2.0 * kappa)); }

// The raster position of a cell on a face across `axis`.
int raster_of(ivec4 n, int axis, ivec3 c) {
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  return c[v] * n[u] + c[u];
}

int face_axis() { return push.face.x / 2; }
int face_count() { return push.cells.w / push.cells[face_axis()]; }
int face_inwards() { return (push.face.x & 1) == 1 ? -stride_of(face_axis()) : stride_of(face_axis()); }
// The cell behind a raster position of the face at hand.
int cell_behind(int f) {
  const int axis = face_axis();
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  ivec3 c;
  c[u] = f % push.cells[u];
  c[v] = f / push.cells[u];
  c[axis] = (push.face.x & 1) == 1 ? push.cells[axis] - 1 : 0;
  return (c.z * push.cells.y + c.y) * push.cells.x + c.x;
}
