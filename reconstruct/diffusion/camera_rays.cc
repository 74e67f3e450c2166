#include "reconstruct/diffusion/camera_rays.h"

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/centroid.h"
#include "reconstruct/diffusion/face_step.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kFaintest = 1e-4;  // E_N, where a ray may end

double between(double begin, double end, double share) { return begin + share * (end - begin); }

}  // namespace

CameraRay camera_ray(double ior, double column, double row) {
  const double inside_column = column / ior;
  const double inside_row = row / ior;
  const double cosine = std::sqrt(1.0 - inside_column * inside_column - inside_row * inside_row);
  return {-inside_column / cosine, -inside_row / cosine, 1.0 / cosine};
}

// The face's cells and the layers behind them.
class CameraRays::Raster {
 public:
  Raster(const Block& block, Face face)
      : block_(block),
        face_(face),
        spacing_{block.spacing()[axis_of(face) == 0 ? 1 : 0],
                 block.spacing()[axis_of(face) == 2 ? 1 : 2]},
        layers_(static_cast<std::size_t>(block.cells()[axis_of(face)])) {}

  int width() const { return block_.face_width(face_); }
  int height() const { return block_.face_height(face_); }
  std::size_t layers() const { return layers_; }
  double column_spacing() const { return spacing_[0]; }
  double row_spacing() const { return spacing_[1]; }
  std::size_t cell(int column, int row, std::size_t layer) const {
    return block_.cell_behind(face_, column, row) +
           static_cast<std::ptrdiff_t>(layer) * inwards(block_, face_);
  }
  std::size_t step(int columns, int rows) const {
    return block_.cell_behind(face_, std::min(columns, width() - 1), std::min(rows, height() - 1)) -
           block_.cell_behind(face_, 0, 0);
  }

 private:
  const Block& block_;
  Face face_;
  std::array<double, 2> spacing_;
  std::size_t layers_;
};

CameraRays::CameraRays(const Medium& medium,
                       const Boundary& boundary,
                       Face face,
                       std::span<const CameraRay> rays)
    : h_(medium.block.spacing()[axis_of(face)]),
      diffusion_(medium.diffusion),
      absorption_(medium.absorption) {
  ENSURE(rays.size() == medium.block.face_cell_count(face));
  const Raster raster(medium.block, face);
  corner_ = {0, raster.step(1, 0), raster.step(0, 1), raster.step(1, 1)};
  rays_.reserve(rays.size());
  for (int row = 0; row < raster.height(); ++row) {
    for (int column = 0; column < raster.width(); ++column) {
      trace(medium, raster, column, row, rays[rays_.size()]);
      Ray& ray = rays_.back();
      const double kappa = medium.diffusion[ray.surface];
      const double gb = boundary.conductance(h_, kappa);
      ray.fluence_share = 2.0 * boundary.a * gb;
      ray.fluence_slope = 2.0 * boundary.a * gb * gb * h_ / (2.0 * kappa * kappa);
    }
  }
}

CameraRays::Sample CameraRays::sample(const Medium& medium,
                                      const Raster& raster,
                                      double column,
                                      double row,
                                      std::size_t layer) const {
  const double x = std::clamp(column, 0.0, raster.width() - 1.0);
  const double y = std::clamp(row, 0.0, raster.height() - 1.0);
  const int left = std::clamp(static_cast<int>(x), 0, std::max(0, raster.width() - 2));
  const int low = std::clamp(static_cast<int>(y), 0, std::max(0, raster.height() - 2));
  const double right_share = x - left;
  const double high_share = y - low;
  Sample s;
  s.cell = raster.cell(left, low, layer);
  s.weight = {(1.0 - right_share) * (1.0 - high_share),
              right_share * (1.0 - high_share),
              (1.0 - right_share) * high_share,
              right_share * high_share};
  for (std::size_t j = 0; j < s.weight.size(); ++j) {
    const double kappa = medium.diffusion[s.cell + corner_[j]];
    s.t += s.weight[j] * h_ / (3.0 * kappa);
    s.albedo += s.weight[j] * (1.0 - 3.0 * kappa * medium.absorption[s.cell + corner_[j]]);
  }
  return s;
}

