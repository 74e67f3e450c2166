#include "reconstruct/regrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace opaline::reconstruct {
namespace {

struct Share {
  int cell = 0;
  double length = 0.0;  // in fine cells
};

// For each of `coarse` equal cells the fine ones it lies on.
std::vector<std::vector<Share>> shares(int fine, int coarse) {
  std::vector<std::vector<Share>> all(static_cast<std::size_t>(coarse));
  const double size = static_cast<double>(fine) / coarse;
  for (int c = 0; c < coarse; ++c) {
    const double begin = c * size;
    const double end = c + 1 == coarse ? fine : begin + size;
    for (int f = static_cast<int>(begin); f < fine && f < end; ++f) {
      const double length = std::min(end, f + 1.0) - std::max(begin, static_cast<double>(f));
      if (length > 1e-9) all[static_cast<std::size_t>(c)].push_back({f, length});
    }
  }
  return all;
}

// Calls visit(coarse x, coarse y, fine x, fine y, area).
class FaceOverlap {
 public:
  FaceOverlap(const Block& fine, const Block& coarse, Face face)
      : width_(coarse.face_width(face)),
        height_(coarse.face_height(face)),
        columns_(shares(fine.face_width(face), width_)),
        rows_(shares(fine.face_height(face), height_)) {}
  int width() const { return width_; }
  int height() const { return height_; }
  template <class Visit>
  void each(Visit visit) const {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        for (const Share& row : rows_[static_cast<std::size_t>(y)])
          for (const Share& column : columns_[static_cast<std::size_t>(x)])
            visit(x, y, column.cell, row.cell, column.length * row.length);
  }

 private:
  int width_;
  int height_;
  std::vector<std::vector<Share>> columns_;
  std::vector<std::vector<Share>> rows_;
};

Image<float> mean(const Image<float>& fine, const FaceOverlap& overlap) {
  const int channels = fine.channels();
  Image<double> sum(overlap.width(), overlap.height(), channels);
  Image<double> area(overlap.width(), overlap.height(), 1);
  overlap.each([&](int x, int y, int i, int j, double a) {
    for (int c = 0; c < channels; ++c) sum.at(x, y, c) += a * fine.at(i, j, c);
    area.at(x, y) += a;
  });
  Image<float> out(overlap.width(), overlap.height(), channels);
  for (std::size_t s = 0; s < out.samples().size(); ++s) {
    const auto pixel = s / static_cast<std::size_t>(channels);
    out.samples()[s] = static_cast<float>(sum.samples()[s] / area.samples()[pixel]);
  }
  return out;
}

// What becomes of one picture, its variance and its mask.
struct Usable {
  explicit Usable(const FaceOverlap& overlap)
      : radiance(overlap.width(), overlap.height(), kColorChannels),
        variance(radiance),
        usable(overlap.width(), overlap.height(), 1),
        all(usable) {}
  void add(const Illumination& fine, int x, int y, int i, int j, double a) {
    all.at(x, y) += a;
    if (fine.mask.at(i, j) == 0) return;
    usable.at(x, y) += a;
    for (int c = 0; c < kColorChannels; ++c) {
      radiance.at(x, y, c) += a * fine.radiance.at(i, j, c);
      variance.at(x, y, c) += a * a * fine.radiance_variance.at(i, j, c);
    }
  }
  Image<double> radiance;
  Image<double> variance;
  Image<double> usable;
  Image<double> all;
};

void put_pictures(const Illumination& fine, const FaceOverlap& overlap, Illumination& out) {
  Usable sums(overlap);
  overlap.each([&](int x, int y, int i, int j, double a) { sums.add(fine, x, y, i, j, a); });
  out.radiance = Image<float>(overlap.width(), overlap.height(), kColorChannels);
  out.radiance_variance = out.radiance;
  out.mask = Image<std::uint8_t>(overlap.width(), overlap.height(), 1);
  for (int y = 0; y < overlap.height(); ++y)
    for (int x = 0; x < overlap.width(); ++x) {
      const double a = sums.usable.at(x, y);
      if (a < 0.5 * sums.all.at(x, y)) continue;
      out.mask.at(x, y) = 1;
      for (int c = 0; c < kColorChannels; ++c) {
        out.radiance.at(x, y, c) = static_cast<float>(sums.radiance.at(x, y, c) / a);
        out.radiance_variance.at(x, y, c) = static_cast<float>(sums.variance.at(x, y, c) / (a * a));
      }
    }
}

// Where the centre of a coarse or fine cell lies between the centres of others.
struct Between {
  int low = 0;
  int high = 0;
  double share = 0.0;  // of high
};

std::vector<Between> between(int from, int to) {
  std::vector<Between> places;
  for (int t = 0; t < to; ++t) {
    const double at = std::clamp((t + 0.5) * from / to - 0.5, 0.0, from - 1.0);
    const int low = static_cast<int>(at);
    places.push_back({low, std::min(low + 1, from - 1), at - low});
  }
  return places;
}

std::vector<double> interpolated(const std::vector<double>& values,
                                 const Block& from,
                                 const Block& to) {
  constexpr double kNone = 1e-30;  // stands for an absorption of zero
  std::vector<double> log(values.size());
  std::ranges::transform(values, log.begin(), [](double v) { return std::log(v + kNone); });
  const auto xs = between(from.nx, to.nx);
  const auto ys = between(from.ny, to.ny);
  const auto zs = between(from.nz, to.nz);
  std::vector<double> out;
  out.reserve(to.cell_count());
  for (const Between& z : zs)
    for (const Between& y : ys)
      for (const Between& x : xs) {
        double sum = 0.0;
        for (const auto& [k, wk] : {std::pair{z.low, 1.0 - z.share}, {z.high, z.share}})
          for (const auto& [j, wj] : {std::pair{y.low, 1.0 - y.share}, {y.high, y.share}})
            for (const auto& [i, wi] : {std::pair{x.low, 1.0 - x.share}, {x.high, x.share}})
              sum += wk * wj * wi * log[from.index(i, j, k)];
        const double value = std::exp(sum);
        out.push_back(value > 2.0 * kNone ? value : 0.0);
      }
  return out;
}

bool has_data(const Illumination& i) {
  return std::ranges::any_of(i.mask.samples(), [](std::uint8_t m) { return m != 0; });
}

// Which of n x n equal parts of the lit face holds the centre of the light; the first when there is none.
std::pair<int, int> part_of(const Image<float>& light, int n) {
  double sum = 0.0;
  double sx = 0.0;
  double sy = 0.0;
  for (int y = 0; y < light.height(); ++y)
    for (int x = 0; x < light.width(); ++x)
      for (int c = 0; c < light.channels(); ++c) {
        sum += light.at(x, y, c);
        sx += light.at(x, y, c) * (x + 0.5);
        sy += light.at(x, y, c) * (y + 0.5);
      }
  if (!(sum > 0.0)) return {0, 0};
  const auto part = [&](double moment, int size) {
    return std::clamp(static_cast<int>(n * moment / (sum * size)), 0, n - 1);
  };
  return {part(sy, light.height()), part(sx, light.width())};
}

void add(const Image<float>& more, Image<float>& sum) {
  for (std::size_t s = 0; s < sum.samples().size(); ++s) sum.samples()[s] += more.samples()[s];
}

void add(const Illumination& more, Illumination& sum) {
  add(more.irradiance, sum.irradiance);
  add(more.radiance, sum.radiance);
  add(more.radiance_variance, sum.radiance_variance);
  for (std::size_t p = 0; p < sum.mask.samples().size(); ++p)
    sum.mask.samples()[p] &= more.mask.samples()[p];
}

}  // namespace

