#include "capture/patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

struct Overlap {
  int cell = 0;
  double share = 0.0;  // of the cell's length
};

// For each projector pixel along one axis, the cells it lies on. Lengths in mm.
std::vector<std::vector<Overlap>> overlaps(
    int pixels, double offset_px, double mm_per_pixel, int cells, double cell_mm) {
  std::vector<std::vector<Overlap>> all(static_cast<std::size_t>(pixels));
  for (int p = 0; p < pixels; ++p) {
    const double begin = (p - offset_px) * mm_per_pixel;
    const double end = begin + mm_per_pixel;
    const int first = std::max(0, static_cast<int>(std::floor(begin / cell_mm)));
    for (int c = first; c < cells && c * cell_mm < end; ++c) {
      const double length = std::min(end, (c + 1) * cell_mm) - std::max(begin, c * cell_mm);
      if (length > 0.0) all[static_cast<std::size_t>(p)].push_back({c, length / cell_mm});
    }
  }
  return all;
}

// Fraction of the peak that a code adds to what code 0 leaks.
double relative_light(const ProjectorCalibration& projector, int code) {
  return (1.0 - projector.black_level) * std::pow(code / 255.0, projector.gamma);
}

double vignetting_at(const ProjectorCalibration& projector, int x, int y) {
  const double cx = 0.5 * projector.width;
  const double cy = 0.5 * projector.height;
  const double dx = x + 0.5 - cx;
  const double dy = y + 0.5 - cy;
  return projector.vignetting.at((dx * dx + dy * dy) / (cx * cx + cy * cy));
}

struct NamedRectangle {
  std::string name;
  bool held_out = false;
  LitRectangle rectangle;
  bool uniform = false;
};

struct Place {  // in regions
  double x = 0.0;
  double y = 0.0;
};

// Where lights of `size` regions may lie, all at multiples of half a region; the best tests first.
std::vector<Place> places(int n, double size) {
  const double far = n - size;
  const double middle = std::floor(0.5 * (n - 1)) + 0.5 - (size == 2.0 ? 0.5 : 0.0);
  const std::array<Place, 6> wanted{Place{middle, middle},
                                    {0.5, 0.0},
                                    {far - 0.5, far},
                                    {0.0, 0.5},
                                    {far, far - 0.5},
                                    {0.0, 0.0}};
  std::vector<Place> found;
  for (const Place& p : wanted) {
    const bool fits = p.x >= 0.0 && p.y >= 0.0 && p.x <= far && p.y <= far;
    const bool known =
        std::ranges::any_of(found, [&](const Place& q) { return q.x == p.x && q.y == p.y; });
    const bool is_region = size == 1.0 && p.x == std::floor(p.x) && p.y == std::floor(p.y);
    if (fits && !known && !is_region) found.push_back(p);
  }
  return found;
}

std::vector<NamedRectangle> held_out_rectangles(int n, int count, double width, double height) {
  struct Kind {
    std::string_view name;
    double size;
    std::vector<Place> at;
  };
  const std::array<Kind, 3> kinds{Kind{"shifted", 1.0, places(n, 1.0)},
                                  Kind{"large", 2.0, places(n, 2.0)},
                                  Kind{"small", 0.5, places(n, 0.5)}};
  std::vector<NamedRectangle> lights;
  for (std::size_t k = 0; k < 6; ++k) {
    for (const Kind& kind : kinds) {
      if (k >= kind.at.size() || static_cast<int>(lights.size()) >= count) continue;
      const auto [x, y] = kind.at[k];
      lights.push_back({fmt::format("held_out_{}_{}", kind.name, k),
                        true,
                        {x * width, y * height, kind.size * width, kind.size * height}});
    }
  }
  return lights;
}

std::vector<NamedRectangle> rectangles(const PatternOptions& options,
                                       const Block& block,
                                       Face lit_face) {
  const int n = options.regions;
  const CellSize cell = face_cell_size(block, lit_face);
  const double width = block.face_width(lit_face) * cell.width / n;
  const double height = block.face_height(lit_face) * cell.height / n;
  std::vector<NamedRectangle> lights;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      lights.push_back({fmt::format("region_{}_{}", row, column),
                        false,
                        {column * width, row * height, width, height}});
    }
  }
  for (auto& light : held_out_rectangles(n, options.held_out_lights, width, height)) {
    lights.push_back(std::move(light));
  }
  if (options.uniform_light)
    lights.push_back({"uniform", true, {0.0, 0.0, n * width, n * height}, true});
  return lights;
}

