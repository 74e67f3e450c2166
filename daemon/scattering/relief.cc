#include "daemon/scattering/relief.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;
using reconstruct::ScatteringMaps;

constexpr double kSteepest = 0.15;  // n_z below which a slope is not believed
constexpr int kSweeps = 1500;
constexpr double kOverRelaxation = 1.9;

std::size_t cell(const Relief& r, int x, int y) { return r.index(x, y); }

/// Slopes along a row and down a column.
struct Slopes {
  std::vector<double> x;
  std::vector<double> y;
};

Slopes slopes_of(const Relief& r, const Image<float>& normals) {
  Slopes slopes{std::vector<double>(r.height_mm.size()), std::vector<double>(r.height_mm.size())};
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x) {
      const double nz = std::max<double>(kSteepest, normals.at(x * r.step, y * r.step, 2));
      slopes.x[cell(r, x, y)] = -normals.at(x * r.step, y * r.step, 0) / nz;
      slopes.y[cell(r, x, y)] = -normals.at(x * r.step, y * r.step, 1) / nz;
    }
  return slopes;
}

void relax(Relief& r, const Slopes& s) {
  constexpr std::array<std::array<int, 2>, 4> kAround{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) {
        if (!r.has(x, y)) continue;
        double sum = 0.0;
        double count = 0.0;
        for (const auto& [dx, dy] : kAround) {
          if (!r.has(x + dx, y + dy)) continue;
          const auto& slope = dx != 0 ? s.x : s.y;
          const double between = 0.5 * (slope[cell(r, x, y)] + slope[cell(r, x + dx, y + dy)]);
          sum += r.at(x + dx, y + dy) - (dx + dy) * between * r.cell_mm;
          count += 1.0;
        }
        if (count == 0.0) continue;
        float& z = r.height_mm[cell(r, x, y)];
        z += static_cast<float>(kOverRelaxation * (sum / count - z));
      }
}

/// Each connected part's lowest place to 0.
void set_down(Relief& r) {
  std::vector<std::uint8_t> done(r.height_mm.size(), 0);
  for (int y0 = 0; y0 < r.height; ++y0)
    for (int x0 = 0; x0 < r.width; ++x0) {
      if (!r.has(x0, y0) || done[cell(r, x0, y0)] != 0) continue;
      std::vector<std::array<int, 2>> part{{x0, y0}};
      done[cell(r, x0, y0)] = 1;
      for (std::size_t n = 0; n < part.size(); ++n) {
        const auto [x, y] = part[n];
        for (const auto& [dx, dy] :
             std::array<std::array<int, 2>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}})
          if (r.has(x + dx, y + dy) && std::exchange(done[cell(r, x + dx, y + dy)], 1) == 0)
            part.push_back({x + dx, y + dy});
      }
      float low = std::numeric_limits<float>::max();
      for (const auto& [x, y] : part) low = std::min(low, r.at(x, y));
      for (const auto& [x, y] : part) r.height_mm[cell(r, x, y)] -= low;
    }
}

constexpr std::array<std::vector<float> ReliefMaps::*, 5> kReliefMaps{
    &ReliefMaps::absorption,
    &ReliefMaps::reduced_scattering,
    &ReliefMaps::translucency,
    &ReliefMaps::reduced_albedo,
    &ReliefMaps::diffusion};
constexpr std::array<std::vector<float> ScatteringMaps::*, 5> kPixelMaps{
    &ScatteringMaps::absorption,
    &ScatteringMaps::reduced_scattering,
    &ScatteringMaps::translucency,
    &ScatteringMaps::reduced_albedo,
    &ScatteringMaps::diffusion};

/// Breadth first from the places that are known.
void fill_holes(const Relief& r,
                std::vector<std::size_t> front,
                std::vector<std::uint8_t>& known,
                ReliefMaps& maps) {
  for (std::size_t n = 0; n < front.size(); ++n) {
    const std::size_t from = front[n];
    const int x = static_cast<int>(from % static_cast<std::size_t>(r.width));
    const int y = static_cast<int>(from / static_cast<std::size_t>(r.width));
    for (const auto& [dx, dy] :
         std::array<std::array<int, 2>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= r.width || y + dy >= r.height) continue;
      const std::size_t to = cell(r, x + dx, y + dy);
      if (std::exchange(known[to], 1) != 0) continue;
      for (const auto map : kReliefMaps) (maps.*map)[to] = (maps.*map)[from];
      front.push_back(to);
    }
  }
}

}  // namespace

