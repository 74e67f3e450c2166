#include "reconstruct/host/host_passes.h"

#include <algorithm>
#include <cmath>

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

void HostPasses::scale_row(int l, float* z, int j, int k) {
  const HostLevel& level = grid_.levels[l];
  const HostField& r = work_.r[l];
  kernels_.scale(z + j * r.row_size(),
                 r.row(j, k),
                 level.inverse + level.row(j, k),
                 first_of(kRed, j, k),
                 level.nx);
}

void HostPasses::sweep_row(int l, float* z, const Planes& u, int j, int k, int colour) {
  const HostLevel& level = grid_.levels[l];
  const HostField& r = work_.r[l];
  kernels_.sweep(z + j * r.row_size(),
                 r.row(j, k),
                 level.inverse + level.row(j, k),
                 stencil(l, u, j, k),
                 first_of(colour, j, k),
                 level.nx);
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
    const bool scales = inside(k, begin - 2, end + 2, level.no);
    const bool sweeps = inside(k - 1, begin - 1, end + 1, level.no);
    const bool restricts = inside(k - 2, begin, end, level.no);
    for (int j = 0; j < level.ni; ++j) {
      if (scales) scale_row(l, plane(k), j, k);
      if (sweeps) sweep_row(l, plane(k - 1), around(k - 1), j, k - 1, kBlack);
      if (restricts) restrict_row(l, around(k - 2), j, k - 2, coarse);
    }
  }
}

void HostPasses::restrict_row(int l, const Planes& u, int j, int k, Slab coarse) {
  const HostLevel& level = grid_.levels[l];
  HostField& below = work_.r[l + 1];
  float* discard = work_.discard[coarse.thread].data() + width_;
  const Parents to = parents(l, j, k);
  const bool own = coarse.has(to.k);
  float* inner = own && to.has_inner ? below.row(to.j_side, to.k) : discard;
  float* outer = to.has_outer && coarse.has(to.k_side) ? below.row(to.j, to.k_side) : discard;
  kernels_.restrict_row(stencil(l, u, j, k),
                        weights(l, j, k),
                        own ? below.row(to.j, to.k) : discard,
                        inner,
                        outer,
                        first_of(kRed, j, k),
                        level.nx);
}

HostPasses::Parents HostPasses::parents(int l, int j, int k) const {
  const std::array<int, 3>& ratio = grid_.levels[l].ratio;
  const HostLevel& next = grid_.levels[l + 1];
  const int j_own = j / ratio[1];
  const int k_own = k / ratio[2];
  const int j_side = j % 2 == 1 ? j_own + 1 : j_own - 1;
  const int k_side = k % 2 == 1 ? k_own + 1 : k_own - 1;
  return {j_own,
          j_side,
          k_own,
          k_side,
          ratio[1] == 2 && inside(j_side, 0, next.ni, next.ni),
          ratio[2] == 2 && inside(k_side, 0, next.no, next.no)};
}

Weights HostPasses::weights(int l, int j, int k) const {
  const HostLevel& level = grid_.levels[l];
  const std::size_t at = level.row(j, k);
  return {level.own + at,
          level.wx + at,
          level.wi + at,
          level.wo + at,
          level.ratio[0],
          grid_.levels[l + 1].nx};
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
    const bool starts = inside(k, 0, level.no, level.no);
    const bool sweeps = inside(k - 1, slab.begin - 1, slab.end + 1, level.no);
    const bool ends = slab.has(k - 2);
    if (ends && l == 0) clear_sums(k - 2);
    for (int j = 0; j < level.ni; ++j) {
      if (starts) last ? scale_row(l, plane(k), j, k) : prolong_row(l, plane(k), j, k);
      if (sweeps) sweep_row(l, plane(k - 1), around(k - 1), j, k - 1, kBlack);
      if (!ends) continue;
      sweep_row(l, plane(k - 2), around(k - 2), j, k - 2, kRed);
      if (l == 0) kernels_.dot(z.row(j, k - 2), work_.r[0].row(j, k - 2), sums(k - 2), level.nx);
    }
  }
}

void HostPasses::prolong_row(int l, float* z, int j, int k) {
  const HostLevel& level = grid_.levels[l];
  const HostField& above = work_.z[l + 1];
  const HostField& r = work_.r[l];
  const Parents from = parents(l, j, k);
  kernels_.prolong(z + j * r.row_size(),
                   r.row(j, k),
                   level.inverse + level.row(j, k),
                   weights(l, j, k),
                   above.row(from.j, from.k),
                   row_or_zeros(from.has_inner ? above.plane(from.k) : nullptr, above, from.j_side),
                   row_or_zeros(from.has_outer ? above.plane(from.k_side) : nullptr, above, from.j),
                   first_of(kRed, j, k),
                   level.nx);
}

double* HostPasses::sums(int k) { return &work_.plane_sums[k * static_cast<std::size_t>(width_)]; }

void HostPasses::clear_sums(int k) { std::fill_n(sums(k), width_, 0.0); }

void HostPasses::total(std::vector<double>& sums) const {
  std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t at = 0; at < work_.plane_sums.size(); ++at)
    if (at % width_ < sums.size()) sums[at % width_] += work_.plane_sums[at];
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
  const int halo_rows = grid_.levels[0].ni;
  const auto combine = [&](int k, int slot) {
    if (!inside(k, 0, grid_.levels[0].no, grid_.levels[0].no)) return;
    for (int j = 0; j < halo_rows; ++j)
      kernels_.combine(halo.row(j, slot),
                       work_.z[0].row(j, k),
                       work_.p.row(j, k),
                       beta_.data(),
                       grid_.levels[0].nx);
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
    const Planes u{plane(k - 2), plane(k - 1), plane(k)};
    if (k > slab.begin) clear_sums(k - 1);
    for (int j = 0; j < level.ni; ++j) {
      if (k < slab.end)
        kernels_.direction(mode,
                           work_.p.row(j, k),
                           work_.z[0].row(j, k),
                           work_.d.row(j, k),
                           alpha_.data(),
                           beta_.data(),
                           level.nx);
      if (k > slab.begin)
        kernels_.apply(work_.q.row(j, k - 1),
                       level.sink + level.row(j, k - 1),
                       stencil(0, u, j, k - 1),
                       sums(k - 1),
                       level.nx);
    }
  }
}

std::span<const double> HostPasses::update_norm() {
  for (int m = 0; m < width_; ++m)
    alpha_[m] = gamma_[m] > 0.0 ? static_cast<float>(rho_[m] / gamma_[m]) : 0.0F;
  step_ = true;
  for_slabs(work_.parts(0), grid_.levels[0].no, [&](Slab slab) {
    for (int k = slab.begin; k < slab.end; ++k) {
      clear_sums(k);
      for (int j = 0; j < grid_.levels[0].ni; ++j)
        kernels_.update(
            work_.r[0].row(j, k), work_.q.row(j, k), alpha_.data(), sums(k), grid_.levels[0].nx);
    }
  });
  total(norms_);
  for (int m = 0; m < group_.count; ++m) norms_[m] *= group_.b_norms[m];
  return norms_;
}

}  // namespace opaline::reconstruct::host
