#include "reconstruct/diffusion/source.h"

#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/centroid.h"
#include "reconstruct/diffusion/face_step.h"

namespace opaline::reconstruct::diffusion {
std::string_view to_string(SourceModel model) {
  return model == SourceModel::kCollimated ? "collimated" : "surface";
}

std::string_view to_string(Deposit deposit) {
  return deposit == Deposit::kCentroid ? "centroid" : "cell";
}

FaceSource::FaceSource(const Medium& medium,
                       const Boundary& boundary,
                       Face face,
                       SourceOptions options)
    : boundary_(boundary), options_(options) {
  const Block& block = medium.block;
  const int axis = axis_of(face);
  const std::ptrdiff_t step = inwards(block, face);
  area_ = block.face_cell_area(face);
  h_ = block.spacing()[axis];
  depth_ = static_cast<std::size_t>(block.cells()[axis]);
  rays_.reserve(block.cell_count());
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int col = 0; col < block.face_width(face); ++col) {
      std::size_t cell = block.cell_behind(face, col, row);
      double arriving = 1.0;
      for (std::size_t n = 0; n < depth_; ++n, cell += step) {
        rays_.push_back(ray_cell(medium, cell, arriving));
        arriving = rays_.back().remaining;
      }
    }
  }
}

FaceSource::RayCell FaceSource::ray_cell(const Medium& medium,
                                         std::size_t cell,
                                         double arriving) const {
  const double kappa = medium.diffusion[cell];
  const double absorption = medium.absorption[cell];
  const Centroid along(h_ / (3.0 * kappa));
  const bool centroid = options_.deposit == Deposit::kCentroid;
  return {.cell = cell,
          .kappa = kappa,
          .absorption = absorption,
          .albedo = 1.0 - 3.0 * kappa * absorption,
          .deposited = arriving * along.lost,
          .remaining = arriving * along.left,
          .beta = centroid ? along.shift() : 0.0,
          .beta_slope = centroid ? along.shift_slope() : 0.0};
}

double FaceSource::first_escape(const RayCell& first) const {
  return boundary_.conductance(h_, first.kappa) * first.beta * h_ / first.kappa;
}

double FaceSource::first_escape_slope(const RayCell& r) const {
  const double gb = boundary_.conductance(h_, r.kappa);
  const double dt = h_ / (3.0 * r.kappa * r.kappa);  // -dt/dkappa
  return (h_ / r.kappa) * (gb * gb * h_ * r.beta / (2.0 * r.kappa * r.kappa) -
                           gb * r.beta_slope * dt - gb * r.beta / r.kappa);
}

void FaceSource::deposit(std::span<const double> q, std::span<double> b) const {
  ENSURE(q.size() * depth_ == rays_.size() && b.size() == rays_.size());
  for (std::size_t f = 0; f < q.size(); ++f) {
    const auto ray = column(f);
    const double power = area_ * q[f];
    if (power == 0.0) continue;
    if (options_.model == SourceModel::kSurface) {
      b[ray[0].cell] += boundary_.conductance(h_, ray[0].kappa) * boundary_.source_scale * power;
      continue;
    }
    b[ray[0].cell] += power * ray[0].albedo * ray[0].deposited * (1.0 - first_escape(ray[0]));
    for (std::size_t n = 1; n < depth_; ++n) {
      const double share = power * ray[n].albedo * ray[n].deposited;
      b[ray[n].cell] += share * (1.0 - ray[n].beta);
      b[ray[n - 1].cell] += share * ray[n].beta;
    }
  }
}

SurfaceTerms FaceSource::surface_terms(std::span<const double> q) const {
  ENSURE(q.size() * depth_ == rays_.size());
  SurfaceTerms terms{std::vector<double>(q.size(), 0.0), std::vector<double>(q.size(), 0.0)};
  for (std::size_t f = 0; f < q.size(); ++f) {
    const RayCell& first = column(f)[0];
    if (options_.model == SourceModel::kSurface) {
      terms.source[f] = boundary_.source_scale * q[f];
    } else {
      terms.escape[f] = q[f] * first.albedo * first.deposited * first_escape(first);
    }
  }
  return terms;
}

