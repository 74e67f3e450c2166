#include "reconstruct/host/host_passes.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace opaline::reconstruct::host {
namespace {

bool inside(int at, int begin, int end, int count) {
  return at >= std::max(begin, 0) && at < std::min(end, count);
}

/// The aggregates of the cells that a tile answers for.
Range below(const Range& cells, int ratio) {
  return {cells.begin / ratio,
          (cells.end + ratio - 1) / ratio,
          cells.low / ratio,
          (cells.high + ratio - 1) / ratio};
}

}  // namespace

template <class T, class S>
HostPasses<T, S>::HostPasses(ThreadTeam& team,
                             const HostGrid<T>& grid,
                             Workspace<T, S>& work,
                             const Group& group)
    : team_(team),
      grid_(grid),
      work_(work),
      group_(group),
      kernels_(row_kernels<T, S>(work.width)),
      fields_(field_kernels<T>()),
      width_(work.width),
      scale_(group.count),
      growth_(work.width, 1.0),
      rho_(work.width, 0.0),
      rho_before_(work.width, 0.0),
      energy_(work.width, 0.0),
      gamma_(work.width, 0.0),
      norms_(group.count, 0.0) {
  factor_.fill(T{1});
  for (int m = 0; m < group.count; ++m)
    scale_[m] = group.b_norms[m] > 0.0 ? 1.0 / std::sqrt(group.b_norms[m]) : 0.0;
}

template <class T, class S>
template <class F>
void HostPasses<T, S>::for_waves(int l, Slab slab, const F& f) {
  const std::vector<Tile>& tiles = work_.tiles[l];
  for (std::size_t n = 0; n < tiles.size(); ++n)
    f(Wave{l, grid_.levels[l], tiles[n], n, work_.scratch[l][slab.thread], slab});
}

template <class T, class S>
auto HostPasses<T, S>::around(const Wave& w, int k) const -> Planes {
  const auto plane = [&](int at) {
    return inside(at, 0, w.level.no, w.level.no) ? w.scratch.ring.plane(at % kRing) : nullptr;
  };
  return {plane(k - 1),
          plane(k),
          plane(k + 1),
          w.scratch.ring.row_size(),
          w.tile.inner.size(),
          w.tile.x.low,
          w.tile.inner.low};
}

template <class T, class S>
T* HostPasses<T, S>::ring_row(const Wave& w, int j, int k) const {
  return w.scratch.ring.row(j - w.tile.inner.low, k % kRing);
}

template <class T, class S>
Stencil<T> HostPasses<T, S>::stencil(
    const HostLevel<T>& level, const Planes& u, int j, int k, int x) const {
  const auto row = [&](const T* plane, int at) -> const T* {
    const int local = at - u.low_inner;
    if (plane == nullptr || local < 0 || local >= u.rows) return work_.zeros.data() + 2 * width_;
    return plane + local * u.row_size + static_cast<std::size_t>(x - u.low_x) * width_;
  };
  const std::size_t at = level.row(j, k) + x;
  const auto stride = static_cast<std::size_t>(level.nx);
  const std::size_t plane = stride * level.ni;
  return {row(u.at, j),
          row(u.at, j - 1),
          row(u.at, j + 1),
          row(u.before, j),
          row(u.after, j),
          level.gx + at,
          level.gi + at - stride,
          level.gi + at,
          level.go + at - plane,
          level.go + at};
}

template <class T, class S>
auto HostPasses<T, S>::packed_stencil(const Planes& u, int cell, int j, int k, int first) const
    -> PackedStencil<T> {
  const Stencil<T> s = stencil(grid_.levels[0], u, j, k, 0);
  return {s.u + static_cast<std::ptrdiff_t>(first - 1) * cell,
          s.u + static_cast<std::ptrdiff_t>(first) * cell,
          s.inner_before,
          s.inner_after,
          s.outer_before,
          s.outer_after,
          s.gx,
          s.gi_before,
          s.gi_after,
          s.go_before,
          s.go_after};
}

/// Null in the red cells of level 0, where r is zero.
template <class T, class S>
const T* HostPasses<T, S>::right_row(const Wave& w, int j, int k, int colour) const {
  if (w.l > 0) return work_.r[w.l].cell(w.tile.x.low, j, k, width_);
  return colour == kRed ? nullptr : work_.r[0].cell(w.tile.x.low / 2, j, k, width_);
}

template <class T, class S>
void HostPasses<T, S>::scale_row(const Wave& w, int j, int k, int colour) {
  kernels_.scale(ring_row(w, j, k),
                 right_row(w, j, k, colour),
                 w.l == 0,
                 w.level.inverse + w.level.row(j, k) + w.tile.x.low,
                 first_of(colour, j, k),
                 w.tile.x.size());
}

