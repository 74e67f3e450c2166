#include "reconstruct/vulkan/device_space.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "reconstruct/vulkan/kernels.h"

namespace opaline::reconstruct::vulkan {
namespace {

constexpr std::size_t kVectorsAtATime = 4;  // combine.comp
constexpr std::size_t kSpareSlots = 2;      // of the best and of the last attempt

Result<gpu::Buffer> vector_of(gpu::Context& context, std::size_t cells) {
  return gpu::Buffer::create(context, 8 * cells, gpu::Memory::kDevice);
}

Result<void> add_vectors(gpu::Context& context,
                         std::size_t cells,
                         std::size_t count,
                         std::vector<gpu::Buffer>& list) {
  while (count-- > 0) {
    auto made = vector_of(context, cells);
    if (!made) return made.error();
    list.push_back(*std::move(made));
  }
  return ok();
}

std::int32_t slots_for(std::size_t pairs) {
  return kOwn + kProductSlots * static_cast<std::int32_t>(1 + pairs);
}

float narrow(double value) { return static_cast<float>(value); }

}  // namespace

Result<std::unique_ptr<DeviceSpace>> DeviceSpace::create(Recorder& recorder,
                                                         const ModelKernels& kernels,
                                                         std::size_t cells,
                                                         const LogBounds& bounds,
                                                         int memory) {
  gpu::Context& context = recorder.context();
  const auto pairs = static_cast<std::size_t>(memory);
  std::vector<gpu::Buffer> points;
  if (auto made = add_vectors(context, cells, 6, points); !made) return made.error();
  const auto point = [&](std::size_t n, std::size_t slot) {
    Point p{std::move(points[2 * n]), std::move(points[2 * n + 1]), {}, {}, {}};
    p.slot = slot;
    return p;
  };
  std::unique_ptr<DeviceSpace> space(new DeviceSpace(
      recorder, kernels, cells, bounds, point(0, 0), point(1, pairs), point(2, pairs + 1)));
  for (auto* list : {&space->s_, &space->y_})
    if (auto made = add_vectors(context, cells, pairs + kSpareSlots, *list); !made)
      return made.error();
  if (auto made = add_vectors(context, cells, 1, space->d_); !made) return made.error();
  auto sums = Sums::create(context, kernels, slots_for(pairs));
  if (!sums) return sums.error();
  space->sums_.push_back(*std::move(sums));
  space->spare_.resize(pairs);
  std::iota(space->spare_.rbegin(), space->spare_.rend(), std::size_t{0});
  return space;
}

VectorPush DeviceSpace::push() const {
  VectorPush push;
  push.size = {static_cast<std::int32_t>(2 * cells_), static_cast<std::int32_t>(cells_), 0, 0};
  push.bounds = {bounds_.scattering_from,
                 bounds_.scattering_to,
                 bounds_.absorption_from,
                 bounds_.absorption_to};
  return push;
}

void DeviceSpace::run(ModelKernel kernel,
                      std::initializer_list<const gpu::Buffer*> buffers,
                      const VectorPush& push,
                      std::uint32_t groups) {
  recorder_.dispatch(kernels_[kernel], buffers, gpu::push_of(push), {groups, 1, 1});
}

void DeviceSpace::set_direction(const LbfgsDirection& direction) {
  direction_ = direction;
  combined_ = false;
}

// d, four vectors at a time, and max |d| into the block.
void DeviceSpace::combine() {
  const double scale = objective_->scale();
  std::vector<std::pair<const gpu::Buffer*, double>> terms;
  for (std::size_t k = 0; k < direction_.s.size(); ++k) {
    terms.emplace_back(&y_[pairs_[k]], direction_.y[k] * scale);
    terms.emplace_back(&s_[pairs_[k]], direction_.s[k]);
  }
  while (terms.empty() || terms.size() % kVectorsAtATime != 0) terms.emplace_back(&here_.x, 0.0);
  VectorPush p = push();
  p.step[0] = narrow(direction_.gradient * scale);
  for (std::size_t n = 0; n < terms.size(); n += kVectorsAtATime) {
    p.size[2] = n == 0 ? 1 : 0;
    for (std::size_t i = 0; i < kVectorsAtATime; ++i) p.factors[i] = narrow(terms[n + i].second);
    run(ModelKernel::kCombine,
        {&here_.x,
         &here_.g,
         terms[n].first,
         terms[n + 1].first,
         terms[n + 2].first,
         terms[n + 3].first,
         &d_[0],
         &sums_[0].partials()},
        p,
        kSumGroups);
  }
  sums_[0].reduce(recorder_, kMove, 1);
  combined_ = true;
}

void DeviceSpace::multiply(const Point& point,
                           std::size_t pair,
                           std::size_t other,
                           std::int32_t slot) {
  VectorPush p = push();
  p.size[3] = slot;
  run(ModelKernel::kProducts,
      {&point.x, &point.g, &s_[pair], &y_[pair], &s_[other], &y_[other], &sums_[0].partials()},
      p,
      kSumGroups);
}

// The last attempt's pair and scalars, and all products.
void DeviceSpace::multiply_all() {
  run(ModelKernel::kPair,
      {&here_.x,
       &here_.g,
       &d_[0],
       &last_.x,
       &last_.g,
       &s_[last_.slot],
       &y_[last_.slot],
       &sums_[0].partials()},
      push(),
      kSumGroups);
  multiply(last_, last_.slot, last_.slot, kOwn);
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    multiply(last_, last_.slot, pairs_[k], slots_for(k));
}

// Products of a pair with itself and with `count` older ones, which lie oldest first from slots_for(0) on.
PairProducts DeviceSpace::products_from(const std::vector<double>& block,
                                        std::size_t first,
                                        std::size_t count) const {
  const double scale = objective_->scale();
  const auto at = [&](std::size_t slot) {
    return std::array{block[slot],
                      block[slot + 1] * scale,
                      block[slot + 2] * scale,
                      block[slot + 3] * scale * scale};
  };
  PairProducts products{at(first)};
  while (count-- > 0) products.push_back(at(static_cast<std::size_t>(slots_for(count))));
  return products;
}

void DeviceSpace::understand(const std::vector<double>& block, Point& point) const {
  const double scale = objective_->scale();
  point.at.chi_squared = block[kChiSquared] * scale;
  point.at.regularization = (block[kSmoothDiffusion] + block[kSmoothAbsorption]) * scale;
  point.at.value = 0.5 * point.at.chi_squared + point.at.regularization;
  point.free = {block[kLargest] * scale, block[kSquare] * scale * scale, {}, {}};
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const auto slot = static_cast<std::size_t>(slots_for(k));
    point.free.s.push_back(block[slot + 4] * scale);
    point.free.y.push_back(block[slot + 5] * scale * scale);
  }
  point.own_s = block[kOwn + 4] * scale;
  point.own_y = block[kOwn + 5] * scale * scale;
  point.products = products_from(block, kOwn, pairs_.size());
}