void CameraRays::trace(
    const Medium& medium, const Raster& raster, int column, int row, const CameraRay& direction) {
  Ray ray{.surface = raster.cell(column, row, 0),
          .first = samples_.size(),
          .stretch = direction.stretch};
  double arriving = 1.0;
  for (std::size_t n = 0; n < raster.layers() && (n == 0 || arriving > kFaintest); ++n) {
    const double depth = (static_cast<double>(n) + 0.5) * h_;
    Sample s = sample(medium,
                      raster,
                      column + direction.column * depth / raster.column_spacing(),
                      row + direction.row * depth / raster.row_spacing(),
                      n);
    s.t *= direction.stretch;
    const Centroid centroid(s.t);
    const double scale = n == 0 ? 2.0 : 1.0;
    s.deposited = arriving * centroid.lost;
    s.remaining = arriving * centroid.left;
    s.shift = scale * centroid.shift();
    s.shift_slope = scale * centroid.shift_slope();
    arriving = s.remaining;
    samples_.push_back(s);
  }
  ray.count = samples_.size() - ray.first;
  deepest_ = std::max(deepest_, ray.count);
  add_shares(ray);
  rays_.push_back(ray);
}

double CameraRays::tail_slope(std::size_t n, double t) const {
  return (n == 0 ? 2.0 : 1.0) * (0.5 + 1.0 / t);
}

void CameraRays::add_shares(Ray& ray) {
  const auto path = std::span(samples_).subspan(ray.first, ray.count);
  const auto before = [&](std::size_t n) -> double& {
    return n == 0 ? ray.surface_share : path[n - 1].share;
  };
  for (std::size_t n = 0; n < path.size(); ++n) {
    const double emitted = path[n].albedo * path[n].deposited;
    path[n].share += emitted * (1.0 - path[n].shift);
    before(n) += emitted * path[n].shift;
  }
  const std::size_t last = path.size() - 1;
  const double beyond = path[last].albedo * path[last].remaining;
  const double slope = tail_slope(last, path[last].t);
  path[last].share += beyond * (1.0 + slope);
  before(last) -= beyond * slope;
}

double CameraRays::at(const Sample& s, const double* field) const {
  const double* f = field + s.cell;
  return s.weight[0] * f[corner_[0]] + s.weight[1] * f[corner_[1]] + s.weight[2] * f[corner_[2]] +
         s.weight[3] * f[corner_[3]];
}

void CameraRays::gather(const double* phi,
                        std::span<const double> source,
                        std::span<double> out) const {
  ENSURE(out.size() == rays_.size());
  for (std::size_t x = 0; x < rays_.size(); ++x) {
    const Ray& ray = rays_[x];
    const double s = source.empty() ? 0.0 : source[x];
    double sum = ray.surface_share * between(s, phi[ray.surface], ray.fluence_share);
    for (const Sample& sample : samples(ray)) sum += sample.share * at(sample, phi);
    out[x] = sum;
  }
}

void CameraRays::scatter(std::span<const double> g, double* b) const {
  ENSURE(g.size() == rays_.size());
  for (std::size_t x = 0; x < rays_.size(); ++x) {
    if (g[x] == 0.0) continue;
    const Ray& ray = rays_[x];
    b[ray.surface] += g[x] * ray.surface_share * ray.fluence_share;
    for (const Sample& s : samples(ray)) {
      for (std::size_t j = 0; j < corner_.size(); ++j)
        b[s.cell + corner_[j]] += g[x] * s.share * s.weight[j];
    }
  }
}

void CameraRays::values(const Ray& ray,
                        const double* phi,
                        double source,
                        std::span<double> v) const {
  v[0] = between(source, phi[ray.surface], ray.fluence_share);
  const auto path = samples(ray);
  for (std::size_t n = 0; n < path.size(); ++n) v[n + 1] = at(path[n], phi);
}

