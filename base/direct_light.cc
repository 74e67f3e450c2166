#include "base/direct_light.h"

#include <algorithm>
#include <cmath>

namespace opaline {
namespace {

bool lit(const Image<float>& irradiance, int x, int y) {
  if (x < 0 || y < 0 || x >= irradiance.width() || y >= irradiance.height()) return true;
  for (int c = 0; c < irradiance.channels(); ++c) {
    if (irradiance.at(x, y, c) > 0.0F) return true;
  }
  return false;
}

bool has_dark_neighbour(const Image<float>& irradiance, int x, int y) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (!lit(irradiance, x + dx, y + dy)) return true;
    }
  }
  return false;
}

struct CellSize {
  double width = 0.0;
  double height = 0.0;
};

void clear_around(
    Image<std::uint8_t>& mask, int column, int row, const CellSize& cell, double margin_mm) {
  const auto reach = [margin_mm](double size, int most) {
    return static_cast<int>(std::min<double>(std::ceil(margin_mm / size + 0.5), most));
  };
  const int reach_x = reach(cell.width, mask.width());
  const int reach_y = reach(cell.height, mask.height());
  for (int y = std::max(0, row - reach_y); y <= std::min(mask.height() - 1, row + reach_y); ++y) {
    for (int x = std::max(0, column - reach_x); x <= std::min(mask.width() - 1, column + reach_x);
         ++x) {
      const double dx = std::max(0.0, std::abs(x - column) - 0.5) * cell.width;
      const double dy = std::max(0.0, std::abs(y - row) - 0.5) * cell.height;
      if (std::hypot(dx, dy) <= margin_mm) mask.at(x, y) = 0;
    }
  }
}

}  // namespace

void mask_direct_light(const Block& block,
                       Face face,
                       const Image<float>& irradiance,
                       double margin_mm,
                       Image<std::uint8_t>& mask) {
  const int axis = axis_of(face);
  const CellSize cell{axis == 0 ? block.hy : block.hx, axis == 2 ? block.hy : block.hz};
  for (int y = 0; y < irradiance.height(); ++y) {
    for (int x = 0; x < irradiance.width(); ++x) {
      if (!lit(irradiance, x, y)) continue;
      mask.at(x, y) = 0;
      if (has_dark_neighbour(irradiance, x, y)) clear_around(mask, x, y, cell, margin_mm);
    }
  }
}

}  // namespace opaline
