#include "reconstruct/host/host_passes.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/host/flush_denormals.h"

namespace opaline::reconstruct::host {
namespace {

constexpr int kRed = 0;
constexpr int kBlack = 1;

/// The first cell of a colour on line (j, k).
int first_of(int colour, int j, int k) { return (j + k + colour) % 2; }

bool inside(int plane, int begin, int end, int count) {
  return plane >= std::max(begin, 0) && plane < std::min(end, count);
}

}  // namespace

HostPasses::HostPasses(ThreadTeam& team, const HostGrid& grid, Workspace& work, const Group& group)
    : team_(team),
      grid_(grid),
      work_(work),
      group_(group),
      kernels_(row_kernels(work.width)),
      width_(work.width),
      scale_(group.count),
      rho_(work.width, 0.0),
      rho_before_(work.width, 0.0),
      gamma_(work.width, 0.0),
      norms_(group.count, 0.0) {
  for (int m = 0; m < group.count; ++m)
    scale_[m] = group.b_norms[m] > 0.0 ? 1.0 / std::sqrt(group.b_norms[m]) : 0.0;
}

template <class F>
void HostPasses::for_slabs(int parts, int planes, const F& f) {
  parts = std::min(parts, planes);
  const auto work = [&](int thread) {
    if (thread >= parts) return;
    const FlushDenormals flush;
    f(Slab{thread, planes * thread / parts, planes * (thread + 1) / parts});
  };
  if (parts == 1) {
    work(0);
  } else {
    team_.run(work);
  }
}

template <class F>
void HostPasses::for_rows(int level, const F& f) const {
  for (int j = 0; j < grid_.levels[level].ni; ++j) f(j);
}

const float* HostPasses::row_or_zeros(const float* plane, const HostField& field, int j) const {
  return plane != nullptr ? plane + j * field.row_size() : work_.zeros.data() + width_;
}

Stencil HostPasses::stencil(int l, const Planes& u, int j, int k) const {
  const HostLevel& level = grid_.levels[l];
  const HostField& shape = work_.z[l];
  const std::size_t at = level.row(j, k);
  const auto stride = static_cast<std::size_t>(level.nx);
  const std::size_t plane = stride * level.ni;
  return {u.at + j * shape.row_size(),
          row_or_zeros(j > 0 ? u.at : nullptr, shape, j - 1),
          row_or_zeros(j + 1 < level.ni ? u.at : nullptr, shape, j + 1),
          row_or_zeros(u.before, shape, j),
          row_or_zeros(u.after, shape, j),
          level.gx + at,
          level.gi + at - stride,
          level.gi + at,
          level.go + at - plane,
          level.go + at};
}

void HostPasses::scale_plane(int l, float* z, int k) {
  const HostLevel& level = grid_.levels[l];
  const HostField& r = work_.r[l];
  for_rows(l, [&](int j) {
    kernels_.scale(z + j * r.row_size(),
                   r.row(j, k),
                   level.inverse + level.row(j, k),
                   first_of(kRed, j, k),
                   level.nx);
  });
}

void HostPasses::sweep_plane(int l, float* z, const Planes& u, int k, int colour) {
  const HostLevel& level = grid_.levels[l];
  const HostField& r = work_.r[l];
  for_rows(l, [&](int j) {
    kernels_.sweep(z + j * r.row_size(),
                   r.row(j, k),
                   level.inverse + level.row(j, k),
                   stencil(l, u, j, k),
                   first_of(colour, j, k),
                   level.nx);
  });
}

void HostPasses::smooth_restrict(int l) {
  for_slabs(work_.parts(l), grid_.levels[l + 1].no, [&](Slab coarse) { restrict_slab(l, coarse); });
}

void HostPasses::restrict_slab(int l, Slab coarse) {
  const HostLevel& level = grid_.levels[l];
  HostField& below = work_.r[l + 1];
  std::fill(below.plane(coarse.begin), below.plane(coarse.end), 0.0F);
  HostField& ring = work_.scratch[l][coarse.thread];
  const auto plane = [&](int k) {
    return inside(k, 0, level.no, level.no) ? ring.plane(k % 4) : nullptr;
  };
  const auto around = [&](int k) { return Planes{plane(k - 1), plane(k), plane(k + 1)}; };
  const int halo = level.ratio[2] == 2 ? 1 : 0;  // planes beyond the slab that reach into it
  const int begin = coarse.begin * level.ratio[2] - halo;
  const int end = std::min(level.no, coarse.end * level.ratio[2]) + halo;
  for (int k = begin - 2; k < end + 2; ++k) {
    if (inside(k, begin - 2, end + 2, level.no)) scale_plane(l, plane(k), k);
    if (inside(k - 1, begin - 1, end + 1, level.no))
      sweep_plane(l, plane(k - 1), around(k - 1), k - 1, kBlack);
    if (inside(k - 2, begin, end, level.no)) restrict_plane(l, around(k - 2), k - 2, coarse);
  }
}

void HostPasses::restrict_plane(int l, const Planes& u, int k, Slab coarse) {
  const HostLevel& level = grid_.levels[l];
  const HostLevel& next = grid_.levels[l + 1];
  HostField& below = work_.r[l + 1];
  float* discard = work_.discard[coarse.thread].data() + width_;
  const int k_own = k / level.ratio[2];
  const int k_side = k % 2 == 1 ? k_own + 1 : k_own - 1;
  const bool outer = level.ratio[2] == 2 && coarse.has(k_side);
  for_rows(l, [&](int j) {
    const int j_own = j / level.ratio[1];
    const int j_side = j % 2 == 1 ? j_own + 1 : j_own - 1;
    const bool own = coarse.has(k_own);
    const bool inner = own && level.ratio[1] == 2 && inside(j_side, 0, next.ni, next.ni);
    const std::size_t at = level.row(j, k);
    const Weights w{
        level.own + at, level.wx + at, level.wi + at, level.wo + at, level.ratio[0], next.nx};
    kernels_.restrict_row(stencil(l, u, j, k),
                          w,
                          own ? below.row(j_own, k_own) : discard,
                          inner ? below.row(j_side, k_own) : discard,
                          outer ? below.row(j_own, k_side) : discard,
                          first_of(kRed, j, k),
                          level.nx);
  });
}

void HostPasses::prolong_smooth(int l) {
  if (l == 0) rho_before_ = rho_;
  for_slabs(work_.parts(l), grid_.levels[l].no, [&](Slab slab) { prolong_slab(l, slab); });
  if (l == 0) total(rho_);
}

void HostPasses::prolong_slab(int l, Slab slab) {
  const HostLevel& level = grid_.levels[l];
  HostField& z = work_.z[l];
  HostField& halo = work_.scratch[l][slab.thread];
  const auto plane = [&](int k) -> float* {
    if (!inside(k, 0, level.no, level.no)) return nullptr;
    if (slab.has(k)) return z.plane(k);
    return halo.plane(k < slab.begin ? k - slab.begin + 2 : k - slab.end + 2);
  };
  const auto around = [&](int k) { return Planes{plane(k - 1), plane(k), plane(k + 1)}; };
  const bool last = l + 1 == levels();
  for (int k = slab.begin - 2; k < slab.end + 2; ++k) {
    if (inside(k, 0, level.no, level.no))
      last ? scale_plane(l, plane(k), k) : prolong_plane(l, plane(k), k);
    if (inside(k - 1, slab.begin - 1, slab.end + 1, level.no))
      sweep_plane(l, plane(k - 1), around(k - 1), k - 1, kBlack);
    if (!slab.has(k - 2)) continue;
    sweep_plane(l, plane(k - 2), around(k - 2), k - 2, kRed);
    if (l == 0) dot_plane(plane(k - 2), k - 2);
  }
}

void HostPasses::prolong_plane(int l, float* z, int k) {
  const HostLevel& level = grid_.levels[l];
  const HostLevel& next = grid_.levels[l + 1];
  const HostField& above = work_.z[l + 1];
  const HostField& r = work_.r[l];
  const int k_own = k / level.ratio[2];
  const int k_side = k % 2 == 1 ? k_own + 1 : k_own - 1;
  const bool outer = level.ratio[2] == 2 && inside(k_side, 0, next.no, next.no);
  for_rows(l, [&](int j) {
    const int j_own = j / level.ratio[1];
    const int j_side = j % 2 == 1 ? j_own + 1 : j_own - 1;
    const bool inner = level.ratio[1] == 2 && inside(j_side, 0, next.ni, next.ni);
    const std::size_t at = level.row(j, k);
    const Weights w{
        level.own + at, level.wx + at, level.wi + at, level.wo + at, level.ratio[0], next.nx};
    kernels_.prolong(z + j * r.row_size(),
                     r.row(j, k),
                     level.inverse + at,
                     w,
                     above.row(j_own, k_own),
                     row_or_zeros(inner ? above.plane(k_own) : nullptr, above, j_side),
                     row_or_zeros(outer ? above.plane(k_side) : nullptr, above, j_own),
                     first_of(kRed, j, k),
                     level.nx);
  });
}

void HostPasses::clear_sums(int k) {
  std::fill_n(work_.plane_sums.begin() + k * std::ptrdiff_t{width_}, width_, 0.0);
}

void HostPasses::total(std::vector<double>& sums) const {
  std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t at = 0; at < work_.plane_sums.size(); ++at)
    if (at % width_ < sums.size()) sums[at % width_] += work_.plane_sums[at];
}

