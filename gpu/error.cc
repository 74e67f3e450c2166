#include "gpu/error.h"

#include <fmt/format.h>

namespace opaline::gpu {

Error error_from(VkResult result, std::string_view what) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST:
      return unavailable(fmt::format(
          "{}: the GPU was lost (reset, unplugged, or its driver failed); run again", what));
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return unavailable(fmt::format(
          "{}: out of GPU memory; close what else uses the GPU or make the problem smaller", what));
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return unavailable(fmt::format("{}: the driver is out of host memory", what));
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return unavailable(fmt::format(
          "{}: no Vulkan driver found; install one (mesa-vulkan-drivers has a software one)",
          what));
    case VK_ERROR_LAYER_NOT_PRESENT:
      return unavailable(fmt::format(
          "{}: a Vulkan layer is missing; install vulkan-validationlayers or switch validation off",
          what));
    case VK_ERROR_EXTENSION_NOT_PRESENT:
    case VK_ERROR_FEATURE_NOT_PRESENT:
    case VK_ERROR_FORMAT_NOT_SUPPORTED:
      return unavailable(
          fmt::format("{}: the GPU's driver lacks what is asked for; update it", what));
    case VK_TIMEOUT:
      return timeout(fmt::format("{}: the GPU did not finish in time", what));
    default:
      return internal_error(fmt::format("{}: VkResult {}", what, static_cast<int>(result)));
  }
}

}  // namespace opaline::gpu
