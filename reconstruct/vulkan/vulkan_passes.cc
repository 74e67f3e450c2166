#include "reconstruct/vulkan/vulkan_passes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace opaline::reconstruct::vulkan {
namespace {

/// Where right-hand side m of cell c lies among the floats of a field on the device.
std::size_t lane(std::size_t cells, std::size_t m, std::size_t c) {
  return (m / kLanes * cells + c) * kLanes + m % kLanes;
}

}  // namespace

VulkanPasses::VulkanPasses(const Device& device,
                           const diffusion::FieldBatch& b,
                           diffusion::FieldBatch& x,
                           int first,
                           int count)
    : device_(device),
      recorder_(device.context, device.commands),
      cycle_(recorder_, device.kernels, device.levels, device.coefficients, device.fields),
      b_(b),
      x_(x),
      first_(first),
      cells_(b.cells),
      norms_(static_cast<std::size_t>(count), 0.0) {
  cycle_.clear();
}

std::span<const double> VulkanPasses::not_a_number() {
  std::ranges::fill(norms_, std::numeric_limits<double>::quiet_NaN());
  return norms_;
}

std::span<const double> VulkanPasses::update_norm() {
  cycle_.update();
  corrected_ = true;
  const std::span<const float> scalars = cycle_.read_scalars();
  if (error()) return not_a_number();
  for (std::size_t m = 0; m < norms_.size(); ++m) {
    const double norm =
        scalars[static_cast<std::size_t>(kNorm) * device_.fields.groups * kLanes + m];
    norms_[m] = norm * scale_[m] * scale_[m];
  }
  return norms_;
}

/// x += d.
void VulkanPasses::fetch_correction() {
  if (!corrected_) return;
  DeviceFields& f = device_.fields;
  recorder_.copy(f.d(), f.staging());
  recorder_.barrier();
  recorder_.finish();
  if (error()) return;
  const std::span<const float> d = f.staging().floats();
  for (std::size_t m = 0; m < norms_.size(); ++m) {
    double* x = x_.field(first_ + static_cast<int>(m));
    for (std::size_t c = 0; c < cells_; ++c) x[c] += scale_[m] * d[lane(cells_, m, c)];
  }
  corrected_ = false;
}

/// r to the device, d = 0; recorded, and run with the next iteration.
void VulkanPasses::send_residual(const std::vector<std::vector<double>>& residuals) {
  DeviceFields& f = device_.fields;
  recorder_.finish();  // the staging field may still be asked for
  const std::span<float> staging = f.staging().floats();
  std::ranges::fill(staging, 0.0F);
  for (std::size_t m = 0; m < residuals.size(); ++m)
    for (std::size_t c = 0; c < cells_; ++c)
      staging[lane(cells_, m, c)] = static_cast<float>(residuals[m][c] / scale_[m]);
  recorder_.copy(f.staging(), f.r[0]);
  recorder_.fill_zero(f.d());
  recorder_.barrier();
}

std::span<const double> VulkanPasses::true_residual() {
  fetch_correction();
  if (error()) return not_a_number();
  std::vector<std::vector<double>> residuals(norms_.size());
  for (std::size_t m = 0; m < norms_.size(); ++m) {
    const int at = first_ + static_cast<int>(m);
    std::vector<double>& r = residuals[m];
    r.resize(cells_);
    diffusion::residual(device_.levels[0], b_.field(at), x_.field(at), r.data());
    norms_[m] = std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
  }
  if (scale_.empty())
    for (const double norm : norms_) scale_.push_back(norm > 0.0 ? std::sqrt(norm) : 1.0);
  send_residual(residuals);
  if (error()) return not_a_number();
  return norms_;
}

std::vector<double> VulkanPasses::read(const gpu::Buffer& field, int m) {
  recorder_.finish();
  std::vector<float> floats(field.bytes() / sizeof(float));
  auto got = gpu::download(device_.context, field, std::as_writable_bytes(std::span(floats)));
  if (!got) recorder_.fail(got.error());
  const std::size_t cells =
      floats.size() / (static_cast<std::size_t>(device_.fields.groups) * kLanes);
  std::vector<double> values(cells);
  for (std::size_t c = 0; c < cells; ++c)
    values[c] = scale_[m] * floats[lane(cells, static_cast<std::size_t>(m), c)];
  return values;
}

}  // namespace opaline::reconstruct::vulkan