void HostPasses::dot_plane(const float* z, int k) {
  const HostField& r = work_.r[0];
  clear_sums(k);
  for_rows(0, [&](int j) {
    kernels_.dot(z + j * r.row_size(),
                 r.row(j, k),
                 &work_.plane_sums[k * std::size_t(width_)],
                 grid_.levels[0].nx);
  });
}

void HostPasses::apply_dot(bool restart) {
  for (int m = 0; m < width_; ++m)
    beta_[m] = rho_before_[m] > 0.0 ? static_cast<float>(rho_[m] / rho_before_[m]) : 0.0F;
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  const Direction mode = restart       ? Direction::kRestart
                         : !step_      ? Direction::kKeep
                         : correction_ ? Direction::kAdd
                                       : Direction::kStore;
  if (!restart && std::min(parts, planes) > 1)
    for_slabs(parts, planes, [&](Slab slab) { combine_halo(slab); });
  for_slabs(parts, planes, [&](Slab slab) { apply_slab(slab, mode); });
  correction_ = correction_ || step_;
  step_ = false;
  total(gamma_);
}

void HostPasses::combine_halo(Slab slab) {
  HostField& halo = work_.scratch[0][slab.thread];
  const auto combine = [&](int k, int slot) {
    if (!inside(k, 0, grid_.levels[0].no, grid_.levels[0].no)) return;
    for_rows(0, [&](int j) {
      kernels_.combine(halo.row(j, slot),
                       work_.z[0].row(j, k),
                       work_.p.row(j, k),
                       beta_.data(),
                       grid_.levels[0].nx);
    });
  };
  combine(slab.begin - 1, 0);
  combine(slab.end, 1);
}

