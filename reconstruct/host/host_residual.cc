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
  std::fill(work_.norm_sums.begin(), work_.norm_sums.end(), 0.0);
  finishes_ = !keeps && (moved_ || aside_);
  if (finishes_)
    for (int m = 0; m < width_; ++m) shrunk_[m] = static_cast<T>(1.0 / growth_[m]);
  dark_ = keeps && group_.x_is_zero && !moved_ && !aside_;
  if (dark_) {
    for_slabs(parts, grid_.nz, [&](Slab slab) { dark_slab(slab); });
  } else {
    for_slabs(parts, grid_.nz, [&](Slab slab) { residual_slab(slab); });
    if (std::min(parts, grid_.nz) > 1) {
      for_slabs(parts, grid_.nz, [&](Slab slab) { relax_ends(slab); });
      for_slabs(parts, grid_.nz, [&](Slab slab) { residual_ends(slab); });
    }
    group_.x_is_zero = moved_ = aside_ = false;
  }
  total(work_.norm_sums, norms_);
  started_ = diffusion::worst_ratio(norms_, group_.b_norms);
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

template <class T, class S>
void HostPasses<T, S>::dark_slab(Slab slab) {
  const int step = rows_at_once(slab.thread);
  for (int z = slab.begin; z < slab.end; ++z)
    for (int y = 0; y < grid_.ny; y += step)
      residual_rows({y, std::min(grid_.ny, y + step)}, z, slab.thread);
}

