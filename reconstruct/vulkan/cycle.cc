#include "reconstruct/vulkan/cycle.h"

#include <algorithm>

namespace opaline::reconstruct::vulkan {
namespace {

constexpr int kRed = 0;
constexpr int kBlack = 1;

std::int32_t narrow(std::size_t n) { return static_cast<std::int32_t>(n); }

}  // namespace

void Cycle::clear() {
  for (auto* list : {&fields_.r, &fields_.z, &fields_.finest, &fields_.sums})
    for (gpu::Buffer& buffer : *list) recorder_.fill_zero(buffer);
  recorder_.barrier();
}

GridPush Cycle::push_for(int level, int color) const {
  const diffusion::Level& fine = levels_[level];
  GridPush push;
  push.cells = {fine.cells[0], fine.cells[1], fine.cells[2], narrow(fine.cell_count())};
  push.ratio[3] = color;
  push.partial[3] = fields_.groups;
  if (level + 1 == levels()) return push;
  const diffusion::Level& coarse = levels_[level + 1];
  push.coarse = {coarse.cells[0], coarse.cells[1], coarse.cells[2], narrow(coarse.cell_count())};
  std::copy_n(fine.ratio.begin(), 3, push.ratio.begin());
  return push;
}

std::size_t Cycle::colored_threads(int level) const {
  const auto& n = levels_[level].cells;
  return static_cast<std::size_t>((n[0] + 1) / 2) * n[1] * n[2];
}

void Cycle::dispatch(const gpu::Pipeline& kernel,
                     Buffers buffers,
                     const GridPush& push,
                     std::size_t threads) {
  const auto groups = static_cast<std::uint32_t>(fields_.groups);
  recorder_.dispatch(kernel, buffers, gpu::push_of(push), {workgroups(threads), groups, 1});
}

void Cycle::reduce(Scalar scalar, std::int32_t partials, std::int32_t first) {
  GridPush push = push_for(0, scalar);
  push.partial[0] = first;
  push.partial[1] = partials;
  dispatch(kernels_.reduce, {&fields_.partials(), &fields_.scalars()}, push, kWorkgroup);
}

void Cycle::smooth_restrict(int level) {
  const DeviceLevel& k = coefficients_[level];
  const std::size_t half = colored_threads(level);
  dispatch(kernels_.forward_black,
           {&k.low, &k.high, &fields_.r[level], &fields_.z[level]},
           push_for(level, kBlack),
           half);
  dispatch(
      kernels_.residual_red, {&k.low, &k.high, &fields_.z[level]}, push_for(level, kRed), half);
  dispatch(kernels_.restrict_residual,
           {&k.transfer, &fields_.z[level], &fields_.r[level + 1]},
           push_for(level),
           levels_[level + 1].cell_count());
}

void Cycle::prolong_smooth(int level) {
  const DeviceLevel& k = coefficients_[level];
  const std::size_t half = colored_threads(level);
  const bool last = level + 1 == levels();
  // the last level does not look at what is below
  const gpu::Buffer& below = last ? fields_.r[level] : fields_.z[level + 1];
  dispatch(kernels_.prolong_red,
           {&k.low, &k.transfer, &fields_.r[level], &below, &fields_.z[level]},
           push_for(level, kRed),
           half);
  const auto partials = narrow(workgroups(half));
  for (const int color : {kBlack, kRed}) {
    GridPush push = push_for(level, color);
    push.partial[0] = color == kBlack ? 0 : partials;
    push.partial[1] = 2 * partials;
    dispatch(kernels_.sweep,
             {&k.low, &k.high, &fields_.r[level], &fields_.z[level], &fields_.partials()},
             push,
             half);
  }
  if (level == 0) reduce(kRho, 2 * partials);
}

void Cycle::apply_dot(bool restart) {
  const DeviceLevel& k = coefficients_[0];
  GridPush push = push_for(0);
  push.partial[2] = restart ? 1 : 0;
  dispatch(kernels_.direction, {&fields_.scalars(), &fields_.z[0], &fields_.p()}, push, cells());
  push.partial[1] = narrow(workgroups(cells()));
  dispatch(kernels_.apply,
           {&k.low, &k.high, &fields_.p(), &fields_.q(), &fields_.partials()},
           push,
           cells());
  reduce(kGamma, push.partial[1]);
}

void Cycle::update() {
  GridPush push = push_for(0);
  push.partial[1] = narrow(workgroups(cells()));
  dispatch(kernels_.update,
           {&fields_.scalars(),
            &fields_.p(),
            &fields_.q(),
            &fields_.d(),
            &fields_.r[0],
            &fields_.partials()},
           push,
           cells());
  reduce(kNorm, push.partial[1]);
}

void Cycle::fold(gpu::Buffer& x, gpu::Buffer& x_low) {
  dispatch(kernels_.fold, {&fields_.d(), &x, &x_low}, push_for(0), cells());
}

void Cycle::residual(const gpu::Buffer& b, const gpu::Buffer& x, const gpu::Buffer& x_low) {
  const DeviceLevel& k = coefficients_[0];
  GridPush push = push_for(0);
  push.partial[1] = narrow(workgroups(cells()));
  dispatch(kernels_.residual,
           {&k.low, &k.high, &b, &x, &x_low, &fields_.r[0], &fields_.partials()},
           push,
           cells());
  reduce(kNorm, push.partial[1]);
  reduce(kSource, push.partial[1], push.partial[1] * fields_.groups);
}

std::span<const float> Cycle::read_scalars() {
  recorder_.copy(fields_.scalars(), fields_.scalars_on_host());
  recorder_.barrier();
  recorder_.finish();
  return fields_.scalars_on_host().floats();
}

}  // namespace opaline::reconstruct::vulkan