template <class T, class S>
void HostPasses<T, S>::sweep_row(const Wave& w, int j, int k, int colour) {
  kernels_.sweep(ring_row(w, j, k),
                 right_row(w, j, k, colour),
                 w.l == 0,
                 w.level.inverse + w.level.row(j, k) + w.tile.x.low,
                 stencil(w.level, around(w, k), j, k, w.tile.x.low),
                 first_of(colour, j, k),
                 w.tile.x.size());
}

template <class T, class S>
void HostPasses<T, S>::smooth_restrict(int l) {
  for_slabs(work_.parts(l), grid_.levels[l + 1].no, [&](Slab coarse) {
    for_waves(l, coarse, [&](const Wave& w) { restrict_wave(w); });
  });
}

template <class T, class S>
void HostPasses<T, S>::restrict_wave(const Wave& w) {
  const int ratio = w.level.ratio[2];
  const int halo = ratio - 1;  // planes beyond the slab that reach into it
  const int begin = w.slab.begin * ratio - halo;
  const int end = std::min(w.level.no, w.slab.end * ratio) + halo;
  const int last = w.l == 0 ? 1 : 2;  // on level 0 red cells are zero, and black ones r / D
  const Range& rows = w.tile.inner;
  for (int k = begin - last; k < end + last; ++k) {
    const bool scales = inside(k, begin - last, end + last, w.level.no);
    const bool sweeps = w.l > 0 && inside(k - 1, begin - 1, end + 1, w.level.no);
    const bool restricts = inside(k - last, begin, end, w.level.no);
    if (restricts) clear_below(w, k - last);
    for (int j = rows.low; j < rows.high; ++j) {
      if (scales) scale_row(w, j, k, w.l == 0 ? kBlack : kRed);
      if (sweeps) sweep_row(w, j, k - 1, kBlack);
      if (restricts) restrict_row(w, j, k - last);
    }
    if (restricts) store_below(w, k - last);
  }
}

template <class T, class S>
void HostPasses<T, S>::clear_below(const Wave& w, int k) {
  const bool paired = w.level.ratio[2] == 2;
  if (paired && k % 2 == 0 && k > 0) return;
  HostField<T>& sums = w.scratch.below;
  const int plane = (paired ? (k + 1) / 2 : k) % kRing;
  std::fill_n(sums.plane(plane), sums.plane_size(), T{0});
}

template <class T, class S>
void HostPasses<T, S>::store_below(const Wave& w, int k) {
  const bool paired = w.level.ratio[2] == 2;
  const auto store = [&](int plane) {
    if (!w.slab.has(plane)) return;
    const Range x = below(w.tile.x, w.level.ratio[0]);
    const Range rows = below(w.tile.inner, w.level.ratio[1]);
    for (int j = rows.begin; j < rows.end; ++j)
      std::copy_n(w.scratch.below.cell(x.begin - x.low, j - rows.low, plane % kRing, width_),
                  static_cast<std::size_t>(x.end - x.begin) * width_,
                  work_.r[w.l + 1].cell(x.begin, j, plane, width_));
  };
  if (!paired) {
    store(k);
    return;
  }
  if (k % 2 == 0) store(k / 2 - 1);
  if (k + 1 == w.level.no) store(k / 2);
}

template <class T, class S>
void HostPasses<T, S>::restrict_row(const Wave& w, int j, int k) {
  const Parents to = parents(w.l, j, k);
  const Range rows = below(w.tile.inner, w.level.ratio[1]);
  T* discard = w.scratch.discard.data() + width_;
  const auto row = [&](bool there, int at, int plane) {
    if (!there || at < rows.begin || at >= rows.end || !w.slab.has(plane)) return discard;
    return w.scratch.below.row(at - rows.low, plane % kRing);
  };
  const CoarseRows<T> sums{row(true, to.j, to.k),
                           row(to.has_inner, to.j_side, to.k),
                           row(to.has_outer, to.j, to.k_side)};
  if (sums.own == discard && sums.inner == discard && sums.outer == discard) return;
  kernels_.restrict_row(stencil(w.level, around(w, k), j, k, w.tile.x.low),
                        weights(w, j, k),
                        sums,
                        first_of(kRed, j, k),
                        w.tile.x.size());
}

