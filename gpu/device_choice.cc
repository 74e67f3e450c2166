#include "gpu/device_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <vulkan/vulkan_core.h>

#include <optional>
#include <tuple>

namespace opaline::gpu {
namespace {

bool better(const DeviceInfo& a, const DeviceInfo& b) {
  return std::tuple(a.kind, ~a.memory_bytes) < std::tuple(b.kind, ~b.memory_bytes);
}

Error nothing_fits(std::span<const DeviceCandidate> candidates, const DeviceWish& wish) {
  if (candidates.empty()) return unavailable("no Vulkan device on this machine");
  std::vector<std::string> reasons;
  for (const DeviceCandidate& c : candidates)
    reasons.push_back(fmt::format("{}: {}", c.info.name, refusal(c, wish)));
  return unavailable(fmt::format("no Vulkan device will do; {}", fmt::join(reasons, "; ")));
}

}  // namespace

std::string refusal(const DeviceCandidate& candidate, const DeviceWish& wish) {
  const DeviceInfo& info = candidate.info;
  if (info.name.find(wish.name) == std::string::npos)
    return fmt::format("its name does not contain \"{}\"", wish.name);
  if (info.kind == DeviceKind::kSoftware && !wish.allow_software)
    return "it is a software device, which was not asked for";
  if (info.api_version < VK_API_VERSION_1_3)
    return fmt::format("it speaks Vulkan {}.{}, 1.3 is needed",
                       VK_API_VERSION_MAJOR(info.api_version),
                       VK_API_VERSION_MINOR(info.api_version));
  if (!candidate.compute_queue) return "it has no compute queue";
  if (wish.graphics && !candidate.graphics_queue) return "it cannot draw";
  if (!candidate.missing.empty())
    return fmt::format("it lacks {}", fmt::join(candidate.missing, ", "));
  return {};
}

Result<std::size_t> choose_device(std::span<const DeviceCandidate> candidates,
                                  const DeviceWish& wish) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!refusal(candidates[i], wish).empty()) continue;
    if (!best || better(candidates[i].info, candidates[*best].info)) best = i;
  }
  if (!best) return nothing_fits(candidates, wish);
  return *best;
}

}  // namespace opaline::gpu