void HostPasses::apply_slab(Slab slab, Direction mode) {
  const HostLevel& level = grid_.levels[0];
  const HostField& halo = work_.scratch[0][slab.thread];
  const HostField& beyond = mode == Direction::kRestart ? work_.z[0] : halo;
  const auto plane = [&](int k) -> const float* {
    if (!inside(k, 0, level.no, level.no)) return nullptr;
    if (slab.has(k)) return work_.p.plane(k);
    return beyond.plane(mode == Direction::kRestart ? k : k < slab.begin ? 0 : 1);
  };
  for (int k = slab.begin; k < slab.end + 1; ++k) {
    if (k < slab.end)
      for_rows(0, [&](int j) {
        kernels_.direction(mode,
                           work_.p.row(j, k),
                           work_.z[0].row(j, k),
                           work_.d.row(j, k),
                           alpha_.data(),
                           beta_.data(),
                           level.nx);
      });
    if (k == slab.begin) continue;
    const Planes u{plane(k - 2), plane(k - 1), plane(k)};
    clear_sums(k - 1);
    for_rows(0, [&](int j) {
      kernels_.apply(work_.q.row(j, k - 1),
                     level.sink + level.row(j, k - 1),
                     stencil(0, u, j, k - 1),
                     &work_.plane_sums[(k - 1) * std::size_t(width_)],
                     level.nx);
    });
  }
}

