#include <algorithm>

#include "reconstruct/host/host_passes.h"

// The float64 part of HostPasses: x += d and r = b - K x, on the caller's fields.
namespace opaline::reconstruct::host {

template <class T, class S>
std::span<const double> HostPasses<T, S>::true_residual() {
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  const bool moves = step_ || correction_;
  if (moves) group_.x_is_zero = false;
  for_slabs(parts, planes, [&](Slab slab) { residual_slab(slab, moves); });
  if (moves && std::min(parts, planes) > 1)
    for_slabs(parts, planes, [&](Slab slab) { residual_ends(slab); });
  step_ = correction_ = false;
  total(work_.norm_sums, norms_);
  return norms_;
}

template <class T, class S>
void HostPasses<T, S>::residual_slab(Slab slab, bool moves) {
  const bool alone = slab.begin == 0 && slab.end == grid_.levels[0].no;
  const auto waits = [&](int k) {  // for the x of other slabs
    return moves && !alone && (k == slab.begin || k == slab.end - 1);
  };
  for (int k = slab.begin; k < slab.end + 1; ++k) {
    if (moves && k < slab.end) add_correction(k, slab.thread);
    if (k > slab.begin && !waits(k - 1)) residual_plane(k - 1, slab.thread);
  }
}

template <class T, class S>
void HostPasses<T, S>::residual_ends(Slab slab) {
  residual_plane(slab.begin, slab.thread);
  if (slab.end - 1 > slab.begin) residual_plane(slab.end - 1, slab.thread);
}

template <class T, class S>
void HostPasses<T, S>::add_correction(int k, int thread) {
  const HostLevel<T>& level = grid_.levels[0];
  const std::size_t line = padded(level.nx);
  std::vector<T>& fields = work_.fields[thread];
  const std::array<T, 16> none{};
  for (int j = 0; j < level.ni; ++j)
    fields_.to_fields(correction_ ? work_.d.row(j, k) : nullptr,
                      work_.p.row(j, k),
                      step_ ? step_length_.data() : none.data(),
                      fields.data() + j * line,
                      line * level.ni,
                      width_,
                      level.nx);
  for (int m = 0; m < group_.count; ++m) {
    if (scale_[m] == 0.0) continue;
    for (int j = 0; j < level.ni; ++j)
      fields_.add(group_.x.field(group_.first + m) + grid_.caller_row(j, k),
                  next_row(group_.x, m, j, k),
                  fields.data() + (static_cast<std::size_t>(m) * level.ni + j) * line,
                  1.0 / (scale_[m] * grid_.unit),
                  level.nx);
  }
}

template <class T, class S>
void HostPasses<T, S>::residual_plane(int k, int thread) {
  const HostLevel<T>& level = grid_.levels[0];
  const std::size_t line = padded(level.nx);
  std::vector<T>& fields = work_.fields[thread];
  clear_sums(k, 0);
  double* sums = &work_.norm_sums[sums_at(k, 0)];
  for (int m = 0; m < group_.count; ++m)
    for (int j = 0; j < level.ni; ++j)
      sums[m] +=
          fields_.residual(field_line(m, j, k),
                           next_row(group_.b, m, j, k),
                           scale_[m] * growth_[m],
                           fields.data() + (static_cast<std::size_t>(m) * level.ni + j) * line,
                           level.nx);
  for (int j = 0; j < level.ni; ++j)
    fields_.to_lanes(
        fields.data() + j * line, line * level.ni, work_.r[0].row(j, k), width_, level.nx);
}

template <class T, class S>
const double* HostPasses<T, S>::next_row(const diffusion::FieldBatch& fields,
                                         int m,
                                         int j,
                                         int k) const {
  const bool here = j + 1 < grid_.levels[0].ni;
  const int field = here ? m : std::min(m + 1, group_.count - 1);
  return fields.field(group_.first + field) + grid_.caller_row(here ? j + 1 : 0, k);
}

template <class T, class S>
FieldLine HostPasses<T, S>::field_line(int m, int j, int k) const {
  const double* b = group_.b.field(group_.first + m) + grid_.caller_row(j, k);
  if (group_.x_is_zero) {
    FieldLine dark{};
    dark.b = b;
    return dark;
  }
  const diffusion::Level& fine = grid_.exact.front();
  const std::size_t at = grid_.levels[0].row(j, k);
  const auto inner = static_cast<std::ptrdiff_t>(grid_.inner_stride);
  const auto outer = static_cast<std::ptrdiff_t>(grid_.outer_stride);
  const double* x = group_.x.field(group_.first + m) + grid_.caller_row(j, k);
  const auto near = [&](bool there, std::ptrdiff_t offset) { return there ? x + offset : nullptr; };
  const auto g = [&](int axis, bool there, std::size_t back) {
    return there ? fine.conductance[axis].data() + at - back : nullptr;
  };
  return {b,
          x,
          near(j > 0, -inner),
          near(j + 1 < fine.cells[1], inner),
          near(k > 0, -outer),
          near(k + 1 < fine.cells[2], outer),
          fine.diagonal.data() + at,
          g(0, true, 0),
          g(1, j > 0, fine.stride(1)),
          g(1, true, 0),
          g(2, k > 0, fine.stride(2)),
          g(2, true, 0)};
}

template class HostPasses<float, float>;
template class HostPasses<float, Half>;
template class HostPasses<double, double>;

}  // namespace opaline::reconstruct::host
