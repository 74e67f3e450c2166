#include "reconstruct/vulkan/device_objective.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/regularizer.h"

namespace opaline::reconstruct::vulkan {
namespace {

using Values = std::vector<float>;

constexpr double kUselessResidual = 1e-3;  // as in reconstruct/solve_check.cc
constexpr int kMaxIterations = 100;

enum Work : std::size_t {
  kB,
  kRayCells,
  kCellProducts,
  kRayGradient,
  kEdgeWeights,
  kLitTerms,
  kSeenTerms,
  kCamera
};

double power_of_two(double value) {
  return value > 0.0 && std::isfinite(value) ? std::exp2(std::round(std::log2(value))) : 1.0;
}

double brightest(const ChannelProblem& problem) {
  double most = 0.0;
  for (const ChannelIllumination& i : problem.illuminations)
    for (const double q : i.irradiance) most = std::max(most, q);
  return power_of_two(most);
}

/// Of w L*^2 over the data that count.
double mean_square(const ChannelProblem& problem) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const ChannelIllumination& i : problem.illuminations)
    for (std::size_t x = 0; x < i.weight.size(); ++x) {
      if (!(i.weight[x] > 0.0)) continue;
      sum += i.weight[x] * i.radiance[x] * i.radiance[x];
      ++count;
    }
  return count > 0 ? power_of_two(sum / static_cast<double>(count)) : 1.0;
}

Result<gpu::Buffer> send(gpu::Context& context, const Values& values) {
  return gpu::create_filled(context, std::as_bytes(std::span(values)));
}

/// Rasters of some illuminations, four to a vec4, group after group; dark where there are no more.
Values lanes_of(const ChannelProblem& problem,
                std::size_t first,
                int groups,
                std::size_t face_cells,
                double factor,
                std::vector<double> ChannelIllumination::*raster) {
  Values values(face_cells * kLanes * static_cast<std::size_t>(groups), 0.0F);
  for (std::size_t m = 0; m < static_cast<std::size_t>(groups) * kLanes; ++m) {
    if (first + m >= problem.illuminations.size()) break;
    const std::vector<double>& from = problem.illuminations[first + m].*raster;
    for (std::size_t f = 0; f < face_cells; ++f)
      values[(m / kLanes * face_cells + f) * kLanes + m % kLanes] =
          static_cast<float>(factor * from[f]);
  }
  return values;
}

std::uint64_t with_coarser(std::uint64_t bytes) { return bytes * 8 / 7; }
/// Matrices, sinks and coefficients; rays, products, ray terms and the prior's weights.
std::uint64_t bytes_of_cell() { return with_coarser(52) + 8 + 16 + 16 + 8 + 8; }
/// r and z of all grids; p, q, d and b.
std::uint64_t bytes_of_group() { return with_coarser(32) + 64; }
constexpr std::uint64_t kSolutionBytes =
    64;  // of a cell and group: fluence and adjoint, high and low

}  // namespace

DeviceObjective::DeviceObjective(Recorder& recorder,
                                 const Kernels& kernels,
                                 const ModelKernels& model,
                                 const ChannelProblem& problem,
                                 const Settings& settings)
    : recorder_(recorder),
      kernels_(kernels),
      model_(model),
      problem_(problem),
      settings_(settings) {}

Result<std::unique_ptr<DeviceObjective>> DeviceObjective::create(Recorder& recorder,
                                                                 const Kernels& kernels,
                                                                 const ModelKernels& model,
                                                                 const ChannelProblem& problem,
                                                                 const Settings& settings) {
  std::unique_ptr<DeviceObjective> objective(
      new DeviceObjective(recorder, kernels, model, problem, settings));
  if (auto planned = objective->plan(); !planned) return planned.error();
  if (auto made = objective->allocate(); !made) return made.error();
  return objective;
}

