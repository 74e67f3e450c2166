#include "reconstruct/back_end.h"

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/vulkan/vulkan_solver.h"

namespace opaline::reconstruct {
namespace {

Result<std::unique_ptr<diffusion::FluenceSolver>> make_host(const InverseOptions& options) {
  const host::HostOptions host{.threads = options.threads};
  if (auto valid = host::validate(host); !valid) return valid.error();
  return host::make_host_solver(host);
}

}  // namespace

Result<std::unique_ptr<diffusion::FluenceSolver>> make_solver(const InverseOptions& options) {
  switch (options.back_end) {
    case BackEnd::kReference:
      return diffusion::make_reference_solver();
    case BackEnd::kVulkan:
      return vulkan::make_vulkan_solver({});
    case BackEnd::kHost:
      return make_host(options);
    case BackEnd::kAuto:
      break;
  }
  if (vulkan::real_gpu_available()) {
    if (auto solver = vulkan::make_vulkan_solver({})) return solver;
  }
  return make_host(options);
}

}  // namespace opaline::reconstruct