struct PixelRectangle {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

PixelRectangle pixels_of(const LitRectangle& r, const ProjectorCalibration& p) {
  constexpr double kFar = 1e9;  // outside every picture, and an int
  const auto x = [&](double mm) {
    return static_cast<int>(
        std::lround(std::clamp(p.offset_x_px + mm / p.mm_per_pixel, -kFar, kFar)));
  };
  const auto y = [&](double mm) {
    return static_cast<int>(
        std::lround(std::clamp(p.offset_y_px + mm / p.mm_per_pixel, -kFar, kFar)));
  };
  return {x(r.left), y(r.top), x(r.left + r.width), y(r.top + r.height)};
}

Result<PixelRectangle> pixels_within(const NamedRectangle& light,
                                     const ProjectorCalibration& projector) {
  const PixelRectangle box = pixels_of(light.rectangle, projector);
  if (box.left < 0 || box.top < 0 || box.right > projector.width || box.bottom > projector.height) {
    return invalid_argument(
        fmt::format("{} needs projector pixels x {} to {}, y {} to {}, and the projector has {} x "
                    "{}: expected a lit face within its picture",
                    light.name,
                    box.left,
                    box.right,
                    box.top,
                    box.bottom,
                    projector.width,
                    projector.height));
  }
  if (box.right <= box.left || box.bottom <= box.top) {
    return invalid_argument(
        fmt::format("{} is smaller than a projector pixel: expected fewer regions", light.name));
  }
  return box;
}

drivers::Pattern pattern_of(const PixelRectangle& box,
                            std::uint64_t id,
                            std::uint8_t code,
                            const ProjectorCalibration& projector) {
  drivers::Pattern pattern{id, Image<std::uint8_t>(projector.width, projector.height, 3, 0)};
  for (int y = box.top; y < box.bottom; ++y) {
    for (int x = box.left; x < box.right; ++x) {
      for (int c = 0; c < 3; ++c) pattern.codes.at(x, y, c) = code;
    }
  }
  return pattern;
}

drivers::Pattern uniform(std::uint64_t id,
                         const ProjectorCalibration& p,
                         std::uint8_t code,
                         const char* name) {
  return {id, Image<std::uint8_t>(p.width, p.height, 3, code), name};
}

}  // namespace

Image<float> irradiance_of(const Image<std::uint8_t>& codes,
                           const Block& block,
                           Face lit_face,
                           const ProjectorCalibration& p) {
  const int width = block.face_width(lit_face);
  const int height = block.face_height(lit_face);
  const CellSize cell = face_cell_size(block, lit_face);
  const auto columns = overlaps(p.width, p.offset_x_px, p.mm_per_pixel, width, cell.width);
  const auto rows = overlaps(p.height, p.offset_y_px, p.mm_per_pixel, height, cell.height);
  std::array<double, 256> light{};
  for (int code = 0; code < 256; ++code) {
    light[static_cast<std::size_t>(code)] = code == 0 ? 0.0 : relative_light(p, code);
  }
  Image<double> sum(width, height, 3);
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      const double falloff = vignetting_at(p, x, y);
      for (int c = 0; c < 3; ++c) {
        if (codes.at(x, y, c) == 0) continue;
        const double e =
            p.peak_irradiance[static_cast<std::size_t>(c)] * falloff * light[codes.at(x, y, c)];
        for (const Overlap& row : rows[static_cast<std::size_t>(y)]) {
          for (const Overlap& column : columns[static_cast<std::size_t>(x)]) {
            sum.at(column.cell, row.cell, c) += e * row.share * column.share;
          }
        }
      }
    }
  }
  Image<float> irradiance(width, height, 3);
  std::ranges::transform(
      sum.samples(), irradiance.samples().begin(), [](double e) { return static_cast<float>(e); });
  return irradiance;
}

Result<PatternSet> make_patterns(const PatternOptions& options,
                                 const Block& block,
                                 Face lit_face,
                                 const ProjectorCalibration& projector) {
  PatternSet set{uniform(kBlackPattern, projector, 0, "black"),
                 uniform(kWhitePattern, projector, 255, "white"),
                 {}};
  std::uint64_t id = kFirstLight;
  for (const NamedRectangle& light : rectangles(options, block, lit_face)) {
    const auto box = pixels_within(light, projector);
    if (!box) return box.error();
    const int code = light.uniform ? options.uniform_light_code : 255;
    drivers::Pattern pattern = pattern_of(*box, id++, static_cast<std::uint8_t>(code), projector);
    pattern.name = light.name;
    Image<float> irradiance = irradiance_of(pattern.codes, block, lit_face, projector);
    set.lights.push_back(
        {light.name, light.held_out, light.uniform, std::move(pattern), std::move(irradiance)});
  }
  return set;
}

Result<void> check_patterns(const PatternOptions& options,
                            const Block& block,
                            Face lit_face,
                            const ProjectorCalibration& projector) {
  for (const NamedRectangle& light : rectangles(options, block, lit_face)) {
    if (const auto box = pixels_within(light, projector); !box) return box.error();
  }
  return ok();
}

}  // namespace opaline::capture