/// How many groups a turn takes, and whether each turn's fields are kept.
Result<void> DeviceObjective::plan() {
  gpu::Context& context = recorder_.context();
  const gpu::DeviceInfo& device = context.device();
  const std::uint64_t cells = problem_.block.cell_count();
  const std::uint64_t most = std::min(device.max_binding_bytes, device.max_allocation_bytes);
  const std::uint64_t all = (problem_.illuminations.size() + kLanes - 1) / kLanes;
  const std::uint64_t free = context.memory_left() / 10 * 9;
  const std::uint64_t rays = problem_.rays.empty() ? 0 : DeviceCameraRays::kBytesOfCell;
  const std::uint64_t fixed = (bytes_of_cell() + rays) * cells;
  const std::uint64_t group = (bytes_of_group() + kSolutionBytes) * cells;
  if (workgroups(cells) > device.max_groups_x || 16 * cells > most || fixed + group > free)
    return unavailable(
        fmt::format("{} cells and their minimisation are too much for {}", cells, device.name));
  const std::uint64_t fit = std::min({most / (16 * cells), (free - fixed) / group, all});
  const std::uint64_t turns = (all + fit - 1) / fit;
  groups_ = static_cast<int>((all + turns - 1) / turns);
  const std::uint64_t kept = (turns - 1) * groups_ * kSolutionBytes * cells;
  keep_ = fixed + groups_ * group + kept <= free;
  return ok();
}

Result<void> DeviceObjective::allocate() {
  gpu::Context& context = recorder_.context();
  const double light = brightest(problem_);
  scale_ = mean_square(problem_);
  auto medium = DeviceMedium::create(context, problem_.block);
  if (!medium) return medium.error();
  medium_.push_back(*std::move(medium));
  if (!problem_.rays.empty()) {
    auto rays = DeviceCameraRays::create(context, problem_);
    if (!rays) return rays.error();
    camera_rays_ = *std::move(rays);
  }
  auto fields = DeviceFields::create(context, medium_[0].shapes(), groups_, Staging::kNone);
  if (!fields) return fields.error();
  fields_.push_back(*std::move(fields));
  const auto turn = static_cast<std::size_t>(groups_) * kLanes;
  for (std::size_t first = 0; first < problem_.illuminations.size(); first += turn) {
    if (auto added = add_turn(first, light); !added) return added;
    if (!keep_ && !solutions_.empty()) continue;
    if (auto added = add_solutions(); !added) return added;
  }
  if (auto made = allocate_work(); !made) return made;
  start_afresh();
  return ok();
}

Result<void> DeviceObjective::add_turn(std::size_t first, double light) {
  gpu::Context& context = recorder_.context();
  const std::size_t lit = problem_.block.face_cell_count(problem_.lit_face);
  const std::size_t seen = problem_.camera.size();
  const auto raster =
      [&](std::size_t cells, double factor, std::vector<double> ChannelIllumination::*values) {
        return send(context, lanes_of(problem_, first, groups_, cells, factor, values));
      };
  auto irradiance = raster(lit, 1.0 / light, &ChannelIllumination::irradiance);
  if (!irradiance) return irradiance.error();
  auto pictures = raster(seen, 1.0 / light, &ChannelIllumination::radiance);
  if (!pictures) return pictures.error();
  auto weights = raster(seen, light * light / scale_, &ChannelIllumination::weight);
  if (!weights) return weights.error();
  auto rims = gpu::Buffer::create(context, weights->bytes(), gpu::Memory::kDevice);
  if (!rims) return rims.error();
  const std::size_t left = problem_.illuminations.size() - first;
  turns_.push_back({std::min(static_cast<int>(left), groups_ * kLanes),
                    *std::move(irradiance),
                    *std::move(pictures),
                    *std::move(weights),
                    *std::move(rims)});
  return ok();
}

Result<void> DeviceObjective::add_solutions() {
  gpu::Context& context = recorder_.context();
  const std::size_t cells = problem_.block.cell_count();
  auto fluence = DeviceSolution::create(context, cells, groups_);
  if (!fluence) return fluence.error();
  auto adjoint = DeviceSolution::create(context, cells, groups_);
  if (!adjoint) return adjoint.error();
  solutions_.push_back({*std::move(fluence), *std::move(adjoint)});
  return ok();
}

Result<void> DeviceObjective::allocate_work() {
  gpu::Context& context = recorder_.context();
  const std::uint64_t cells = problem_.block.cell_count();
  const std::uint64_t lit = problem_.block.face_cell_count(problem_.lit_face);
  for (const std::uint64_t bytes : {16 * cells * groups_,
                                    16 * cells,
                                    16 * cells,
                                    8 * cells,
                                    8 * cells,
                                    4 * lit,
                                    4 * problem_.camera.size()}) {
    auto made = gpu::Buffer::create(context, bytes, gpu::Memory::kDevice);
    if (!made) return made.error();
    work_.push_back(*std::move(made));
  }
  Values gains;
  for (const diffusion::CameraEquation& c : problem_.camera) {
    gains.push_back(static_cast<float>(c.source_gain));
    gains.push_back(static_cast<float>(c.flux_gain));
  }
  auto camera = send(context, gains);
  if (!camera) return camera.error();
  work_.push_back(*std::move(camera));
  for (const Work which : {kRayGradient, kLitTerms, kSeenTerms}) recorder_.fill_zero(work_[which]);
  recorder_.barrier();
  return ok();
}

