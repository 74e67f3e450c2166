#include <algorithm>
#include <cmath>

#include "reconstruct/host/host_passes.h"

// What HostPasses does to the finest level once an iteration.
namespace opaline::reconstruct::host {
namespace {

constexpr double kTrusted =
    1e-3;  // share of z . K z below which the recurrence of p . K p is noise

}  // namespace

template <class T, class S>
void HostPasses<T, S>::apply_dot(bool restart) {
  restart_ = restart;
  for (int m = 0; m < width_; ++m) {
    const double before = rho_before_[m] * static_cast<double>(factor_[m]);
    double beta = !restart && before > 0.0 ? rho_[m] / before : 0.0;
    double gamma = energy_[m] - beta * beta * gamma_[m];
    if (gamma < kTrusted * energy_[m]) {
      beta = 0.0;
      gamma = energy_[m];
    }
    beta_[m] = static_cast<T>(beta);
    gamma_[m] = gamma;
  }
}

template <class T, class S>
std::span<const double> HostPasses<T, S>::update_norm() {
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  const Direction mode = restart_      ? Direction::kRestart
                         : !step_      ? Direction::kKeep
                         : correction_ ? Direction::kAdd
                                       : Direction::kStore;
  for (int m = 0; m < width_; ++m)
    alpha_[m] = gamma_[m] > 0.0 ? static_cast<T>(rho_[m] / gamma_[m]) : T{0};
  rescale();
  if (std::min(parts, planes) > 1) for_slabs(parts, planes, [&](Slab slab) { combine_halo(slab); });
  for_slabs(parts, planes, [&](Slab slab) { update_slab(slab, mode); });
  correction_ = correction_ || step_;
  step_ = true;
  for (int m = 0; m < width_; ++m) {
    step_length_[m] = static_cast<T>(static_cast<double>(alpha_[m]) / growth_[m]);
    growth_[m] *= static_cast<double>(factor_[m]);
  }
  total(work_.norm_sums, norms_);
  for (int m = 0; m < group_.count; ++m) norms_[m] *= group_.b_norms[m] / (growth_[m] * growth_[m]);
  return norms_;
}

template <class T, class S>
void HostPasses<T, S>::rescale() {
  constexpr double kMostGrowth = 0x1p60;
  for (int m = 0; m < group_.count; ++m) {
    const double stored = std::sqrt(norms_[m]) * scale_[m] * growth_[m];
    const bool usable = std::isfinite(stored) && stored > 1.0 / kMostGrowth;
    const double wanted = usable ? std::exp2(-std::round(std::log2(stored))) : 1.0;
    factor_[m] = static_cast<T>(growth_[m] * wanted <= kMostGrowth ? wanted : 1.0);
  }
}

template <class T, class S>
int HostPasses<T, S>::black_cells(int j, int k) const {
  return (grid_.levels[0].nx + (j + k) % 2) / 2;
}

template <class T, class S>
void HostPasses<T, S>::combine_halo(Slab slab) {
  const HostLevel<T>& level = grid_.levels[0];
  HostField<T>& halo = work_.halo[slab.thread];
  const auto combine = [&](int k, int slot) {
    if (k < 0 || k >= level.no) return;
    for (int j = 0; j < level.ni; ++j) {
      const S* z = work_.z[0].row(j, k);
      const int cells = black_cells(j, k);
      T* out = halo.row(j, slot);
      if (restart_)
        kernels_.direction(
            Direction::kRestart, out, z, nullptr, alpha_.data(), beta_.data(), cells);
      else
        kernels_.combine(out, z, work_.p.row(j, k), beta_.data(), cells);
    }
  };
  for (const int beyond : {0, 1}) {
    combine(slab.begin - 2 + beyond, beyond);
    combine(slab.end + beyond, 2 + beyond);
  }
}

/// Block by block of lines: p in plane k, the red cells of plane k - 1, r in plane k - 2. In each direction r lags the
/// red cells by a line, and they lag p.
template <class T, class S>
void HostPasses<T, S>::update_slab(Slab slab, Direction mode) {
  const HostLevel<T>& level = grid_.levels[0];
  HostField<T>& relaxed = work_.relaxed[slab.thread];
  const auto p_plane = [&](int k) -> const T* {
    if (k < 0 || k >= level.no) return nullptr;
    if (slab.has(k)) return work_.p.plane(k);
    return work_.halo[slab.thread].plane(k < slab.begin ? k - slab.begin + 2 : k - slab.end + 2);
  };
  const auto t_plane = [&](int k) -> const T* {
    return k < 0 || k >= level.no ? nullptr : relaxed.plane(k % kRelaxedPlanes);
  };
  const int step = work_.rows_at_work();
  for (int j = 0; j < level.ni; j += step) {
    const bool last = j + step >= level.ni;
    const Rows moved{j, last ? level.ni : j + step};
    const Rows red{std::max(0, j - kRelaxedAnew), last ? level.ni : moved.end - 1};
    const Rows updated{std::max(0, j - 2), last ? level.ni : moved.end - 2};
    for (int k = slab.begin; k < slab.end + 2; ++k) {
      if (k < slab.end) move_rows(moved, k, mode);
      const Planes p{
          p_plane(k - 2), p_plane(k - 1), p_plane(k), work_.p.row_size(), level.ni, 0, 0};
      if (p.at != nullptr) relax_rows(red, k - 1, p, slab.thread);
      const Planes t{t_plane(k - 3),
                     t_plane(k - 2),
                     t_plane(k - 1),
                     relaxed.row_size(),
                     red.count(),
                     0,
                     red.begin};
      if (k > slab.begin + 1) update_rows(updated, k - 2, t);
    }
  }
}

template <class T, class S>
void HostPasses<T, S>::move_rows(Rows rows, int k, Direction mode) {
  for (int j = rows.begin; j < rows.end; ++j)
    kernels_.direction(mode,
                       work_.p.row(j, k),
                       work_.z[0].row(j, k),
                       work_.d.row(j, k),
                       step_length_.data(),
                       beta_.data(),
                       black_cells(j, k));
}

template <class T, class S>
void HostPasses<T, S>::relax_rows(Rows rows, int k, const Planes& p, int thread) {
  const HostLevel<T>& level = grid_.levels[0];
  for (int j = rows.begin; j < rows.end; ++j) {
    const int first = first_of(kRed, j, k);
    kernels_.relax(work_.relaxed[thread].row(j - rows.begin, k % kRelaxedPlanes),
                   level.sink + level.row(j, k),
                   level.inverse + level.row(j, k),
                   packed_stencil(p, width_, j, k, first),
                   first,
                   level.nx);
  }
}

template <class T, class S>
void HostPasses<T, S>::update_rows(Rows rows, int k, const Planes& t) {
  const HostLevel<T>& level = grid_.levels[0];
  if (rows.begin == 0) clear_sums(k, 0);
  for (int j = rows.begin; j < rows.end; ++j) {
    const int first = first_of(kBlack, j, k);
    kernels_.update(work_.r[0].row(j, k),
                    work_.p.row(j, k),
                    level.sink + level.row(j, k),
                    packed_stencil(t, 2 * width_, j, k, first),
                    alpha_.data(),
                    factor_.data(),
                    &work_.norm_sums[sums_at(k, 0)],
                    first,
                    level.nx);
  }
}

template class HostPasses<float, float>;
template class HostPasses<float, Half>;
template class HostPasses<double, double>;

}  // namespace opaline::reconstruct::host