Block coarser(const Block& block, double step) {
  const auto along = [&](int cells) {
    return std::max(1, static_cast<int>(std::lround(cells / step)));
  };
  const Vec3 size = block.size();
  const int nx = along(block.nx);
  const int ny = along(block.ny);
  const int nz = along(block.nz);
  return {nx, ny, nz, size.x / nx, size.y / ny, size.z / nz};
}

Dataset on_grid(const Dataset& dataset, const Block& block) {
  if (block == dataset.block) return dataset;
  const FaceOverlap lit(dataset.block, block, dataset.lit_face);
  const FaceOverlap seen(dataset.block, block, dataset.seen_face);
  Dataset out = dataset;
  out.block = block;
  out.view_cosine = mean(dataset.view_cosine, seen);
  if (!dataset.view_direction.samples().empty())
    out.view_direction = mean(dataset.view_direction, seen);
  for (std::size_t m = 0; m < dataset.illuminations.size(); ++m) {
    const Illumination& fine = dataset.illuminations[m];
    out.illuminations[m].irradiance = mean(fine.irradiance, lit);
    put_pictures(fine, seen, out.illuminations[m]);
  }
  return out;
}

Material on_grid(const Material& material, const Block& block) {
  if (block == material.block) return material;
  Material out = material;
  out.block = block;
  for (ChannelCoefficients& c : out.channels) {
    c.absorption = interpolated(c.absorption, material.block, block);
    c.reduced_scattering = interpolated(c.reduced_scattering, material.block, block);
  }
  return out;
}

Result<Dataset> with_regions(const Dataset& dataset, int n) {
  if (n < 1) return invalid_argument(fmt::format("{} x {} regions; expected at least 1", n, n));
  const auto is_fitted = [](const Illumination& i) { return !i.held_out; };
  const auto regions = std::ranges::count_if(dataset.illuminations, is_fitted);
  if (regions <= static_cast<std::ptrdiff_t>(n) * n) return dataset;
  std::map<std::pair<int, int>, Illumination> sums;
  Dataset out = dataset;
  std::erase_if(out.illuminations, is_fitted);
  for (const Illumination& i : dataset.illuminations) {
    if (i.held_out || !has_data(i)) continue;
    const auto [place, is_new] = sums.try_emplace(part_of(i.irradiance, n), i);
    if (!is_new) add(i, place->second);
  }
  std::vector<Illumination> lights;
  for (auto& [place, sum] : sums) {
    sum.name = fmt::format("region_{}_{}", place.first, place.second);
    lights.push_back(std::move(sum));
  }
  out.illuminations.insert(out.illuminations.begin(),
                           std::make_move_iterator(lights.begin()),
                           std::make_move_iterator(lights.end()));
  return out;
}

}  // namespace opaline::reconstruct
