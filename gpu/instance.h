#pragma once

#include "gpu/handles.h"

namespace opaline::gpu {

/// Makes loader, instance and, where asked for, the validation layer with its messenger.
Result<void> create_instance(Context::Handles& handles);

/// What we ask of every device: Vulkan 1.3's dynamic rendering and synchronisation, 1.2's timeline
/// semaphores, and VK_KHR_push_descriptor.
struct PhysicalDevice {
  vk::raii::PhysicalDevice handle = nullptr;
  DeviceCandidate candidate;
};
Result<std::vector<PhysicalDevice>> enumerate_devices(const vk::raii::Instance& instance);

/// The first queue family that computes and, where asked for, draws.
std::uint32_t queue_family(const vk::raii::PhysicalDevice& device, bool graphics);

/// Makes device, queue and timeline on a device that choose_device() accepted.
Result<void> create_device(Context::Handles& handles, PhysicalDevice chosen);

}  // namespace opaline::gpu