/// Block by block of lines: the black cells of x in plane z, the red ones of plane z - 1, the residual of plane z - 2.
/// In each direction the residual lags the red cells by a line, and they lag the black ones.
template <class T, class S>
void HostPasses<T, S>::residual_slab(Slab slab) {
  const int step = rows_at_once(slab.thread);
  for (int y = 0; y < grid_.ny; y += step) {
    const bool last = y + step >= grid_.ny;
    const Rows moved{y, last ? grid_.ny : y + step};
    const Rows red{std::max(0, y - 1), last ? grid_.ny : moved.end - 1};
    const Rows seen{std::max(0, y - 2), last ? grid_.ny : moved.end - 2};
    for (int z = slab.begin; z < slab.end + 2; ++z) {
      if ((aside_ || moved_) && z < slab.end) {
        if (finishes_) finish_rows(moved, z);
        add_correction(moved, z, slab.thread);
      }
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
void HostPasses<T, S>::finish_rows(Rows rows, int z) {
  const HostLevel<T>& level = grid_.levels[0];
  for (int y = rows.begin; y < rows.end; ++y) {
    const auto [j, k] = grid_.row_of(y, z);
    T* d = work_.d.row(j, k);
    kernels_.finish(d,
                    moved_ ? d : nullptr,
                    work_.r[0].row(j, k),
                    level.inverse + level.row(j, k),
                    shrunk_.data(),
                    first_of(kBlack, j, k),
                    level.nx);
  }
}

template <class T, class S>
void HostPasses<T, S>::add_correction(Rows rows, int z, int thread) {
  const std::size_t line = padded(half_line(grid_.nx));
  const std::size_t field = line * rows.count();
  const auto spread = [&](bool there, const HostField<T>& d, T* fields) -> const T* {
    if (!there) return nullptr;
    for (int n = 0; n < rows.count(); ++n) {
      const auto [j, k] = grid_.row_of(rows.begin + n, z);
      fields_.to_fields(d.row(j, k), fields + n * line, field, width_, black_cells(j, k));
    }
    return fields;
  };
  T* fields = work_.fields[thread].data();
  const T* first = spread(aside_, work_.aside, fields);
  const T* second = spread(moved_ || finishes_, work_.d, fields + field * width_);
  for (int m = 0; m < group_.count; ++m) {
    if (scale_[m] == 0.0) continue;
    double* x = group_.x.field(group_.first + m) + grid_.cell(rows.begin, z);
    for (int n = 0; n < rows.count(); ++n) {
      const std::size_t at = (static_cast<std::size_t>(m) * rows.count() + n) * line;
      fields_.add(x + static_cast<std::ptrdiff_t>(n) * grid_.nx,
                  first != nullptr ? first + at : nullptr,
                  second != nullptr ? second + at : nullptr,
                  1.0 / (scale_[m] * grid_.unit),
                  first_of(kBlack, rows.begin + n, z),
                  grid_.nx);
    }
  }
}

template <class T, class S>
void HostPasses<T, S>::relax_lines(Rows rows, int z) {
  for (int m = 0; m < group_.count; m += kFieldsAtOnce)
    for (int y = rows.begin; y < rows.end; ++y) {
      const FieldLines lines = field_lines(m, y, z);
      std::array<double*, kFieldsAtOnce> to{};
      for (int n = 0; n < lines.count; ++n)
        to[n] = group_.x.field(group_.first + m + n) + grid_.cell(y, z);
      fields_.relax(line_coefficients(y, z), lines, to.data(), first_of(kRed, y, z), grid_.nx);
    }
}

template <class T, class S>
void HostPasses<T, S>::residual_rows(Rows rows, int z, int thread) {
  const std::size_t line = padded(half_line(grid_.nx));
  T* fields = work_.fields[thread].data();
  for (int m = 0; m < group_.count; m += kFieldsAtOnce)
    for (int row = 0; row < rows.count(); ++row) {
      const int y = rows.begin + row;
      const FieldLines lines = field_lines(m, y, z);
      std::array<T*, kFieldsAtOnce> r{};
      std::array<double, kFieldsAtOnce> scale{};
      for (int n = 0; n < lines.count; ++n) {
        scale[n] = scale_[m + n] * growth_[m + n];
        if (keeps_) r[n] = fields + (static_cast<std::size_t>(m + n) * rows.count() + row) * line;
      }
      const LineCoefficients k = line_coefficients(y, z);
      const int first = first_of(kBlack, y, z);
      const ResidualLines<T> to{scale.data(), r.data(), &work_.norm_sums[sums_at(z, 0) + m]};
      if (dark_)
        fields_.dark_residual(k, inverse_lines(y, z), lines, to, first, grid_.nx);
      else
        fields_.residual(k, lines, to, first, grid_.nx);
    }
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
  const std::size_t most = work_.fields[thread].size() / (2 * padded(half_line(grid_.nx)) * width_);
  const std::size_t rows = std::max<std::size_t>(kFewestRows, kBytesAtWork / row);
  return static_cast<int>(std::min(rows, most - kLag));
}

template <class T, class S>
FieldLines HostPasses<T, S>::field_lines(int first, int y, int z) const {
  const auto plane = static_cast<std::ptrdiff_t>(grid_.nx) * grid_.ny;
  const auto near = [&](const double* at) {
    return NearLines{at,
                     y > 0 ? at - grid_.nx : at,
                     y + 1 < grid_.ny ? at + grid_.nx : at,
                     z > 0 ? at - plane : at,
                     z + 1 < grid_.nz ? at + plane : at};
  };
  FieldLines lines{};
  lines.count = std::min(kFieldsAtOnce, group_.count - first);
  for (int n = 0; n < lines.count; ++n) {
    lines.b[n] = near(group_.b.field(group_.first + first + n) + grid_.cell(y, z));
    lines.x[n] = near(group_.x.field(group_.first + first + n) + grid_.cell(y, z));
  }
  return lines;
}

/// Where a line in the exact and in the rounded coefficients begins.
template <class T, class S>
std::size_t HostPasses<T, S>::line_at(int y, int z) const {
  const auto [j, k] = grid_.row_of(y, z);
  return grid_.levels[0].row(j, k);
}

/// What lies beyond the last line or plane is not joined to it, so the first one takes its coefficients from there.
template <class T, class S>
LineCoefficients HostPasses<T, S>::line_coefficients(int y, int z) const {
  const diffusion::Level& fine = grid_.exact.front();
  const double* gy = fine.conductance[grid_.exchanged ? 2 : 1].data();
  const double* gz = fine.conductance[grid_.exchanged ? 1 : 2].data();
  const std::size_t at = line_at(y, z);
  return {fine.diagonal.data() + at,
          fine.conductance[0].data() + at,
          gy + line_at(y > 0 ? y - 1 : grid_.ny - 1, z),
          gy + at,
          gz + line_at(y, z > 0 ? z - 1 : grid_.nz - 1),
          gz + at};
}

template <class T, class S>
InverseLines<T> HostPasses<T, S>::inverse_lines(int y, int z) const {
  const T* inverse = grid_.levels[0].inverse;
  return {1.0 / grid_.unit,
          inverse + line_at(y, z),
          inverse + line_at(std::max(y - 1, 0), z),
          inverse + line_at(std::min(y + 1, grid_.ny - 1), z),
          inverse + line_at(y, std::max(z - 1, 0)),
          inverse + line_at(y, std::min(z + 1, grid_.nz - 1))};
}

template class HostPasses<float, float>;
template class HostPasses<float, Half>;
template class HostPasses<double, double>;

}  // namespace opaline::reconstruct::host
