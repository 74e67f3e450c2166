#include "reconstruct/back_end.h"

#include "base/log.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/fallback_solver.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/vulkan/vulkan_solver.h"

namespace opaline::reconstruct {
namespace {

using Solver = Result<std::unique_ptr<diffusion::FluenceSolver>>;

Solver make_host(int threads) {
  const host::HostOptions host{.threads = threads};
  if (auto valid = host::validate(host); !valid) return valid.error();
  return host::make_host_solver(host);
}

Solver make_vulkan(const InverseOptions& options, const gpu::ContextOptions& gpu) {
  const auto host = [threads = options.threads] { return make_host(threads); };
  auto solver = vulkan::make_vulkan_solver({gpu});
  const bool may_change = options.back_end == BackEnd::kAuto || options.back_end_fallback;
  if (!may_change) return solver;
  if (solver) return make_fallback_solver(*std::move(solver), host);
  if (!is_device_failure(solver.error())) return solver;
  log::warning("{}; going on with host", solver.error().message);
  return host();
}

}  // namespace

Solver make_solver(const InverseOptions& options, const gpu::ContextOptions& gpu) {
  switch (options.back_end) {
    case BackEnd::kReference:
      return diffusion::make_reference_solver();
    case BackEnd::kVulkan:
      return make_vulkan(options, gpu);
    case BackEnd::kHost:
      return make_host(options.threads);
    case BackEnd::kAuto:
      break;
  }
  if (!vulkan::real_gpu_available()) return make_host(options.threads);
  gpu::ContextOptions real = gpu;
  real.device.allow_software = false;
  return make_vulkan(options, real);
}

}  // namespace opaline::reconstruct
