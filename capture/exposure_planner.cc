#include "capture/exposure_planner.h"

#include <algorithm>
#include <cmath>

#include "capture/told_black.h"

namespace opaline::capture {
namespace {

constexpr std::size_t kMostCells = 1024;
constexpr double kStretch = 4.0;      // an exposure over all before it together
constexpr double kNearFull = 0.9;     // of the codes up to clipping: not averaged
constexpr double kLeastRate = 0.3;    // of its deviation: what is darker cannot be told from it
constexpr double kBrightest = 0.995;  // quantile
constexpr double kMargin = 1.01;      // of the SNR: the light is known no better than by it

double rounding_and_read_noise(const CameraCalibration& camera) {
  const double read = camera.read_noise_electrons;
  const double step = camera.gain_electrons_per_code;
  return read * read + step * step / 12.0;
}

}  // namespace

PlannedCells::PlannedCells(const SurfaceMap& map,
                           const Image<std::uint8_t>& usable,
                           double min_coverage) {
  for (std::size_t place = 0; place < map.cell_count(); ++place) {
    Cell cell;
    cell.place = place;
    double area = 0.0;
    for (const PixelShare& share : map.shares_of(place)) {
      if (usable.at(share.x, share.y) == 0) continue;
      area += share.area;
      cell.pixels.push_back(
          {static_cast<std::size_t>(share.y) * usable.width() + share.x, share.area});
    }
    if (!(area > 0.0) || area < min_coverage * map.cell_area(place)) continue;
    double squares = 0.0;
    for (Pixel& pixel : cell.pixels) {
      pixel.weight /= area;
      squares += pixel.weight * pixel.weight;
    }
    cell.count = 1.0 / squares;
    cells_.push_back(std::move(cell));
  }
  if (cells_.size() <= kMostCells) return;
  for (std::size_t i = 0; i < kMostCells; ++i)
    cells_[i] = std::move(cells_[i * cells_.size() / kMostCells]);
  cells_.resize(kMostCells);
}

ExposurePlanner::ExposurePlanner(const ExposureOptions& options,
                                 const CameraCalibration& camera,
                                 std::span<const std::chrono::nanoseconds> ladder,
                                 double most_seconds,
                                 const PlannedCells& cells,
                                 const Image<std::uint8_t>& ignored,
                                 std::span<const int> blacks)
    : camera_(camera),
      wanted_snr_(kMargin * options.planned_snr),
      dim_share_(options.dim_share),
      clipping_code_(clipping_code(camera)),
      most_seconds_(most_seconds) {
  std::size_t samples = 0;
  for (const PlannedCells::Cell& cell : cells.cells()) {
    if (!ignored.empty() && ignored.samples()[cell.place] != 0) continue;
    cells_.push_back(&cell);
    samples += 3 * cell.pixels.size();
  }
  seen_.resize(samples);
  const int codes = 1 << camera.bit_depth;
  for (int code = 0; code < codes; ++code) electrons_.push_back(electrons_from_code(camera, code));
  for (const auto time : ladder)
    problem_.seconds.push_back(std::chrono::duration<double>(time).count());
  problem_.taken.assign(ladder.size(), 0);
  problem_.blacks.assign(blacks.begin(), blacks.end());
  problem_.blacks.resize(ladder.size(), 1);
  problem_.share = options.planned_share;
  problem_.read_variance = rounding_and_read_noise(camera);
  problem_.clipping_electrons = electrons_from_code(camera, clipping_code_).signal;
}

void ExposurePlanner::collect(const ExposurePair& pair, bool shortest) {
  const double near_full = camera_.black_level + kNearFull * (clipping_code_ - camera_.black_level);
  const double scale = pair.light_seconds / pair.black_seconds;
  const std::size_t last = electrons_.size() - 1;
  const auto signal = [&](std::uint16_t code) {
    return electrons_[std::min<std::size_t>(code, last)].signal;
  };
  std::size_t sample = 0;
  for (const PlannedCells::Cell* const cell : cells_) {
    for (const PlannedCells::Pixel& pixel : cell->pixels) {
      for (std::size_t c = 0; c < 3; ++c) {
        Seen& seen = seen_[sample++];
        const std::uint16_t code = pair.light->samples()[3 * pixel.place + c];
        if (code > near_full && !shortest) continue;
        const double black = black_of(pair, 3 * pixel.place + c, electrons_).electrons.signal;
        seen.electrons += signal(code) - scale * black;
        seen.seconds += pair.light_seconds;
        seen.leak += black;
        seen.black_seconds += pair.black_seconds;
      }
    }
  }
}

void ExposurePlanner::estimate() {
  problem_.cells.clear();
  std::size_t sample = 0;
  for (const PlannedCells::Cell* const cell : cells_) {
    auto& lights = problem_.cells.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      double rate = 0.0;
      double leak = 0.0;
      double variance = 0.0;
      double brightest = 0.0;
      for (std::size_t p = 0; p < cell->pixels.size(); ++p) {
        const Seen& seen = seen_[sample + 3 * p + c];
        const double weight = cell->pixels[p].weight;
        const double own = std::max(0.0, seen.electrons / seen.seconds);
        const double dark = std::max(0.0, seen.leak / seen.black_seconds);
        const double noise =
            (own + 2.0 * dark + 2.0 * problem_.read_variance / seen.seconds) / seen.seconds;
        rate += weight * seen.electrons / seen.seconds;
        leak += weight * dark;
        variance += weight * weight * noise;
        brightest = std::max(brightest, own + dark - 3.0 * std::sqrt(noise));
      }
      rate = std::max(rate, kLeastRate * std::sqrt(variance));
      lights[c] = {rate, leak, std::max(brightest, rate + leak), cell->count};
    }
    sample += 3 * cell->pixels.size();
  }
  want();
}

