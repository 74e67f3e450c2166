#include "reconstruct/back_end.h"

#include "base/log.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/fallback_solver.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/vulkan/vulkan_solver.h"

namespace opaline::reconstruct {
namespace {

using Solver = Result<std::unique_ptr<diffusion::FluenceSolver>>;

Solver make_host(int threads, diffusion::Precision precision) {
  const host::HostOptions host{threads, precision};
  if (auto valid = host::validate(host); !valid) return valid.error();
  return host::make_host_solver(host);
}

Result<BackEndParts> with(Solver solver) {
  if (!solver) return solver.error();
  return BackEndParts{*std::move(solver), nullptr};
}

Result<BackEndParts> make_vulkan(const InverseOptions& options, const gpu::ContextOptions& gpu) {
  const auto host = [threads = options.threads, precision = options.precision] {
    return make_host(threads, precision);
  };
  auto made = vulkan::make_vulkan_back_end({gpu});
  const bool may_change = options.back_end == BackEnd::kAuto || options.back_end_fallback;
  if (made && may_change)
    return BackEndParts{make_fallback_solver(std::move(made->solver), host), made->engine};
  if (made) return BackEndParts{std::move(made->solver), made->engine};
  if (!may_change || !is_device_failure(made.error())) return made.error();
  log::warning("{}; going on with host", made.error().message);
  return with(host());
}

}  // namespace

Result<BackEndParts> make_back_end(const InverseOptions& options, const gpu::ContextOptions& gpu) {
  switch (options.back_end) {
    case BackEnd::kReference:
      return with(diffusion::make_reference_solver());
    case BackEnd::kVulkan:
      return make_vulkan(options, gpu);
    case BackEnd::kHost:
      return with(make_host(options.threads, options.precision));
    case BackEnd::kAuto:
      break;
  }
  const bool single = options.precision == diffusion::Precision::kSingle;
  if (!single || !vulkan::real_gpu_available())
    return with(make_host(options.threads, options.precision));
  gpu::ContextOptions real = gpu;
  real.device.allow_software = false;
  return make_vulkan(options, real);
}

Result<std::unique_ptr<diffusion::FluenceSolver>> make_solver(const InverseOptions& options,
                                                              const gpu::ContextOptions& gpu) {
  auto made = make_back_end(options, gpu);
  if (!made) return made.error();
  return std::move(made->solver);
}

}  // namespace opaline::reconstruct