Result<LbfgsSpace::Attempt> DeviceSpace::attempt(double alpha, std::stop_token stop) {
  if (!combined_) combine();
  VectorPush p = push();
  p.step[1] = narrow(alpha);
  p.step[2] = narrow(std::min<double>(direction_.largest_move, std::numeric_limits<float>::max()));
  run(ModelKernel::kMove,
      {&here_.x, &d_[0], &sums_[0].block(), &last_.x},
      p,
      workgroups(2 * cells_));
  auto evaluated = objective_->evaluate(last_.x, last_.g, sums_[0], stop);
  if (!evaluated) return evaluated.error();
  multiply_all();
  const std::vector<double> block = sums_[0].read(recorder_);
  if (recorder_.error()) return *recorder_.error();
  understand(block, last_);
  const double scale = objective_->scale();
  const double shorter = std::min(1.0, direction_.largest_move / block[kMove]);
  return Attempt{here_.at.value,
                 last_.at.value,
                 block[kPromised] * scale,
                 block[kSlope] * scale * shorter,
                 block[kNewSlope] * scale * shorter,
                 block[kMove] * shorter};
}

void DeviceSpace::keep() { std::swap(best_, last_); }

PairProducts DeviceSpace::accept() {
  std::swap(here_, best_);
  best_.slot = here_.slot;  // free again unless the pair is remembered
  return here_.products;
}