void ExposurePlanner::want() {
  if (problem_.cells.empty()) return;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> rates;
    for (const auto& lights : problem_.cells) rates.push_back(lights[c].rate);
    const auto place =
        static_cast<std::ptrdiff_t>(kBrightest * static_cast<double>(rates.size() - 1));
    std::ranges::nth_element(rates, rates.begin() + place);
    const double dim = dim_share_ * rates[static_cast<std::size_t>(place)];
    for (auto& lights : problem_.cells) {
      lights[c].wanted_snr = wanted_snr_ * std::min(1.0, dim > 0.0 ? lights[c].rate / dim : 1.0);
    }
  }
}

void ExposurePlanner::add(std::size_t index,
                          const ExposurePair& pair,
                          const FrameLight& /*light*/) {
  const bool first = std::ranges::all_of(problem_.taken, [](int n) { return n == 0; });
  collect(pair, first || index == 0);
  ++problem_.taken[index];
  problem_.blacks[index] =
      pair.told != nullptr ? pair.told->blacks : static_cast<int>(1 + pair.more_black.size());
  estimate();
}

std::optional<std::size_t> ExposurePlanner::next() {
  double so_far = 0.0;
  std::size_t longest = 0;
  for (std::size_t k = 0; k < problem_.taken.size(); ++k) {
    so_far += problem_.taken[k] * problem_.seconds[k];
    if (problem_.taken[k] > 0) longest = k;
  }
  if (so_far == 0.0) return 0;
  problem_.most_seconds = most_seconds_ - so_far;
  const ExposureAnswer answer = plan_exposures(problem_);
  std::optional<std::size_t> wanted;
  if (answer.reaches) {
    for (std::size_t k = 0; k < answer.frames.size(); ++k) {
      if (answer.frames[k] > 0) wanted = k;
    }
    if (!wanted) return std::nullopt;
  } else {
    wanted = problem_.seconds.size() - 1;  // as long as there is time
  }
  while (*wanted > longest + 1 && problem_.seconds[*wanted] > kStretch * so_far) --*wanted;
  while (*wanted > 0 && problem_.seconds[*wanted] > problem_.most_seconds * (1.0 + 1e-9)) --*wanted;
  if (problem_.seconds[*wanted] > problem_.most_seconds * (1.0 + 1e-9)) return std::nullopt;
  return wanted;
}

}  // namespace opaline::capture