// E_n and all D after it fall with t_n; so does what is beyond the end.
void CameraRays::slopes(std::span<const Sample> path,
                        std::span<const double> v,
                        std::span<Slopes> out) const {
  const std::size_t last = path.size() - 1;
  const Sample& end = path[last];
  const double step = v[last + 1] - v[last];
  const double tail = end.remaining * (v[last + 1] + tail_slope(last, end.t) * step);
  double beyond = end.albedo * tail;
  for (std::size_t n = path.size(); n-- > 0;) {
    const Sample& s = path[n];
    const double seen = between(v[n + 1], v[n], s.shift);
    out[n].albedo = s.deposited * seen;
    out[n].t =
        s.albedo * (s.remaining * seen + s.deposited * (v[n] - v[n + 1]) * s.shift_slope) - beyond;
    beyond += s.albedo * s.deposited * seen;
  }
  out[last].albedo += tail;
  out[last].t -= end.albedo * end.remaining * step * (last == 0 ? 2.0 : 1.0) / (end.t * end.t);
}

void CameraRays::add_gradient(const FieldBatch& phi,
                              std::span<const std::vector<double>> source,
                              std::span<const std::vector<double>> g,
                              MediumGradient& gradient) const {
  std::vector<double> v(deepest_ + 1);
  std::vector<double> sums(deepest_ + 1);
  std::vector<Slopes> by(deepest_);
  for (std::size_t x = 0; x < rays_.size(); ++x) {
    const Ray& ray = rays_[x];
    const auto path = samples(ray);
    std::ranges::fill(sums, 0.0);
    double over_source = 0.0;  // sum g (phi - S)
    if (std::ranges::all_of(g, [x](const auto& picture) { return picture[x] == 0.0; })) continue;
    for (std::size_t m = 0; m < g.size(); ++m) {
      if (g[m][x] == 0.0) continue;
      const double* field = phi.field(static_cast<int>(m));
      const double s = source[m].empty() ? 0.0 : source[m][x];
      values(ray, field, s, v);
      for (std::size_t n = 0; n <= path.size(); ++n) sums[n] += g[m][x] * v[n];
      over_source += g[m][x] * (field[ray.surface] - s);
    }
    slopes(path, sums, by);
    gradient.diffusion[ray.surface] += ray.surface_share * ray.fluence_slope * over_source;
    for (std::size_t n = 0; n < path.size(); ++n) {
      for (std::size_t j = 0; j < corner_.size(); ++j) {
        const std::size_t cell = path[n].cell + corner_[j];
        const double w = path[n].weight[j];
        const double kappa = diffusion_[cell];
        gradient.diffusion[cell] -= w * (by[n].t * ray.stretch * h_ / (3.0 * kappa * kappa) +
                                         by[n].albedo * 3.0 * absorption_[cell]);
        gradient.absorption[cell] -= w * by[n].albedo * 3.0 * kappa;
      }
    }
  }
}

void CameraRays::add_tangent(const double* phi,
                             std::span<const double> source,
                             const MediumChange& change,
                             std::span<double> out) const {
  std::vector<double> v(deepest_ + 1);
  std::vector<Slopes> by(deepest_);
  for (std::size_t x = 0; x < rays_.size(); ++x) {
    const Ray& ray = rays_[x];
    const auto path = samples(ray);
    const double s = source.empty() ? 0.0 : source[x];
    values(ray, phi, s, v);
    slopes(path, v, by);
    double sum = ray.surface_share * ray.fluence_slope * (phi[ray.surface] - s) *
                 change.diffusion[ray.surface];
    for (std::size_t n = 0; n < path.size(); ++n) {
      for (std::size_t j = 0; j < corner_.size(); ++j) {
        const std::size_t cell = path[n].cell + corner_[j];
        const double kappa = diffusion_[cell];
        const double d_t = -ray.stretch * h_ / (3.0 * kappa * kappa) * change.diffusion[cell];
        const double d_albedo =
            -3.0 * (absorption_[cell] * change.diffusion[cell] + kappa * change.absorption[cell]);
        sum += path[n].weight[j] * (by[n].t * d_t + by[n].albedo * d_albedo);
      }
    }
    out[x] += sum;
  }
}

}  // namespace opaline::reconstruct::diffusion
