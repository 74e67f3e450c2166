#include "sim/blob_transfer.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace opaline::sim {
namespace {

using std::numbers::pi;

constexpr double kLikeNormal = 0.9;  // cosine

constexpr std::size_t term(int l, int m) { return static_cast<std::size_t>(l * (l + 1) + m); }

/// sqrt((2 l + 1)/(4 pi) (l - m)!/(l + m)!), and sqrt(2) times it where m > 0.
std::array<double, kTransferTerms> norms() {
  std::array<double, kTransferTerms> norm{};
  for (int l = 0; l <= kTransferDegree; ++l)
    for (int m = 0; m <= l; ++m) {
      double ratio = 1.0;
      for (int k = l - m + 1; k <= l + m; ++k) ratio /= k;
      norm[term(l, m)] = std::sqrt((m > 0 ? 2.0 : 1.0) * (2.0 * l + 1.0) / (4.0 * pi) * ratio);
    }
  return norm;
}

/// From the surface to the sphere of lights: the direction from the middle, and one over the cosine at which its wall is met.
struct Arrival {
  Vec3 direction;
  double factor = 1.0;
};

Arrival arrival(const BlobWalk::Origin& origin, double stage_mm) {
  if (stage_mm == 0.0) return {origin.way, 1.0};
  const double along = dot(origin.from, origin.way);
  const double far =
      std::sqrt(along * along - dot(origin.from, origin.from) + stage_mm * stage_mm) - along;
  const Vec3 unit = (origin.from + origin.way * far) * (1.0 / stage_mm);
  return {unit, 1.0 / dot(unit, origin.way)};
}

BlobTransfer trace_place(const BlobWalk& walk,
                         const SeenPlace& place,
                         const TransferSize& size,
                         PathNumbers& numbers) {
  std::array<double, kTransferTerms> sum{};
  double squares = 0.0;
  for (std::int64_t n = 0; n < size.paths; ++n) {
    const auto origin = walk.trace(place.point, place.normal, place.to_camera, numbers);
    if (!origin) continue;
    const Arrival lamp = arrival(*origin, size.stage_mm);
    const auto y = harmonics(lamp.direction);
    const double weight = origin->weight * lamp.factor;
    for (std::size_t k = 0; k < kTransferTerms; ++k) sum[k] += weight * y[k];
    squares += weight * weight * y[0] * y[0];
  }
  const auto paths = static_cast<double>(size.paths);
  BlobTransfer transfer;
  for (std::size_t k = 0; k < kTransferTerms; ++k)
    transfer.terms[k] = static_cast<float>(sum[k] / paths);
  const double mean = sum[0] / paths;
  transfer.variance = static_cast<float>((squares / paths - mean * mean) / paths);
  return transfer;
}

/// 1, u, v, u^2, u v, v^2
using Quadratic = Eigen::Matrix<double, 6, 1>;

/// What a quadratic surface fitted to neighbours says in the middle, as a weight for each of them.
class QuadraticFit {
 public:
  explicit QuadraticFit(double reach) : scale_(1.0 / reach) {}
  void clear() {
    squares_.setZero();
    count_ = 0;
  }
  void add(double u, double v) {
    const Quadratic q = terms(u, v);
    squares_.selfadjointView<Eigen::Lower>().rankUpdate(q);
    ++count_;
  }
  /// None where the neighbours do not tell the terms apart.
  std::optional<Quadratic> weights() const {
    if (count_ < 12) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> factors(
        squares_.selfadjointView<Eigen::Lower>());
    const auto pivots = factors.vectorD();
    if (!(pivots.minCoeff() > 1e-5 * pivots.maxCoeff())) return std::nullopt;
    return factors.solve(Quadratic::Unit(0));
  }
  Quadratic terms(double u, double v) const {
    const double a = scale_ * u;
    const double b = scale_ * v;
    return {1.0, a, b, a * a, a * b, b * b};
  }

 private:
  double scale_;
  Eigen::Matrix<double, 6, 6> squares_ = Eigen::Matrix<double, 6, 6>::Zero();
  int count_ = 0;
};

}  // namespace

std::array<double, kTransferTerms> harmonics(Vec3 u) {
  static const auto kNorms = norms();
  std::array<double, kTransferTerms> out{};
  // P_l^m(z) / (1 - z^2)^(m/2), whose powers the turns (x + i y)^m bring along.
  double turn_real = 1.0;
  double turn_imaginary = 0.0;
  double diagonal = 1.0;
  for (int m = 0; m <= kTransferDegree; ++m) {
    double before = 0.0;
    double now = diagonal;
    for (int l = m; l <= kTransferDegree; ++l) {
      const double value = now * kNorms[term(l, m)];
      out[term(l, m)] = value * turn_real;
      if (m > 0) out[term(l, -m)] = value * turn_imaginary;
      const double next = ((2.0 * l + 1.0) * u.z * now - (l + m) * before) / (l - m + 1.0);
      before = now;
      now = next;
    }
    diagonal *= 2.0 * m + 1.0;
    const double real = turn_real * u.x - turn_imaginary * u.y;
    turn_imaginary = turn_real * u.y + turn_imaginary * u.x;
    turn_real = real;
  }
  return out;
}

