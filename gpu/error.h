#pragma once

#include <vulkan/vulkan_core.h>

#include <string_view>

#include "base/result.h"

namespace opaline::gpu {

/// The one place where a VkResult becomes an Error: what happened during `what`, and what can be
/// done about it.
///   lost device, out of memory, missing driver or feature -> kUnavailable;  VK_TIMEOUT ->
///   kTimeout;  else kInternal
Error error_from(VkResult result, std::string_view what);

}  // namespace opaline::gpu
