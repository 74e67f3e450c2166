#include "config/block_fields.h"

namespace opaline::config {

void visit_block(Fields& fields, Block& block) {
  const Vec3 whole = block.size();
  std::array<double, 3> size{whole.x, whole.y, whole.z};
  fields.numbers({"size", "of the block along x, y, z"}, size, Range::above(0.0), Unit::kLength);
  std::array<int, 3> cells = block.cells();
  fields.wholes({"cells", "it is divided into"}, cells, Range::between(1, 1024));
  block = {
      cells[0], cells[1], cells[2], size[0] / cells[0], size[1] / cells[1], size[2] / cells[2]};
}

void visit_face(Fields& fields, const Key& key, Face& face) {
  static constexpr std::array<std::string_view, 6> kNames{
      "x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};
  fields.one_of(key, face, kNames);
}

}  // namespace opaline::config