SourcePower FaceSource::power(std::span<const double> q) const {
  SourcePower sum;
  for (std::size_t f = 0; f < q.size(); ++f) {
    const double power = area_ * q[f];
    sum.entered += power;
    if (options_.model == SourceModel::kSurface) continue;
    for (const RayCell& r : column(f)) sum.absorbed_first += power * (1.0 - r.albedo) * r.deposited;
    sum.ballistic += power * column(f).back().remaining;
  }
  return sum;
}

// lambda_n = dJ/dQ_n: how much the objective wants of cell n's share.
double FaceSource::adjoint_weight(std::span<const RayCell> ray,
                                  std::size_t n,
                                  std::span<const double> psi,
                                  double rim) const {
  if (n == 0) {
    const double e = first_escape(ray[0]);
    return (1.0 - e) * psi[ray[0].cell] + e * rim;
  }
  return (1.0 - ray[n].beta) * psi[ray[n].cell] + ray[n].beta * psi[ray[n - 1].cell];
}

void FaceSource::add_gradient(std::span<const double> q,
                              std::span<const double> psi,
                              std::span<const double> flux_residual,
                              MediumGradient& gradient) const {
  if (options_.model == SourceModel::kSurface) return;
  for (std::size_t f = 0; f < q.size(); ++f) {
    const double power = area_ * q[f];
    if (power == 0.0) continue;
    const auto ray = column(f);
    const double rim = flux_residual.empty() ? 0.0 : flux_residual[f] / area_;
    double beyond = 0.0;  // sum over m > n of lambda_m Q_m
    for (std::size_t n = depth_; n-- > 0;) {
      const RayCell& r = ray[n];
      const double lambda = adjoint_weight(ray, n, psi, rim);
      const double share = power * r.albedo * r.deposited;  // Q_n
      const double dt = h_ / (3.0 * r.kappa * r.kappa);     // -dt/dkappa
      double d_kappa = -3.0 * r.absorption * power * r.deposited * lambda +
                       dt * (beyond - power * r.albedo * r.remaining * lambda);
      if (n > 0) {
        d_kappa += share * (psi[r.cell] - psi[ray[n - 1].cell]) * r.beta_slope * dt;
      } else {
        d_kappa += share * (rim - psi[r.cell]) * first_escape_slope(r);
      }
      gradient.diffusion[r.cell] += d_kappa;
      gradient.absorption[r.cell] += -3.0 * r.kappa * power * r.deposited * lambda;
      beyond += lambda * share;
    }
  }
}

void FaceSource::add_tangent(std::span<const double> q,
                             const MediumChange& change,
                             std::span<double> b,
                             std::span<double> escape) const {
  ENSURE(q.size() * depth_ == rays_.size() && escape.size() == q.size());
  for (std::size_t f = 0; f < q.size(); ++f) {
    const auto ray = column(f);
    const double power = area_ * q[f];
    if (power == 0.0) continue;
    if (options_.model == SourceModel::kSurface) {
      const double kappa = ray[0].kappa;
      const double gb = boundary_.conductance(h_, kappa);
      b[ray[0].cell] += gb * gb * h_ / (2.0 * kappa * kappa) * change.diffusion[ray[0].cell] *
                        boundary_.source_scale * power;
      continue;
    }
    double d_arriving = 0.0;  // dE_(n-1)
    for (std::size_t n = 0; n < depth_; ++n) {
      const RayCell& r = ray[n];
      const double d_kappa = change.diffusion[r.cell];
      const double d_t = -h_ / (3.0 * r.kappa * r.kappa) * d_kappa;
      const double through = std::exp(-h_ / (3.0 * r.kappa));
      const double d_remaining = through * d_arriving - r.remaining * d_t;
      const double d_albedo = -3.0 * (r.absorption * d_kappa + r.kappa * change.absorption[r.cell]);
      const double share = power * r.albedo * r.deposited;
      const double d_share =
          power * (d_albedo * r.deposited + r.albedo * (d_arriving - d_remaining));
      const double out = n == 0 ? first_escape(r) : r.beta;
      const double d_out = n == 0 ? first_escape_slope(r) * d_kappa : r.beta_slope * d_t;
      b[r.cell] += d_share * (1.0 - out) - share * d_out;
      if (n == 0) {
        escape[f] += (d_share * out + share * d_out) / area_;
      } else {
        b[ray[n - 1].cell] += d_share * out + share * d_out;
      }
      d_arriving = d_remaining;
    }
  }
}

}  // namespace opaline::reconstruct::diffusion
