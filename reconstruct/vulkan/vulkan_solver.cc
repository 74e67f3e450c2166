#include "reconstruct/vulkan/vulkan_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/medium_check.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/vulkan/vulkan_minimiser.h"
#include "reconstruct/vulkan/vulkan_passes.h"

namespace opaline::reconstruct::vulkan {
namespace {

using diffusion::FieldBatch;
using diffusion::Level;
using diffusion::Medium;
using diffusion::SolveOptions;
using diffusion::SolveSummary;
using diffusion::Termination;

/// The worse of two turns' outcomes: what a caller should know of both.
SolveSummary worse(const SolveSummary& a, const SolveSummary& b) {
  SolveSummary both = a.relative_residual >= b.relative_residual ? a : b;
  both.iterations = std::max(a.iterations, b.iterations);
  return both;
}

class VulkanSolver final : public diffusion::FluenceSolver, public InversionEngine {
 public:
  VulkanSolver(std::unique_ptr<gpu::Context> context, Kernels kernels, gpu::Commands commands)
      : context_(std::move(context)),
        kernels_(std::move(kernels)),
        commands_(std::move(commands)) {}

  Result<void> prepare(const Medium& medium) override;
  Result<SolveSummary> solve(const FieldBatch& b,
                             FieldBatch& phi,
                             const SolveOptions& options,
                             std::stop_token stop) override;
  Result<std::unique_ptr<Minimiser>> begin(const ChannelProblem& problem,
                                           const InverseOptions& options,
                                           const LbfgsState& from) override;
  std::string description() const override {
    return "vulkan, " + context_->device().name + ", float32";
  }

 private:
  Result<void> fit(int count);
  Result<SolveSummary> solve_turn(const FieldBatch& b,
                                  FieldBatch& phi,
                                  int first,
                                  std::span<const double> norms,
                                  const SolveOptions& options,
                                  const std::stop_token& stop);

  std::unique_ptr<gpu::Context> context_;  // first: destroyed last
  Kernels kernels_;
  gpu::Commands commands_;
  Block block_;
  std::vector<Level> levels_;
  std::vector<DeviceLevel> coefficients_;
  std::optional<DeviceFields> fields_;
  std::optional<ModelKernels> model_;  // compiled with the first minimisation
};

Result<void> VulkanSolver::prepare(const Medium& medium) {
  if (Result<void> good = diffusion::validate(medium); !good) return good;
  if (!(medium.block == block_)) fields_.reset();
  levels_.clear();
  coefficients_.clear();
  if (groups_that_fit(context_->device(), medium.block.cell_count()) == 0)
    return with_remedy(unavailable(fmt::format(
        "{} cells are too many for {}", medium.block.cell_count(), context_->device().name)));
  std::vector<Level> levels = diffusion::build_levels(medium);
  for (const Level& level : levels) {
    auto sent = DeviceLevel::create(*context_, level);
    if (!sent) return with_remedy(sent.error());
    coefficients_.push_back(*std::move(sent));
  }
  block_ = medium.block;
  levels_ = std::move(levels);
  return ok();
}

/// Makes the fields for as many of `count` right-hand sides as the device takes at once.
Result<void> VulkanSolver::fit(int count) {
  const int wanted = (count + kLanes - 1) / kLanes;
  const int groups = std::min(wanted, groups_that_fit(context_->device(), block_.cell_count()));
  if (fields_ && fields_->groups == groups) return ok();
  fields_.reset();
  auto made = DeviceFields::create(*context_, levels_, groups, Staging::kField);
  if (!made) return with_remedy(made.error());
  fields_ = *std::move(made);
  return ok();
}

Result<SolveSummary> VulkanSolver::solve_turn(const FieldBatch& b,
                                              FieldBatch& phi,
                                              int first,
                                              std::span<const double> norms,
                                              const SolveOptions& options,
                                              const std::stop_token& stop) {
  VulkanPasses passes({*context_, kernels_, levels_, coefficients_, *fields_, commands_},
                      b,
                      phi,
                      first,
                      static_cast<int>(norms.size()));
  SolveSummary summary = diffusion::conjugate_gradient(passes, norms, options, stop);
  if (passes.error()) return with_remedy(*passes.error());
  if (summary.termination == Termination::kCancelled) return cancelled(summary.message);
  return summary;
}

Result<SolveSummary> VulkanSolver::solve(const FieldBatch& b,
                                         FieldBatch& phi,
                                         const SolveOptions& options,
                                         std::stop_token stop) {
  if (levels_.empty()) return invalid_argument("solve before a successful prepare");
  if (Result<void> good = diffusion::validate(options); !good) return good.error();
  if (Result<void> good = diffusion::check_fields(block_, b, phi); !good) return good.error();
  const std::vector<double> norms = diffusion::norms_and_trivial(b, phi);
  if (norms.empty()) return diffusion::summarise(Termination::kConverged, 0, 0.0);
  if (auto made = fit(b.count); !made) return made.error();
  std::optional<SolveSummary> all;
  const int turn = fields_->groups * kLanes;
  for (int first = 0; first < b.count; first += turn) {
    const auto part = std::span(norms).subspan(first, std::min(turn, b.count - first));
    const auto summary = solve_turn(b, phi, first, part, options, stop);
    if (!summary) return summary.error();
    all = all ? worse(*all, *summary) : *summary;
  }
  return *all;
}

/// The minimisation takes the device to itself: a solve needs another prepare().
Result<std::unique_ptr<Minimiser>> VulkanSolver::begin(const ChannelProblem& problem,
                                                       const InverseOptions& options,
                                                       const LbfgsState& from) {
  if (options.method != Method::kLbfgs) return std::unique_ptr<Minimiser>();
  fields_.reset();
  levels_.clear();
  coefficients_.clear();
  if (!model_) {
    auto compiled = ModelKernels::create(*context_);
    if (!compiled) return with_remedy(compiled.error());
    model_ = *std::move(compiled);
  }
  auto made =
      VulkanMinimiser::create(*context_, commands_, kernels_, *model_, problem, options, from);
  if (!made) return with_remedy(made.error());
  return std::unique_ptr<Minimiser>(*std::move(made));
}

}  // namespace

Result<VulkanBackEnd> make_vulkan_back_end(const VulkanOptions& options) {
  auto context = gpu::Context::create(options.gpu);
  if (!context) return with_remedy(context.error());
  auto kernels = Kernels::create(**context);
  if (!kernels) return with_remedy(kernels.error());
  auto commands = gpu::Commands::create(**context);
  if (!commands) return with_remedy(commands.error());
  auto solver = std::make_unique<VulkanSolver>(
      *std::move(context), *std::move(kernels), *std::move(commands));
  InversionEngine* engine = solver.get();
  return VulkanBackEnd{std::move(solver), engine};
}

Result<std::unique_ptr<diffusion::FluenceSolver>> make_vulkan_solver(const VulkanOptions& options) {
  auto made = make_vulkan_back_end(options);
  if (!made) return made.error();
  return std::move(made->solver);
}

bool real_gpu_available() {
  gpu::DeviceWish wish;
  wish.allow_software = false;
  const auto devices = gpu::list_devices(wish);
  return devices && std::ranges::any_of(*devices, [](const auto& d) { return d.refusal.empty(); });
}

}  // namespace opaline::reconstruct::vulkan
