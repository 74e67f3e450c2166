#include <algorithm>

#include "reconstruct/host/host_passes.h"

// The float64 part of HostPasses: x += d and r = b - K x, on the caller's fields.
namespace opaline::reconstruct::host {
namespace {

// Four planes of x, one of all else. More than a second-level cache: lines taken again cost more.
constexpr std::size_t kBytesAtWork = 2560 << 10;
constexpr std::size_t kFewestRows = 4;
constexpr std::size_t kLag = 2;  // lines by which the residual lags x

}  // namespace

template <class T, class S>
std::span<const double> HostPasses<T, S>::residual_pass(bool keeps) {
  keeps_ = keeps;
  const int parts = work_.parts(0);
  const bool moves = step_ || correction_;
  if (moves) group_.x_is_zero = false;
  std::fill(work_.norm_sums.begin(), work_.norm_sums.end(), 0.0);
  for_slabs(parts, grid_.nz, [&](Slab slab) { residual_slab(slab, moves); });
  if (std::min(parts, grid_.nz) > 1) {
    for_slabs(parts, grid_.nz, [&](Slab slab) { relax_ends(slab); });
    for_slabs(parts, grid_.nz, [&](Slab slab) { residual_ends(slab); });
  }
  group_.x_is_zero = step_ = correction_ = false;
  total(work_.norm_sums, norms_);
  return norms_;
}

/// Red cells of plane z wait for the black ones of another slab.
template <class T, class S>
bool HostPasses<T, S>::relaxes_late(Slab slab, int z) const {
  return (z == slab.begin && z > 0) || (z + 1 == slab.end && z + 1 < grid_.nz);
}

/// The residual of plane z waits for such red cells, in it or beside it.
template <class T, class S>
bool HostPasses<T, S>::answers_late(Slab slab, int z) const {
  for (int near = std::max(0, z - 1); near < std::min(grid_.nz, z + 2); ++near)
    if (!slab.has(near) || relaxes_late(slab, near)) return true;
  return false;
}

/// Block by block of lines: the black cells of x in plane z, the red ones of plane z - 1, the residual of plane z - 2.
/// In each direction the residual lags the red cells by a line, and they lag the black ones.
template <class T, class S>
void HostPasses<T, S>::residual_slab(Slab slab, bool moves) {
  const int step = rows_at_once(slab.thread);
  for (int y = 0; y < grid_.ny; y += step) {
    const bool last = y + step >= grid_.ny;
    const Rows moved{y, last ? grid_.ny : y + step};
    const Rows red{std::max(0, y - 1), last ? grid_.ny : moved.end - 1};
    const Rows seen{std::max(0, y - 2), last ? grid_.ny : moved.end - 2};
    for (int z = slab.begin; z < slab.end + 2; ++z) {
      if (moves && z < slab.end) add_correction(moved, z, slab.thread);
      if (slab.has(z - 1) && !relaxes_late(slab, z - 1)) relax_lines(red, z - 1);
      if (slab.has(z - 2) && !answers_late(slab, z - 2)) residual_rows(seen, z - 2, slab.thread);
    }
  }
}

template <class T, class S>
void HostPasses<T, S>::relax_ends(Slab slab) {
  for (int z = slab.begin; z < slab.end; ++z)
    if (relaxes_late(slab, z)) relax_lines({0, grid_.ny}, z);
}

template <class T, class S>
void HostPasses<T, S>::residual_ends(Slab slab) {
  const int step = rows_at_once(slab.thread);
  for (int z = slab.begin; z < slab.end; ++z)
    for (int y = 0; answers_late(slab, z) && y < grid_.ny; y += step)
      residual_rows({y, std::min(grid_.ny, y + step)}, z, slab.thread);
}

template <class T, class S>
void HostPasses<T, S>::add_correction(Rows rows, int z, int thread) {
  const std::array<T, 16> none{};
  const std::size_t line = padded(half_line(grid_.nx));
  T* fields = work_.fields[thread].data();
  for (int n = 0; n < rows.count(); ++n) {
    const auto [j, k] = grid_.row_of(rows.begin + n, z);
    fields_.to_fields(correction_ ? work_.d.row(j, k) : nullptr,
                      work_.p.row(j, k),
                      step_ ? step_length_.data() : none.data(),
                      fields + n * line,
                      line * rows.count(),
                      width_,
                      black_cells(j, k));
  }
  for (int m = 0; m < group_.count; ++m) {
    if (scale_[m] == 0.0) continue;
    double* x = group_.x.field(group_.first + m) + grid_.cell(rows.begin, z);
    for (int n = 0; n < rows.count(); ++n)
      fields_.add(x + static_cast<std::ptrdiff_t>(n) * grid_.nx,
                  fields + (static_cast<std::size_t>(m) * rows.count() + n) * line,
                  1.0 / (scale_[m] * grid_.unit),
                  first_of(kBlack, rows.begin + n, z),
                  grid_.nx);
  }
}

template <class T, class S>
void HostPasses<T, S>::relax_lines(Rows rows, int z) {
  for (int m = 0; m < group_.count; ++m)
    for (int y = rows.begin; y < rows.end; ++y)
      fields_.relax(field_line(m, y, z, group_.x_is_zero),
                    group_.x.field(group_.first + m) + grid_.cell(y, z),
                    first_of(kRed, y, z),
                    grid_.nx);
}

template <class T, class S>
void HostPasses<T, S>::residual_rows(Rows rows, int z, int thread) {
  const std::size_t line = padded(half_line(grid_.nx));
  T* fields = work_.fields[thread].data();
  double* sums = &work_.norm_sums[sums_at(z, 0)];
  for (int m = 0; m < group_.count; ++m)
    for (int n = 0; n < rows.count(); ++n)
      sums[m] += fields_.residual(
          field_line(m, rows.begin + n, z, false),
          scale_[m] * growth_[m],
          keeps_ ? fields + (static_cast<std::size_t>(m) * rows.count() + n) * line : nullptr,
          first_of(kBlack, rows.begin + n, z),
          grid_.nx);
  if (!keeps_) return;
  const std::size_t field = line * rows.count();
  std::fill(fields + group_.count * field, fields + width_ * field, T{0});  // lanes without a field
  for (int n = 0; n < rows.count(); ++n) {
    const auto [j, k] = grid_.row_of(rows.begin + n, z);
    fields_.to_lanes(fields + n * line, field, work_.r[0].row(j, k), width_, black_cells(j, k));
  }
}

template <class T, class S>
int HostPasses<T, S>::rows_at_once(int thread) const {
  constexpr std::size_t kBytesPerCell = 4 * sizeof(double) + sizeof(double) + 4 * sizeof(T);
  const std::size_t row = static_cast<std::size_t>(grid_.nx) * width_ * kBytesPerCell;
  const std::size_t most = work_.fields[thread].size() / (padded(half_line(grid_.nx)) * width_);
  const std::size_t rows = std::max<std::size_t>(kFewestRows, kBytesAtWork / row);
  return static_cast<int>(std::min(rows, most - kLag));
}

template <class T, class S>
FieldLine HostPasses<T, S>::field_line(int m, int y, int z, bool dark) const {
  const double* b = group_.b.field(group_.first + m) + grid_.cell(y, z);
  const diffusion::Level& fine = grid_.exact.front();
  const auto [j, k] = grid_.row_of(y, z);
  const std::size_t at = grid_.levels[0].row(j, k);
  if (dark) {
    FieldLine line{};
    line.b = b;
    line.diagonal = fine.diagonal.data() + at;
    return line;
  }
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
