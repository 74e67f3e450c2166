// Besides its matrix a grid keeps what the next coarser one is made of: V sigma_a of each cell, then the conductances of
// the six faces, x_min first, each a raster.
int wall_at(ivec4 n, int axis, int side, ivec3 c) {
  int at = n.w;
  for (int a = 0; a < axis; ++a) at += 2 * (n.w / n[a]);
  return at + side * (n.w / n[axis]) + raster_of(n, axis, c);
}