void DeviceObjective::start_afresh() {
  for (Solutions& s : solutions_) {
    s.fluence.clear(recorder_);
    s.adjoint.clear(recorder_);
  }
}

ModelPush DeviceObjective::push_for(Face face, std::int32_t flags) const {
  const Block& block = problem_.block;
  const auto h = block.spacing();
  const auto size = block.size();
  const double length = std::min({size.x, size.y, size.z});
  ModelPush push;
  std::ranges::copy(block.cells(), push.cells.begin());
  push.cells[3] = static_cast<std::int32_t>(block.cell_count());
  if (problem_.source.model == diffusion::SourceModel::kCollimated) flags |= kCollimated;
  if (problem_.source.deposit == diffusion::Deposit::kCentroid) flags |= kCentroid;
  if (face == problem_.lit_face) flags |= kLit;
  if (face == problem_.seen_face) flags |= kSeen;
  if (camera_rays_) flags |= kAlongRays;
  push.ratio[3] = flags;
  push.face = {
      static_cast<std::int32_t>(face), groups_, static_cast<std::int32_t>(problem_.seen_face), 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    push.size[axis] = static_cast<float>(h[axis]);
    push.smoothness[axis] = static_cast<float>(settings_.regularization * block.cell_volume() /
                                               (h[axis] * h[axis] * length * scale_));
  }
  const double whole = settings_.regularization * block.cell_volume() / (length * scale_);
  if (settings_.regularizer == Smoothness::kTotalVariation && whole > 0.0)
    push.smoothness[3] =
        static_cast<float>(length * length / (Regularizer::kEdge * Regularizer::kEdge * whole));
  push.size[3] = static_cast<float>(block.cell_volume());
  push.surface = {static_cast<float>(2.0 * problem_.boundary.a),
                  static_cast<float>(problem_.boundary.source_scale),
                  0.0F,
                  0.0F};
  return push;
}

void DeviceObjective::run(ModelKernel kernel,
                          std::initializer_list<const gpu::Buffer*> buffers,
                          const ModelPush& push,
                          std::uint32_t groups_x,
                          int groups_y) {
  recorder_.dispatch(model_[kernel],
                     buffers,
                     gpu::push_of(push),
                     {groups_x, static_cast<std::uint32_t>(groups_y), 1});
}

Result<void> DeviceObjective::solve(const Turn& turn,
                                    DeviceSolution& x,
                                    const std::stop_token& stop) {
  Cycle cycle(recorder_, kernels_, medium_[0].shapes(), medium_[0].levels(), fields_[0]);
  DevicePasses passes(recorder_, cycle, fields_[0], work_[kB], x, turn.count);
  const auto summary = diffusion::conjugate_gradient(
      passes, passes.b_norms(), {settings_.tolerance, kMaxIterations}, stop);
  if (recorder_.error()) return *recorder_.error();
  solves_ += turn.count;
  if (summary.termination == diffusion::Termination::kCancelled)
    return cancelled("diffusion solve on the device");
  if (!(summary.relative_residual < kUselessResidual))
    return internal_error(
        fmt::format("diffusion solve stopped at a relative residual of {:.1e}: {}",
                    summary.relative_residual,
                    summary.message));
  return ok();
}

void DeviceObjective::gather(const Turn& turn, const Solutions& s, std::int32_t first) {
  const gpu::Buffer& coefficients = medium_[0].coefficients();
  const std::uint32_t lit = workgroups(problem_.block.face_cell_count(problem_.lit_face));
  const ModelPush lit_push = push_for(problem_.lit_face, first);
  run(ModelKernel::kGather,
      {&s.fluence.high, &s.fluence.low, &s.adjoint.high, &s.adjoint.low, &work_[kCellProducts]},
      lit_push,
      workgroups(problem_.block.cell_count()));
  run(ModelKernel::kRimTerms,
      {&turn.irradiance, &turn.rims, &s.fluence.high, &s.adjoint.high, &work_[kLitTerms]},
      lit_push,
      lit);
  if (camera_rays_) {
    camera_rays_->gather(recorder_,
                         model_,
                         turn.irradiance,
                         turn.rims,
                         s.fluence,
                         push_for(problem_.seen_face, first));
  } else if (problem_.seen_face != problem_.lit_face) {
    run(ModelKernel::kRimTerms,
        {&turn.irradiance, &turn.rims, &s.fluence.high, &s.adjoint.high, &work_[kSeenTerms]},
        push_for(problem_.seen_face, first),
        workgroups(problem_.camera.size()));
  }
  if (problem_.source.model != diffusion::SourceModel::kCollimated) return;
  run(ModelKernel::kRayTerms,
      {&coefficients,
       &work_[kRayCells],
       &turn.irradiance,
       &turn.rims,
       &s.adjoint.high,
       &s.adjoint.low,
       &work_[kCamera],
       &work_[kRayGradient]},
      lit_push,
      lit);
}

