#include <algorithm>
#include <cmath>

#include "reconstruct/host/host_passes.h"

// What HostPasses does to the finest level once an iteration.
namespace opaline::reconstruct::host {
namespace {

constexpr double kTrusted =
    1e-3;  // share of z . K z below which the recurrence of p . K p is noise
constexpr double kAside =
    1e-3;  // fall of ||r|| from which on d would round away too much of a step

}  // namespace

template <class T, class S>
void HostPasses<T, S>::apply_dot(bool restart) {
  restart_ = restart;
  for (int m = 0; m < width_; ++m) {
    const double before = rho_before_[m] * static_cast<double>(factor_[m]);
    const bool follows = !restart && before > 0.0 && alpha_[m] != 0.0;
    double beta = follows ? rho_[m] / before : 0.0;
    double gamma = energy_[m] - beta * beta * gamma_[m];
    if (gamma < kTrusted * energy_[m]) {
      beta = 0.0;
      gamma = energy_[m];
    }
    gamma_[m] = gamma;
    const double alpha = gamma > 0.0 ? rho_[m] / gamma : 0.0;
    along_before_[m] = beta > 0.0 ? static_cast<T>(alpha * beta / alpha_[m]) : T{0};
    alpha_[m] = alpha;
    along_z_[m] = static_cast<T>(alpha);
  }
}

template <class T, class S>
std::span<const double> HostPasses<T, S>::update_norm() {
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  rescale();
  if (std::min(parts, planes) > 1) for_slabs(parts, planes, [&](Slab slab) { step_halo(slab); });
  for_slabs(parts, planes, [&](Slab slab) { update_slab(slab); });
  moved_ = true;
  for (int m = 0; m < width_; ++m) growth_[m] *= static_cast<double>(factor_[m]);
  total(work_.norm_sums, norms_);
  for (int m = 0; m < group_.count; ++m) norms_[m] *= group_.b_norms[m] / (growth_[m] * growth_[m]);
  set_aside();
  return norms_;
}

template <class T, class S>
void HostPasses<T, S>::set_aside() {
  if (aside_ || diffusion::worst_ratio(norms_, group_.b_norms) > kAside * started_) return;
  std::swap(work_.d, work_.aside);
  aside_ = true;
  moved_ = false;
}

template <class T, class S>
void HostPasses<T, S>::rescale() {
  constexpr double kMostGrowth = 0x1p60;
  for (int m = 0; m < width_; ++m) {
    grown_[m] = static_cast<T>(growth_[m]);
    shrunk_[m] = static_cast<T>(1.0 / growth_[m]);
  }
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
void HostPasses<T, S>::step_row(int j, int k, T* s, T* d) {
  kernels_.step({along_z_.data(), along_before_.data(), grown_.data(), shrunk_.data()},
                work_.z[0].row(j, k),
                restart_ ? nullptr : work_.s.row(j, k),
                moved_ ? work_.d.row(j, k) : nullptr,
                s,
                d,
                black_cells(j, k));
}

template <class T, class S>
void HostPasses<T, S>::step_halo(Slab slab) {
  const HostLevel<T>& level = grid_.levels[0];
  HostField<T>& halo = work_.halo[slab.thread];
  const auto step = [&](int k, int slot) {
    if (k < 0 || k >= level.no) return;
    for (int j = 0; j < level.ni; ++j) step_row(j, k, halo.row(j, slot), nullptr);
  };
  for (const int beyond : {0, 1}) {
    step(slab.begin - 2 + beyond, beyond);
    step(slab.end + beyond, 2 + beyond);
  }
}

/// Block by block of lines: s in plane k, the red cells of plane k - 1, r in plane k - 2. In each direction r lags the
/// red cells by a line, and they lag s.
template <class T, class S>
void HostPasses<T, S>::update_slab(Slab slab) {
  const HostLevel<T>& level = grid_.levels[0];
  HostField<T>& relaxed = work_.relaxed[slab.thread];
  const auto s_plane = [&](int k) -> const T* {
    if (k < 0 || k >= level.no) return nullptr;
    if (slab.has(k)) return work_.s.plane(k);
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
      for (int row = moved.begin; k < slab.end && row < moved.end; ++row)
        step_row(row, k, work_.s.row(row, k), work_.d.row(row, k));
      const Planes s{
          s_plane(k - 2), s_plane(k - 1), s_plane(k), work_.s.row_size(), level.ni, 0, 0};
      if (s.at != nullptr) relax_rows(red, k - 1, s, slab.thread);
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
void HostPasses<T, S>::relax_rows(Rows rows, int k, const Planes& s, int thread) {
  const HostLevel<T>& level = grid_.levels[0];
  for (int j = rows.begin; j < rows.end; ++j) {
    const int first = first_of(kRed, j, k);
    kernels_.relax(work_.relaxed[thread].row(j - rows.begin, k % kRelaxedPlanes),
                   level.sink + level.row(j, k),
                   level.inverse + level.row(j, k),
                   packed_stencil(s, width_, j, k, first),
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
                    work_.s.row(j, k),
                    level.sink + level.row(j, k),
                    packed_stencil(t, 2 * width_, j, k, first),
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
