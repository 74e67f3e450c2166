#include <algorithm>

#include "reconstruct/host/host_passes.h"

// The float64 part of HostPasses: x += d and r = b - K x, on the caller's fields.
namespace opaline::reconstruct::host {

std::span<const double> HostPasses::true_residual() {
  const int parts = work_.parts(0);
  const int planes = grid_.levels[0].no;
  if (step_ || correction_) {
    for_slabs(parts, planes, [&](Slab slab) { add_correction(slab); });
    group_.x_is_zero = false;
  }
  step_ = correction_ = false;
  for_slabs(parts, planes, [&](Slab slab) { residual_slab(slab); });
  total(norms_);
  return norms_;
}

void HostPasses::add_correction(Slab slab) {
  for (int k = slab.begin; k < slab.end; ++k)
    for (int j = 0; j < grid_.levels[0].ni; ++j)
      for (int m = 0; m < group_.count; ++m) {
        const double back = scale_[m] > 0.0 ? 1.0 / (scale_[m] * grid_.unit) : 0.0;
        const double step = step_ ? back * static_cast<double>(alpha_[m]) : 0.0;
        add_to_line(work_.d.row(j, k) + m,
                    correction_ ? back : 0.0,
                    work_.p.row(j, k) + m,
                    step,
                    group_.x.field(group_.first + m) + grid_.caller_row(j, k));
      }
}

void HostPasses::add_to_line(
    const float* d, double d_factor, const float* p, double p_factor, double* x) const {
  const int nx = grid_.levels[0].nx;
  for (std::ptrdiff_t i = 0; i < nx; ++i)
    x[i] += d_factor * static_cast<double>(d[i * width_]) +
            p_factor * static_cast<double>(p[i * width_]);
}

void HostPasses::residual_slab(Slab slab) {
  std::vector<double> line(grid_.levels[0].nx);
  for (int k = slab.begin; k < slab.end; ++k) {
    clear_sums(k);
    for (int j = 0; j < grid_.levels[0].ni; ++j)
      for (int m = 0; m < group_.count; ++m) {
        sums(k)[m] += group_.x_is_zero ? copy_line(m, j, k, line) : residual_line(m, j, k, line);
        float* r = work_.r[0].row(j, k) + m;
        for (const double value : line) {
          *r = static_cast<float>(value * scale_[m]);
          r += width_;
        }
      }
  }
}

double HostPasses::copy_line(int m, int j, int k, std::vector<double>& line) const {
  const double* b = group_.b.field(group_.first + m) + grid_.caller_row(j, k);
  std::copy_n(b, line.size(), line.begin());
  double sum = 0.0;
  for (const double value : line) sum += value * value;
  return sum;
}

double HostPasses::residual_line(int m, int j, int k, std::vector<double>& line) const {
  const diffusion::Level& fine = grid_.finest;
  const std::size_t at = grid_.levels[0].row(j, k);
  const auto inner = static_cast<std::ptrdiff_t>(grid_.inner_stride);
  const auto outer = static_cast<std::ptrdiff_t>(grid_.outer_stride);
  const double* x = group_.x.field(group_.first + m) + grid_.caller_row(j, k);
  const auto near = [&](bool there, std::ptrdiff_t offset) { return there ? x + offset : nullptr; };
  const auto g = [&](int axis, bool there, std::size_t back) {
    return there ? fine.conductance[axis].data() + at - back : nullptr;
  };
  const LineResidual problem{group_.b.field(group_.first + m) + grid_.caller_row(j, k),
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
  return line_residual(problem, line.data(), fine.cells[0]);
}

}  // namespace opaline::reconstruct::host