bool Relief::has(int x, int y) const {
  return x >= 0 && y >= 0 && x < width && y < height && std::isfinite(at(x, y));
}

Relief relief_of(const SphereMaps& maps, const SphereSession& session, int most_cells) {
  const Image<std::uint8_t>& measured = session.measured;
  Relief r;
  r.step =
      std::max(1, (std::max(measured.width(), measured.height()) + most_cells - 1) / most_cells);
  r.width = measured.width() / r.step;
  r.height = measured.height() / r.step;
  r.cell_mm = session.record.pixel_mm * r.step;
  const Image<float> normals = mean_normals(maps);
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x)
      r.height_mm.push_back(measured.at(x * r.step, y * r.step) != 0 &&
                                    normals.at(x * r.step, y * r.step, 2) > 0.0F
                                ? 0.0F
                                : std::numeric_limits<float>::quiet_NaN());
  relax(r, slopes_of(r, normals));
  set_down(r);
  return r;
}

Result<ReliefMaps> nearest_maps(const Relief& r, const ScatteringMaps& maps) {
  ReliefMaps out;
  for (const auto map : kReliefMaps) (out.*map).assign(r.height_mm.size(), 0.0F);
  std::vector<std::uint8_t> known(r.height_mm.size(), 0);
  std::vector<std::size_t> front;
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y * r.step) * static_cast<std::size_t>(maps.width) +
          static_cast<std::size_t>(x * r.step);
      if (maps.left_out[at] != LeftOut::kFound) continue;
      const std::size_t to = cell(r, x, y);
      for (std::size_t k = 0; k < kReliefMaps.size(); ++k)
        (out.*kReliefMaps[k])[to] = (maps.*kPixelMaps[k])[at];
      known[to] = 1;
      front.push_back(to);
    }
  if (front.empty())
    return invalid_argument("no pixel has an answer, so there is no material to make a volume of");
  fill_holes(r, std::move(front), known, out);
  return out;
}

std::string relief_obj(const Relief& r) {
  std::string text =
      "# The seen surface and its mirror image behind; mm; coordinates over the picture\n";
  std::vector<int> number(r.height_mm.size(), 0);
  int count = 0;
  const auto put = [&](double side) {
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x)
        if (r.has(x, y))
          text += fmt::format("v {:.4f} {:.4f} {:.4f}\nvt {:.5f} {:.5f}\n",
                              (x + 0.5 - 0.5 * r.width) * r.cell_mm,
                              (0.5 * r.height - y - 0.5) * r.cell_mm,
                              side * (r.at(x, y) + 0.5 * r.cell_mm),
                              (x + 0.5) / r.width,
                              1.0 - (y + 0.5) / r.height);
  };
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x)
      if (r.has(x, y)) number[cell(r, x, y)] = ++count;
  put(1.0);
  put(-1.0);
  const auto face = [&](int a, int b, int c) {
    text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", a, b, c);
  };
  const auto whole = [&](int x, int y) {
    return r.has(x, y) && r.has(x + 1, y) && r.has(x, y + 1) && r.has(x + 1, y + 1);
  };
  const auto id = [&](int x, int y) { return number[cell(r, x, y)]; };
  const auto wall =
      [&](int a, int b) {  // from front edge a to b, seen from outside with the body on the left
        face(a, a + count, b);
        face(b, a + count, b + count);
      };
  for (int y = 0; y + 1 < r.height; ++y)
    for (int x = 0; x + 1 < r.width; ++x) {
      if (!whole(x, y)) continue;
      const std::array corner{id(x, y), id(x, y + 1), id(x + 1, y + 1), id(x + 1, y)};
      face(corner[0], corner[1], corner[2]);
      face(corner[0], corner[2], corner[3]);
      face(corner[0] + count, corner[2] + count, corner[1] + count);
      face(corner[0] + count, corner[3] + count, corner[2] + count);
      if (!whole(x - 1, y)) wall(corner[0], corner[1]);
      if (!whole(x, y + 1)) wall(corner[1], corner[2]);
      if (!whole(x + 1, y)) wall(corner[2], corner[3]);
      if (!whole(x, y - 1)) wall(corner[3], corner[0]);
    }
  return text;
}

}  // namespace opaline::daemon