void DeviceSpace::remember(std::size_t most) {
  pairs_.push_back(here_.slot);
  here_.free.s.push_back(here_.own_s);
  here_.free.y.push_back(here_.own_y);
  if (pairs_.size() <= most) {
    best_.slot = spare_.back();
    spare_.pop_back();
    return;
  }
  best_.slot = pairs_.front();
  pairs_.pop_front();
  here_.free.s.erase(here_.free.s.begin());
  here_.free.y.erase(here_.free.y.begin());
}

void DeviceSpace::forget_all() {
  spare_.insert(spare_.end(), pairs_.begin(), pairs_.end());
  pairs_.clear();
  here_.free.s.clear();
  here_.free.y.clear();
}

Result<void> DeviceSpace::upload(const std::vector<double>& values,
                                 double factor,
                                 gpu::Buffer& to) {
  std::vector<float> floats(values.size());
  std::ranges::transform(values, floats.begin(), [&](double v) { return narrow(v * factor); });
  recorder_.finish();  // what was recorded comes first
  return gpu::upload(recorder_.context(), std::as_bytes(std::span(floats)), to);
}

Result<std::vector<double>> DeviceSpace::download(const gpu::Buffer& from, double factor) {
  std::vector<float> floats(2 * cells_);
  recorder_.finish();
  auto got = gpu::download(recorder_.context(), from, std::as_writable_bytes(std::span(floats)));
  if (!got) return got.error();
  std::vector<double> values(floats.size());
  std::ranges::transform(floats, values.begin(), [&](float v) { return factor * v; });
  return values;
}

// Of each pair with itself and those before it, as attempts would have found them.
Result<void> DeviceSpace::fill_products(std::deque<PairProducts>& products) {
  products.clear();
  for (std::size_t j = 0; j < pairs_.size(); ++j) {
    multiply(here_, pairs_[j], pairs_[j], kOwn);
    for (std::size_t k = 0; k < j; ++k) multiply(here_, pairs_[j], pairs_[k], slots_for(k));
    const std::vector<double> block = sums_[0].read(recorder_);
    if (recorder_.error()) return *recorder_.error();
    products.push_back(products_from(block, kOwn, j));
  }
  return ok();
}

Result<void> DeviceSpace::load(const LbfgsState& state,
                               DeviceObjective& objective,
                               std::deque<PairProducts>& products) {
  objective_ = &objective;
  const double inverse = 1.0 / objective.scale();
  forget_all();
  for (auto* list : {&s_, &y_, &d_})
    for (gpu::Buffer& buffer : *list) recorder_.fill_zero(buffer);
  sums_[0].clear(recorder_);
  recorder_.barrier();
  for (Point* point : {&here_, &last_}) {
    if (auto sent = upload(state.x, 1.0, point->x); !sent) return sent;
    if (auto sent = upload(state.at.gradient, inverse, point->g); !sent) return sent;
  }
  for (const CurvaturePair& pair : state.pairs) {
    pairs_.push_back(spare_.back());
    spare_.pop_back();
    if (auto sent = upload(pair.s, 1.0, s_[pairs_.back()]); !sent) return sent;
    if (auto sent = upload(pair.y, inverse, y_[pairs_.back()]); !sent) return sent;
  }
  multiply_all();
  const std::vector<double> block = sums_[0].read(recorder_);
  if (recorder_.error()) return *recorder_.error();
  understand(block, here_);
  here_.at = {state.at.value, state.at.chi_squared, state.at.regularization, {}};
  return fill_products(products);
}

Result<LbfgsState> DeviceSpace::state() {
  const double scale = objective_->scale();
  LbfgsState state;
  auto x = download(here_.x, 1.0);
  if (!x) return x.error();
  state.x = *std::move(x);
  auto gradient = download(here_.g, scale);
  if (!gradient) return gradient.error();
  state.at = here_.at;
  state.at.gradient = *std::move(gradient);
  for (const std::size_t slot : pairs_) {
    auto s = download(s_[slot], 1.0);
    if (!s) return s.error();
    auto y = download(y_[slot], scale);
    if (!y) return y.error();
    state.pairs.push_back({*std::move(s), *std::move(y)});
  }
  return state;
}

}  // namespace opaline::reconstruct::vulkan
