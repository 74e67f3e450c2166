#include "capture/patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

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

drivers::Pattern pattern_of(const Image<std::uint8_t>& lit,
                            std::uint64_t id,
                            std::uint8_t code,
                            const std::string& name) {
  drivers::Pattern pattern{id, Image<std::uint8_t>(lit.width(), lit.height(), 3, 0), name};
  for (std::size_t i = 0; i < pattern.codes.samples().size(); ++i)
    if (lit.samples()[i / 3] != 0) pattern.codes.samples()[i] = code;
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
                           const ProjectorCalibration& projector) {
  return make_face_light(block, lit_face, projector)->irradiance(codes);
}

Result<PatternSet> make_patterns(const PatternOptions& options,
                                 const Block& block,
                                 Face lit_face,
                                 const ProjectorCalibration& projector) {
  PatternSet set{uniform(kBlackPattern, projector, 0, "black"),
                 uniform(kWhitePattern, projector, 255, "white"),
                 {}};
  std::uint64_t id = kFirstLight;
  const auto face = make_face_light(block, lit_face, projector);
  for (const NamedRectangle& light : rectangles(options, block, lit_face)) {
    if (auto reached = face->check(light.rectangle); !reached)
      return reached.error().in(light.name);
    const int code = light.uniform ? options.uniform_light_code : 255;
    drivers::Pattern pattern = pattern_of(
        face->pixels_on(light.rectangle), id++, static_cast<std::uint8_t>(code), light.name);
    Image<float> irradiance = face->irradiance(pattern.codes);
    set.lights.push_back(
        {light.name, light.held_out, light.uniform, std::move(pattern), std::move(irradiance)});
  }
  return set;
}

Result<void> check_patterns(const PatternOptions& options,
                            const Block& block,
                            Face lit_face,
                            const ProjectorCalibration& projector) {
  const auto face = make_face_light(block, lit_face, projector);
  for (const NamedRectangle& light : rectangles(options, block, lit_face)) {
    if (auto reached = face->check(light.rectangle); !reached)
      return reached.error().in(light.name);
  }
  return ok();
}

}  // namespace opaline::capture