std::span<const double> HostPasses::update_norm() {
  for (int m = 0; m < width_; ++m)
    alpha_[m] = gamma_[m] > 0.0 ? static_cast<float>(rho_[m] / gamma_[m]) : 0.0F;
  step_ = true;
  for_slabs(work_.parts(0), grid_.levels[0].no, [&](Slab slab) {
    for (int k = slab.begin; k < slab.end; ++k) {
      clear_sums(k);
      for_rows(0, [&](int j) {
        kernels_.update(work_.r[0].row(j, k),
                        work_.q.row(j, k),
                        alpha_.data(),
                        &work_.plane_sums[k * std::size_t(width_)],
                        grid_.levels[0].nx);
      });
    }
  });
  total(norms_);
  for (int m = 0; m < group_.count; ++m) norms_[m] *= group_.b_norms[m];
  return norms_;
}

std::span<const double> HostPasses::true_residual() {
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  if (step_ || correction_) for_slabs(parts, planes, [&](Slab slab) { add_correction(slab); });
  step_ = correction_ = false;
  for_slabs(parts, planes, [&](Slab slab) { residual_slab(slab); });
  total(norms_);
  return norms_;
}

void HostPasses::add_correction(Slab slab) {
  const int nx = grid_.levels[0].nx;
  for (int k = slab.begin; k < slab.end; ++k)
    for_rows(0, [&](int j) {
      const float* d = work_.d.row(j, k);
      const float* p = work_.p.row(j, k);
      for (int m = 0; m < group_.count; ++m) {
        double* x = group_.x.field(group_.first + m) + grid_.caller_row(j, k);
        const double back = scale_[m] > 0.0 ? 1.0 / (scale_[m] * grid_.unit) : 0.0;
        const double step = step_ ? static_cast<double>(alpha_[m]) : 0.0;
        for (int i = 0; i < nx; ++i) {
          const int at = i * width_ + m;
          const double sum = correction_ ? static_cast<double>(d[at]) : 0.0;
          x[i] += back * (sum + step * static_cast<double>(p[at]));
        }
      }
    });
}

void HostPasses::residual_slab(Slab slab) {
  std::vector<double> line(grid_.levels[0].nx);
  for (int k = slab.begin; k < slab.end; ++k) {
    clear_sums(k);
    for_rows(0, [&](int j) {
      residual_row(j, k, line.data(), &work_.plane_sums[k * std::size_t(width_)]);
    });
  }
}

void HostPasses::residual_row(int j, int k, double* line, double* sums) {
  const diffusion::Level& fine = grid_.finest;
  const int nx = fine.cells[0];
  const std::size_t at = grid_.levels[0].row(j, k);
  const std::size_t plane = fine.stride(2);
  const auto g = [&](int axis, bool there, std::size_t before) {
    return there ? fine.conductance[axis].data() + at - before : nullptr;
  };
  float* r = work_.r[0].row(j, k);
  for (int m = 0; m < group_.count; ++m) {
    const double* x = group_.x.field(group_.first + m) + grid_.caller_row(j, k);
    const auto near = [&](bool there, std::ptrdiff_t offset) {
      return there ? x + offset : nullptr;
    };
    const auto inner = static_cast<std::ptrdiff_t>(grid_.inner_stride);
    const auto outer = static_cast<std::ptrdiff_t>(grid_.outer_stride);
    line_residual({group_.b.field(group_.first + m) + grid_.caller_row(j, k),
                   x,
                   near(j > 0, -inner),
                   near(j + 1 < fine.cells[1], inner),
                   near(k > 0, -outer),
                   near(k + 1 < fine.cells[2], outer),
                   fine.diagonal.data() + at,
                   g(0, true, 0),
                   g(1, j > 0, nx),
                   g(1, true, 0),
                   g(2, k > 0, plane),
                   g(2, true, 0)},
                  line,
                  nx);
    for (int i = 0; i < nx; ++i) {
      sums[m] += line[i] * line[i];
      r[i * width_ + m] = static_cast<float>(line[i] * scale_[m]);
    }
  }
}

}  // namespace opaline::reconstruct::host
