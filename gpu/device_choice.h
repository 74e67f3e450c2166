#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::gpu {

enum class DeviceKind : std::uint8_t { kDiscrete, kIntegrated, kVirtual, kSoftware, kOther };

/// What a Vulkan device is and may do, as far as our programs ask.
struct DeviceInfo {
  std::string name;    ///< "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string driver;  ///< "llvmpipe, Mesa 22.3.6 (LLVM 15.0.6)"
  DeviceKind kind = DeviceKind::kOther;
  std::uint32_t api_version = 0;  ///< as VK_MAKE_API_VERSION packs it
  std::uint64_t max_binding_bytes =
      0;  ///< maxStorageBufferRange: the most one shader binding can see
  std::uint64_t max_allocation_bytes = 0;  ///< the most one buffer can hold
  std::uint64_t memory_bytes = 0;          ///< of the largest device-local heap
  std::uint32_t max_image_side = 0;        ///< pixels
  std::uint32_t max_groups_x = 0;          ///< workgroups of a dispatch, along x
};

/// What a program needs of a device.
struct DeviceWish {
  std::string name{};          ///< part of the device's name; empty: any
  bool allow_software = true;  ///< a CPU implementation such as Mesa's lavapipe will do
  bool graphics = false;       ///< draws triangles, not only compute
};

/// One device of this machine, and why it cannot be used (empty: it can).
struct DeviceCandidate {
  DeviceInfo info;
  bool graphics_queue = false;
  bool compute_queue = false;
  std::vector<std::string> missing;  ///< features and extensions that we need and it lacks
};

/// Why a device cannot serve; empty when it can.
std::string refusal(const DeviceCandidate& candidate, const DeviceWish& wish);

/// The index of the best device that is not refused: discrete before integrated before virtual
/// before software, then by memory. Errors: kUnavailable, with every device and the reason it was
/// refused.
Result<std::size_t> choose_device(std::span<const DeviceCandidate> candidates,
                                  const DeviceWish& wish);

}  // namespace opaline::gpu
