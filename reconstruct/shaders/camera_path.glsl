// Where the camera's rays cross the layers behind the seen face (reconstruct/diffusion/camera_rays.h): sample
// layer * face_count() + pixel lies among four cells, tap_share away from the first along columns and rows.

// The j-th of a sample's four cells, from the first.
int corner_of(int j) {
  const int axis = face_axis();
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  int at = 0;
  if ((j & 1) != 0 && push.cells[u] > 1) at += stride_of(u);
  if ((j & 2) != 0 && push.cells[v] > 1) at += stride_of(v);
  return at;
}
float weight_of(vec2 share, int j) {
  return ((j & 1) != 0 ? share.x : 1.0 - share.x) * ((j & 2) != 0 ? share.y : 1.0 - share.y);
}