template <class T, class S>
auto HostPasses<T, S>::parents(int l, int j, int k) const -> Parents {
  const std::array<int, 3>& ratio = grid_.levels[l].ratio;
  const HostLevel<T>& next = grid_.levels[l + 1];
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

template <class T, class S>
Weights<T> HostPasses<T, S>::weights(const Wave& w, int j, int k) const {
  const std::size_t at = w.level.row(j, k) + w.tile.x.low;
  return {w.level.own + at, w.level.wx + at, w.level.wi + at, w.level.wo + at, w.level.ratio[0]};
}

template <class T, class S>
void HostPasses<T, S>::prolong_smooth(int l) {
  for_slabs(work_.parts(l), grid_.levels[l].no, [&](Slab slab) {
    for_waves(l, slab, [&](const Wave& w) { prolong_wave(w); });
    std::atomic_thread_fence(std::memory_order_seq_cst);  // what was stored past the caches
  });
  if (l > 0) return;
  rho_before_ = rho_;
  total(work_.rho_sums, rho_);
  total(work_.energy_sums, energy_);
}

template <class T, class S>
void HostPasses<T, S>::prolong_wave(const Wave& w) {
  const bool last = w.l + 1 == levels();
  const int begin = w.slab.begin;
  const int end = w.slab.end;
  const Range& rows = w.tile.inner;
  for (int k = begin - 2; k < end + 2; ++k) {
    const bool starts = inside(k, 0, w.level.no, w.level.no);
    const bool sweeps = inside(k - 1, begin - 1, end + 1, w.level.no);
    const bool ends = w.slab.has(k - 2);
    if (ends && w.l == 0) clear_sums(k - 2, w.tile_index);
    for (int j = rows.low; j < rows.high; ++j) {
      if (starts) last ? scale_row(w, j, k, kRed) : prolong_row(w, j, k);
      if (sweeps) sweep_row(w, j, k - 1, kBlack);
      if (!ends || j < rows.begin || j >= rows.end) continue;
      if (w.l == 0) {
        emit_row(w, j, k - 2);
        energy_row(w, j, k - 2);
      } else {
        sweep_row(w, j, k - 2, kRed);
        copy_row(w, j, k - 2);
      }
    }
  }
}

template <class T, class S>
void HostPasses<T, S>::prolong_row(const Wave& w, int j, int k) {
  const Parents from = parents(w.l, j, k);
  const HostField<S>& above = work_.z[w.l + 1];
  const int x = w.tile.x.low / w.level.ratio[0];
  const auto row = [&](bool there, int at, int plane) {
    return there ? above.cell(x, at, plane, width_) : work_.stored_zeros.data() + width_;
  };
  kernels_.prolong(ring_row(w, j, k),
                   right_row(w, j, k, kRed),
                   w.level.inverse + w.level.row(j, k) + w.tile.x.low,
                   weights(w, j, k),
                   {row(true, from.j, from.k),
                    row(from.has_inner, from.j_side, from.k),
                    row(from.has_outer, from.j, from.k_side)},
                   first_of(kRed, j, k),
                   w.tile.x.size());
}

template <class T, class S>
void HostPasses<T, S>::copy_row(const Wave& w, int j, int k) {
  const Range& x = w.tile.x;
  kernels_.copy(work_.z[w.l].cell(x.begin, j, k, width_),
                ring_row(w, j, k) + static_cast<std::size_t>(x.begin - x.low) * width_,
                x.end - x.begin);
}

template <class T, class S>
void HostPasses<T, S>::emit_row(const Wave& w, int j, int k) {
  const Range& x = w.tile.x;
  kernels_.emit(work_.z[0].cell(x.begin / 2, j, k, width_),
                ring_row(w, j, k) + static_cast<std::size_t>(x.begin - x.low) * width_,
                work_.r[0].cell(x.begin / 2, j, k, width_),
                w.level.sink + w.level.row(j, k) + x.begin,
                &work_.rho_sums[sums_at(k, w.tile_index)],
                &work_.energy_sums[sums_at(k, w.tile_index)],
                first_of(kBlack, j, k),
                x.end - x.begin);
}

template <class T, class S>
void HostPasses<T, S>::energy_row(const Wave& w, int j, int k) {
  const Range& x = w.tile.x;
  kernels_.energy(w.level.sink + w.level.row(j, k) + x.begin,
                  w.level.inverse + w.level.row(j, k) + x.begin,
                  stencil(w.level, around(w, k), j, k, x.begin),
                  &work_.energy_sums[sums_at(k, w.tile_index)],
                  first_of(kRed, j, k),
                  x.end - x.begin);
}

template <class T, class S>
std::size_t HostPasses<T, S>::sums_at(int plane, std::size_t tile) const {
  return (plane * work_.tiles.front().size() + tile) * width_;
}

template <class T, class S>
void HostPasses<T, S>::clear_sums(int plane, std::size_t tile) {
  for (auto* sums : {&work_.rho_sums, &work_.energy_sums, &work_.norm_sums})
    std::fill_n(sums->data() + sums_at(plane, tile), width_, 0.0);
}

template <class T, class S>
void HostPasses<T, S>::total(const std::vector<double>& parts, std::vector<double>& sums) const {
  std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t at = 0; at < parts.size(); ++at)
    if (at % width_ < sums.size()) sums[at % width_] += parts[at];
}

template class HostPasses<float, float>;
template class HostPasses<float, Half>;
template class HostPasses<double, double>;

}  // namespace opaline::reconstruct::host