Result<std::vector<BlobTransfer>> trace_transfer(const Blob& blob,
                                                 const BlobMaterial& material,
                                                 std::span<const SeenPlace> places,
                                                 const TransferSize& size,
                                                 std::uint64_t seed,
                                                 ThreadTeam& team,
                                                 const std::function<void(double)>& progress,
                                                 std::stop_token stop) {
  const auto good = [](const BlobCoefficients& c) {
    return c.extinction > 0.0 && std::isfinite(c.extinction) && c.reduced_albedo >= 0.0 &&
           c.reduced_albedo < 1.0;
  };
  if (!good(material.first) || (material.mixture != BlobMixture::kNone && !good(material.second)))
    return invalid_argument(
        "material; expected an extinction > 0 and a reduced albedo of 0 to below 1");
  if (!(material.ior >= 1.0 && material.ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", material.ior));
  if (size.paths < 16 || (size.stage_mm != 0.0 && !(size.stage_mm > blob.outer_mm())))
    return invalid_argument(
        fmt::format("{} paths on a stage of {} mm; expected 16 or more, and the body within",
                    size.paths,
                    size.stage_mm));
  const BlobWalk walk(blob, material);
  std::vector<BlobTransfer> transfer(places.size());
  team.run([&](int thread) {
    for (std::size_t n = static_cast<std::size_t>(thread); n < places.size();
         n += static_cast<std::size_t>(team.size())) {
      if (stop.stop_requested()) return;
      PathNumbers numbers(seed * 0x2545f4914f6cdd1dULL + (n + 1) * 0xd1342543de82ef95ULL);
      transfer[n] = trace_place(walk, places[n], size, numbers);
      if (thread == 0 && progress && n / static_cast<std::size_t>(team.size()) % 256 == 255)
        progress(static_cast<double>(n) / static_cast<double>(places.size()));
    }
  });
  if (stop.stop_requested()) return cancelled("light in a body: stopped");
  return transfer;
}

std::vector<BlobTransfer> smoothed(std::span<const BlobTransfer> transfer,
                                   std::span<const SeenPlace> places,
                                   std::span<const std::uint32_t> pixel_of,
                                   int columns,
                                   int half,
                                   double reach_mm,
                                   ThreadTeam& team) {
  std::unordered_map<std::int64_t, std::size_t> at;
  for (std::size_t n = 0; n < pixel_of.size(); ++n) at.emplace(pixel_of[n], n);
  std::vector<BlobTransfer> out(transfer.begin(), transfer.end());
  team.run([&](int thread) {
    struct Neighbour {
      std::size_t place;
      double u;
      double v;
    };
    std::vector<Neighbour> near;
    QuadraticFit fit(reach_mm);
    for (std::size_t n = static_cast<std::size_t>(thread); n < places.size();
         n += static_cast<std::size_t>(team.size())) {
      near.clear();
      fit.clear();
      const SeenPlace& here = places[n];
      const Vec3 across = normalized(
          cross(here.normal, std::abs(here.normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
      const Vec3 along = cross(here.normal, across);
      for (int dy = -half; dy <= half; ++dy)
        for (int dx = -half; dx <= half; ++dx) {
          const auto found = at.find(std::int64_t{pixel_of[n]} + std::int64_t{dy} * columns + dx);
          if (found == at.end()) continue;
          const SeenPlace& there = places[found->second];
          const Vec3 to = there.point - here.point;
          if (dot(to, to) > reach_mm * reach_mm || dot(here.normal, there.normal) < kLikeNormal)
            continue;
          near.push_back({found->second, dot(to, across), dot(to, along)});
          fit.add(near.back().u, near.back().v);
        }
      const auto weights = fit.weights();
      if (!weights) continue;
      std::array<double, kTransferTerms> mean{};
      double variance = 0.0;
      for (const Neighbour& neighbour : near) {
        const double w = weights->dot(fit.terms(neighbour.u, neighbour.v));
        const BlobTransfer& other = transfer[neighbour.place];
        for (std::size_t k = 0; k < kTransferTerms; ++k) mean[k] += w * other.terms[k];
        variance += w * w * other.variance;
      }
      for (std::size_t k = 0; k < kTransferTerms; ++k)
        out[n].terms[k] = static_cast<float>(mean[k]);
      out[n].variance = static_cast<float>(variance);
    }
  });
  return out;
}

}  // namespace opaline::sim
