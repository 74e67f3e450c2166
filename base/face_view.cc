#include "base/face_view.h"

#include <array>

namespace opaline {

FaceView view_of_face(const Block& block, Face face, Vec3 eye) {
  const int width = block.face_width(face);
  const int height = block.face_height(face);
  FaceView view{Image<float>(width, height, 1), Image<float>(width, height, 2)};
  const auto normal = static_cast<std::size_t>(axis_of(face));
  const std::size_t across = normal == 0 ? 1 : 0;
  const std::size_t down = normal == 2 ? 1 : 2;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const Vec3 d = normalized(eye - block.face_cell_centre(face, column, row));
      const std::array<double, 3> along{d.x, d.y, d.z};
      view.cosine.at(column, row) =
          static_cast<float>(is_max(face) ? along[normal] : -along[normal]);
      view.direction.at(column, row, 0) = static_cast<float>(along[across]);
      view.direction.at(column, row, 1) = static_cast<float>(along[down]);
    }
  }
  return view;
}

}  // namespace opaline
