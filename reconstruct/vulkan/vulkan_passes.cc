#include "reconstruct/vulkan/vulkan_passes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace opaline::reconstruct::vulkan {
namespace {

constexpr int kRed = 0;
constexpr int kBlack = 1;

std::int32_t narrow(std::size_t n) { return static_cast<std::int32_t>(n); }

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
      b_(b),
      x_(x),
      first_(first),
      cells_(b.cells),
      norms_(static_cast<std::size_t>(count), 0.0) {
  start();
  DeviceFields& f = device_.fields;
  for (auto* list : {&f.r, &f.z, &f.finest, &f.sums})
    for (gpu::Buffer& buffer : *list) device_.commands.fill_zero(buffer);
  device_.commands.barrier();
}

void VulkanPasses::fail(const Error& error) {
  if (!error_) error_ = error;
}

std::span<const double> VulkanPasses::not_a_number() {
  std::ranges::fill(norms_, std::numeric_limits<double>::quiet_NaN());
  return norms_;
}

void VulkanPasses::start() {
  if (recording_ || error_) return;
  if (auto begun = device_.commands.begin(); !begun) return fail(begun.error());
  recording_ = true;
}

void VulkanPasses::finish() {
  if (!recording_) return;
  recording_ = false;
  if (auto ended = device_.commands.end(); !ended) return fail(ended.error());
  if (auto done = device_.context.run(device_.commands); !done) fail(done.error());
}

GridPush VulkanPasses::push_for(int level, int color) const {
  const diffusion::Level& fine = device_.levels[level];
  GridPush push;
  push.cells = {fine.cells[0], fine.cells[1], fine.cells[2], narrow(fine.cell_count())};
  push.ratio[3] = color;
  push.partial[3] = device_.fields.groups;
  if (level + 1 == levels()) return push;
  const diffusion::Level& coarse = device_.levels[level + 1];
  push.coarse = {coarse.cells[0], coarse.cells[1], coarse.cells[2], narrow(coarse.cell_count())};
  std::copy_n(fine.ratio.begin(), 3, push.ratio.begin());
  return push;
}

std::size_t VulkanPasses::colored_threads(int level) const {
  const auto& n = device_.levels[level].cells;
  return static_cast<std::size_t>((n[0] + 1) / 2) * n[1] * n[2];
}

/// Dispatches in turn: each sees what those before it wrote.
void VulkanPasses::dispatch(const gpu::Pipeline& kernel,
                            Buffers buffers,
                            const GridPush& push,
                            std::size_t threads) {
  start();
  if (error_) return;
  const auto groups = static_cast<std::uint32_t>(device_.fields.groups);
  device_.commands.dispatch(kernel,
                            {std::span(buffers.begin(), buffers.size()), gpu::push_of(push)},
                            {workgroups(threads), groups, 1});
  device_.commands.barrier();
}

void VulkanPasses::reduce(Scalar scalar, std::int32_t partials) {
  GridPush push = push_for(0, scalar);
  push.partial[1] = partials;
  dispatch(device_.kernels.reduce,
           {&device_.fields.partials(), &device_.fields.scalars()},
           push,
           kWorkgroup);
}

void VulkanPasses::smooth_restrict(int level) {
  const DeviceLevel& k = device_.coefficients[level];
  DeviceFields& f = device_.fields;
  const std::size_t half = colored_threads(level);
  dispatch(device_.kernels.forward_black,
           {&k.low, &k.high, &f.r[level], &f.z[level]},
           push_for(level, kBlack),
           half);
  dispatch(
      device_.kernels.residual_red, {&k.low, &k.high, &f.z[level]}, push_for(level, kRed), half);
  dispatch(device_.kernels.restrict_residual,
           {&k.transfer, &f.z[level], &f.r[level + 1]},
           push_for(level),
           device_.levels[level + 1].cell_count());
}

void VulkanPasses::prolong_smooth(int level) {
  const DeviceLevel& k = device_.coefficients[level];
  DeviceFields& f = device_.fields;
  const std::size_t half = colored_threads(level);
  const bool last = level + 1 == levels();
  const gpu::Buffer& below = last ? f.r[level] : f.z[level + 1];  // the last level does not look
  dispatch(device_.kernels.prolong_red,
           {&k.low, &k.transfer, &f.r[level], &below, &f.z[level]},
           push_for(level, kRed),
           half);
  const auto partials = narrow(workgroups(half));
  for (const int color : {kBlack, kRed}) {
    GridPush push = push_for(level, color);
    push.partial[0] = color == kBlack ? 0 : partials;
    push.partial[1] = 2 * partials;
    dispatch(device_.kernels.sweep,
             {&k.low, &k.high, &f.r[level], &f.z[level], &f.partials()},
             push,
             half);
  }
  if (level == 0) reduce(kRho, 2 * partials);
}

void VulkanPasses::apply_dot(bool restart) {
  const DeviceLevel& k = device_.coefficients[0];
  DeviceFields& f = device_.fields;
  GridPush push = push_for(0);
  push.partial[2] = restart ? 1 : 0;
  dispatch(device_.kernels.direction, {&f.scalars(), &f.z[0], &f.p()}, push, cells_);
  push.partial[1] = narrow(workgroups(cells_));
  dispatch(device_.kernels.apply, {&k.low, &k.high, &f.p(), &f.q(), &f.partials()}, push, cells_);
  reduce(kGamma, push.partial[1]);
}

std::span<const double> VulkanPasses::update_norm() {
  DeviceFields& f = device_.fields;
  GridPush push = push_for(0);
  push.partial[1] = narrow(workgroups(cells_));
  dispatch(device_.kernels.update,
           {&f.scalars(), &f.p(), &f.q(), &f.d(), &f.r[0], &f.partials()},
           push,
           cells_);
  reduce(kNorm, push.partial[1]);
  if (error_) return not_a_number();
  device_.commands.copy(f.scalars(), f.scalars_on_host(), f.scalars().bytes());
  device_.commands.barrier();
  corrected_ = true;
  finish();
  if (error_) return not_a_number();
  const std::span<const float> scalars = f.scalars_on_host().floats();
  for (std::size_t m = 0; m < norms_.size(); ++m) {
    const double norm = scalars[static_cast<std::size_t>(kNorm) * f.groups * kLanes + m];
    norms_[m] = norm * scale_[m] * scale_[m];
  }
  return norms_;
}

/// x += d.
void VulkanPasses::fetch_correction() {
  if (!corrected_) return;
  DeviceFields& f = device_.fields;
  start();
  if (error_) return;
  device_.commands.copy(f.d(), f.staging(), f.staging().bytes());
  device_.commands.barrier();
  finish();
  if (error_) return;
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
  finish();  // the staging field may still be asked for
  start();
  if (error_) return;
  const std::span<float> staging = f.staging().floats();
  std::ranges::fill(staging, 0.0F);
  for (std::size_t m = 0; m < residuals.size(); ++m)
    for (std::size_t c = 0; c < cells_; ++c)
      staging[lane(cells_, m, c)] = static_cast<float>(residuals[m][c] / scale_[m]);
  device_.commands.copy(f.staging(), f.r[0], f.staging().bytes());
  device_.commands.fill_zero(f.d());
  device_.commands.barrier();
}

std::span<const double> VulkanPasses::true_residual() {
  fetch_correction();
  if (error_) return not_a_number();
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
  if (error_) return not_a_number();
  return norms_;
}

std::vector<double> VulkanPasses::read(const gpu::Buffer& field, int m) {
  finish();
  std::vector<float> floats(field.bytes() / sizeof(float));
  auto got = gpu::download(device_.context, field, std::as_writable_bytes(std::span(floats)));
  if (!got) fail(got.error());
  const std::size_t cells =
      floats.size() / (static_cast<std::size_t>(device_.fields.groups) * kLanes);
  std::vector<double> values(cells);
  for (std::size_t c = 0; c < cells; ++c)
    values[c] = scale_[m] * floats[lane(cells, static_cast<std::size_t>(m), c)];
  return values;
}

}  // namespace opaline::reconstruct::vulkan
