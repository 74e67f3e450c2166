// One grid of the multigrid hierarchy (reconstruct/diffusion/multigrid.h): (K u)_i = D_i u_i - sum_n g_in u_n.
//
// Cells are stored x fastest, four right-hand sides to a vec4; y of the dispatch counts such groups of four, whose fields
// lie one after another. Red cells have an even sum of indices. A neighbour beyond the surface has g = 0 and is read as
// the cell itself.
layout(local_size_x = 128) in;  // along x, the fastest axis: neighbouring threads read neighbouring vec4s

layout(push_constant) uniform Push {
  ivec4 cells;    // nx ny nz, and their product
  ivec4 coarse;   // the same of the next coarser grid
  ivec4 ratio;    // fine cells to a coarse one along each axis, 1 or 2; and the colour: 0 red, 1 black
  ivec4 partial;  // first partial sum of this dispatch, how many there are of a group, restart, groups
} push;

int group_offset() { return int(gl_GlobalInvocationID.y) * push.cells.w; }

// The cell of this thread where every cell has one; x is -1 when there is none.
ivec3 any_cell() {
  const int t = int(gl_GlobalInvocationID.x);
  const ivec3 c = ivec3(t % push.cells.x, t / push.cells.x % push.cells.y, t / (push.cells.x * push.cells.y));
  return t < push.cells.w ? c : ivec3(-1);
}

// The cell of this thread where only those of the dispatch's colour have one: half a row has (nx + 1) / 2 threads.
ivec3 colored_cell() {
  const int half_row = (push.cells.x + 1) / 2;
  const int t = int(gl_GlobalInvocationID.x);
  const int j = t / half_row % push.cells.y;
  const int k = t / half_row / push.cells.y;
  const int i = 2 * (t % half_row) + ((j + k + push.ratio.w) & 1);
  return k < push.cells.z && i < push.cells.x ? ivec3(i, j, k) : ivec3(-1);
}

int index_of(ivec3 c) { return (c.z * push.cells.y + c.y) * push.cells.x + c.x; }

struct Neighbours { int west, east, south, north, below, above; };

Neighbours neighbours_of(ivec3 c, int at) {
  const int row = push.cells.x;
  const int layer = row * push.cells.y;
  return Neighbours(c.x > 0 ? at - 1 : at, c.x + 1 < push.cells.x ? at + 1 : at,
                    c.y > 0 ? at - row : at, c.y + 1 < push.cells.y ? at + row : at,
                    c.z > 0 ? at - layer : at, c.z + 1 < push.cells.z ? at + layer : at);
}

// sum_n g_in u_n, where low = (g to west, south, below; D) and high = (g to east, north, above; 0) of the cell.
#define NEIGHBOUR_SUM(u, n, low, high)                                          \
  ((low).x * u((n).west) + (high).x * u((n).east) + (low).y * u((n).south) +    \
   (high).y * u((n).north) + (low).z * u((n).below) + (high).z * u((n).above))
