#include <algorithm>

#include "reconstruct/host/host_passes.h"

// The float64 part of HostPasses: x += d and r = b - K x, on the caller's fields.
namespace opaline::reconstruct::host {
namespace {

constexpr std::size_t kBytesAtWork = 1280 << 10;  // of 2 MiB: four planes of x, one of all else
constexpr std::size_t kFewestRows = 4;

}  // namespace

template <class T, class S>
std::span<const double> HostPasses<T, S>::residual_pass(bool keeps) {
  keeps_ = keeps;
  const int parts = work_.parts(0);
  const bool moves = step_ || correction_;
  sets_ = group_.x_is_zero;
  if (moves) group_.x_is_zero = false;
  std::fill(work_.norm_sums.begin(), work_.norm_sums.end(), 0.0);
  for_slabs(parts, grid_.nz, [&](Slab slab) { residual_slab(slab, moves); });
  if (moves && std::min(parts, grid_.nz) > 1)
    for_slabs(parts, grid_.nz, [&](Slab slab) { residual_ends(slab); });
  step_ = correction_ = false;
  total(work_.norm_sums, norms_);
  return norms_;
}

template <class T, class S>
void HostPasses<T, S>::residual_slab(Slab slab, bool moves) {
  const bool alone = slab.begin == 0 && slab.end == grid_.nz;
  const auto waits = [&](int z) {  // for the x of other slabs
    return moves && !alone && (z == slab.begin || z == slab.end - 1);
  };
  const int step = rows_at_once(slab.thread);
  for (int y = 0; y < grid_.ny; y += step) {
    const bool last = y + step >= grid_.ny;
    const Rows moved{y, last ? grid_.ny : y + step};
    const Rows seen{std::max(0, moved.begin - 1), last ? grid_.ny : moved.end - 1};
    for (int z = slab.begin; z < slab.end + 1; ++z) {
      if (moves && z < slab.end) add_correction(moved, z, slab.thread);
      if (z > slab.begin && !waits(z - 1)) residual_rows(seen, z - 1, slab.thread);
    }
  }
}

template <class T, class S>
void HostPasses<T, S>::residual_ends(Slab slab) {
  const int step = rows_at_once(slab.thread);
  for (int z = slab.begin; z < slab.end; z += std::max(1, slab.end - 1 - slab.begin))
    for (int y = 0; y < grid_.ny; y += step)
      residual_rows({y, std::min(grid_.ny, y + step)}, z, slab.thread);
}

template <class T, class S>
void HostPasses<T, S>::add_correction(Rows rows, int z, int thread) {
  const std::array<T, 16> none{};
  const std::size_t line = padded(grid_.nx);
  T* fields = work_.fields[thread].data();
  for (int n = 0; n < rows.count(); ++n) {
    const auto [j, k] = grid_.row_of(rows.begin + n, z);
    fields_.to_fields(correction_ ? work_.d.row(j, k) : nullptr,
                      work_.p.row(j, k),
                      step_ ? step_length_.data() : none.data(),
                      fields + n * line,
                      line * rows.count(),
                      width_,
                      grid_.nx);
  }
  for (int m = 0; m < group_.count; ++m) {
    if (scale_[m] == 0.0) continue;
    double* x = group_.x.field(group_.first + m) + grid_.cell(rows.begin, z);
    for (int n = 0; n < rows.count(); ++n)
      (sets_ ? fields_.set : fields_.add)(
          x + static_cast<std::ptrdiff_t>(n) * grid_.nx,
          fields + (static_cast<std::size_t>(m) * rows.count() + n) * line,
          1.0 / (scale_[m] * grid_.unit),
          grid_.nx);
  }
}

template <class T, class S>
void HostPasses<T, S>::residual_rows(Rows rows, int z, int thread) {
  const std::size_t line = padded(grid_.nx);
  T* fields = work_.fields[thread].data();
  double* sums = &work_.norm_sums[sums_at(z, 0)];
  for (int m = 0; m < group_.count; ++m)
    for (int n = 0; n < rows.count(); ++n)
      sums[m] += fields_.residual(
          field_line(m, rows.begin + n, z),
          scale_[m] * growth_[m],
          keeps_ ? fields + (static_cast<std::size_t>(m) * rows.count() + n) * line : nullptr,
          grid_.nx);
  for (int n = 0; keeps_ && n < rows.count(); ++n) {
    const auto [j, k] = grid_.row_of(rows.begin + n, z);
    fields_.to_lanes(
        fields + n * line, line * rows.count(), work_.r[0].row(j, k), width_, grid_.nx);
  }
}

template <class T, class S>
int HostPasses<T, S>::rows_at_once(int thread) const {
  constexpr std::size_t kBytesPerCell = 4 * sizeof(double) + sizeof(double) + 4 * sizeof(T);
  const std::size_t row = static_cast<std::size_t>(grid_.nx) * width_ * kBytesPerCell;
  const std::size_t most = work_.fields[thread].size() / (padded(grid_.nx) * width_);
  const std::size_t rows = std::max<std::size_t>(kFewestRows, kBytesAtWork / row);
  return static_cast<int>(std::min(rows, most - 1));
}

template <class T, class S>
FieldLine HostPasses<T, S>::field_line(int m, int y, int z) const {
  const double* b = group_.b.field(group_.first + m) + grid_.cell(y, z);
  if (group_.x_is_zero) {
    FieldLine dark{};
    dark.b = b;
    return dark;
  }
  const diffusion::Level& fine = grid_.exact.front();
  const auto [j, k] = grid_.row_of(y, z);
  const std::size_t at = grid_.levels[0].row(j, k);
  const int along_y = grid_.exchanged ? 2 : 1;
  const int along_z = grid_.exchanged ? 1 : 2;
  const auto plane = static_cast<std::ptrdiff_t>(grid_.nx) * grid_.ny;
  const double* x = group_.x.field(group_.first + m) + grid_.cell(y, z);
  const auto near = [&](bool there, std::ptrdiff_t offset) { return there ? x + offset : nullptr; };
  const auto before = [&](bool there, int axis) {
    return there ? fine.conductance[axis].data() + at - fine.stride(axis) : nullptr;
  };
  return {b,
          x,
          near(y > 0, -grid_.nx),
          near(y + 1 < grid_.ny, grid_.nx),
          near(z > 0, -plane),
          near(z + 1 < grid_.nz, plane),
          fine.diagonal.data() + at,
          fine.conductance[0].data() + at,
          before(y > 0, along_y),
          fine.conductance[along_y].data() + at,
          before(z > 0, along_z),
          fine.conductance[along_z].data() + at};
}

template class HostPasses<float, float>;
template class HostPasses<float, Half>;
template class HostPasses<double, double>;

}  // namespace opaline::reconstruct::host
