// What a cell on a ray of unit power scatters for the first time, alpha' D with alpha' = 1 - 3 kappa sigma_a.
float share_of(int cell) { return (1.0 - 3.0 * coefficient[cell].x * coefficient[cell].y) * ray[cell].x; }
// The part of the first cell's share that leaves at once, e = g_b beta h / kappa.
float escape_of(int cell) {
  const int axis = face_axis();
  const float kappa = coefficient[cell].x;
  return surface_conductance(axis, kappa) * ray[cell].z * push.size[axis] / kappa;
}