void DeviceObjective::record_adjoint_source(const Turn& turn, const ModelPush& seen) {
  if (camera_rays_) {
    camera_rays_->source(recorder_, model_, turn.rims, work_[kB], seen);
    return;
  }
  recorder_.fill_zero(work_[kB]);
  recorder_.barrier();
  run(ModelKernel::kAdjointSource,
      {&medium_[0].coefficients(), &turn.rims, &work_[kB]},
      seen,
      workgroups(problem_.camera.size()),
      groups_);
}

Result<void> DeviceObjective::take_turn(
    Turn& turn, Solutions& s, std::int32_t first, const Sums& sums, const std::stop_token& stop) {
  const gpu::Buffer& coefficients = medium_[0].coefficients();
  const ModelPush lit = push_for(problem_.lit_face, first);
  const ModelPush seen = push_for(problem_.seen_face, first);
  run(ModelKernel::kDeposit,
      {&coefficients, &work_[kRayCells], &turn.irradiance, &work_[kB]},
      lit,
      workgroups(problem_.block.face_cell_count(problem_.lit_face)),
      groups_);
  if (auto solved = solve(turn, s.fluence, stop); !solved) return solved;
  if (camera_rays_)
    camera_rays_->look(recorder_, model_, turn.irradiance, s.fluence, turn.rims, seen);
  run(ModelKernel::kObserve,
      {&coefficients,
       &work_[kRayCells],
       &turn.irradiance,
       &s.fluence.high,
       &s.fluence.low,
       &work_[kCamera],
       &turn.pictures,
       &turn.weights,
       &turn.rims,
       &sums.partials()},
      seen,
      kSumGroups);
  record_adjoint_source(turn, seen);
  if (auto solved = solve(turn, s.adjoint, stop); !solved) return solved.error().in("adjoint");
  gather(turn, s, first);
  return ok();
}

Result<void> DeviceObjective::evaluate(const gpu::Buffer& p,
                                       const gpu::Buffer& gradient,
                                       const Sums& sums,
                                       const std::stop_token& stop) {
  const ModelPush push = push_for(problem_.lit_face, 0);
  medium_[0].build(recorder_, model_, p, push);
  const gpu::Buffer& coefficients = medium_[0].coefficients();
  run(ModelKernel::kRays,
      {&coefficients, &work_[kRayCells]},
      push,
      workgroups(problem_.block.face_cell_count(problem_.lit_face)));
  const ModelPush seen = push_for(problem_.seen_face, 0);
  if (camera_rays_) camera_rays_->trace(recorder_, model_, coefficients, seen);
  for (std::size_t t = 0; t < turns_.size(); ++t) {
    Solutions& solutions = solutions_[keep_ ? t : 0];
    if (!keep_) {
      solutions.fluence.clear(recorder_);
      solutions.adjoint.clear(recorder_);
    }
    auto done = take_turn(turns_[t], solutions, t == 0 ? kFirst : 0, sums, stop);
    if (!done) return done;
  }
  if (camera_rays_)
    camera_rays_->add_gradient(recorder_, model_, coefficients, work_[kRayGradient], seen);
  run(ModelKernel::kEdges,
      {&p, &coefficients, &work_[kEdgeWeights], &sums.partials()},
      push,
      kSumGroups);
  run(ModelKernel::kGradient,
      {&p,
       &coefficients,
       &work_[kCellProducts],
       &work_[kRayGradient],
       &work_[kLitTerms],
       &work_[kSeenTerms],
       &work_[kEdgeWeights],
       &gradient},
      push,
      workgroups(problem_.block.cell_count()));
  return recorder_.error() ? Result<void>(*recorder_.error()) : ok();
}

}  // namespace opaline::reconstruct::vulkan
