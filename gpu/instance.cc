#include "gpu/instance.h"

#include <fmt/format.h>

#include <array>

namespace opaline::gpu {
namespace {

DeviceKind kind_of(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return DeviceKind::kDiscrete;
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return DeviceKind::kIntegrated;
    case vk::PhysicalDeviceType::eVirtualGpu:
      return DeviceKind::kVirtual;
    case vk::PhysicalDeviceType::eCpu:
      return DeviceKind::kSoftware;
    default:
      return DeviceKind::kOther;
  }
}

std::uint64_t largest_local_heap(const vk::PhysicalDeviceMemoryProperties& memory) {
  std::uint64_t largest = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
    if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
      largest = std::max<std::uint64_t>(largest, memory.memoryHeaps[i].size);
  return largest;
}

DeviceInfo info_of(const vk::raii::PhysicalDevice& device) {
  const auto chain = device.getProperties2<vk::PhysicalDeviceProperties2,
                                           vk::PhysicalDeviceVulkan11Properties,
                                           vk::PhysicalDeviceVulkan12Properties>();
  const auto& p = chain.get<vk::PhysicalDeviceProperties2>().properties;
  const auto& driver = chain.get<vk::PhysicalDeviceVulkan12Properties>();
  DeviceInfo info;
  info.name = p.deviceName.data();
  info.driver = fmt::format("{}, {}", driver.driverName.data(), driver.driverInfo.data());
  info.kind = kind_of(p.deviceType);
  info.api_version = p.apiVersion;
  info.max_binding_bytes = p.limits.maxStorageBufferRange;
  info.max_allocation_bytes =
      chain.get<vk::PhysicalDeviceVulkan11Properties>().maxMemoryAllocationSize;
  info.memory_bytes = largest_local_heap(device.getMemoryProperties());
  info.max_image_side = std::min(p.limits.maxImageDimension2D, p.limits.maxFramebufferWidth);
  info.max_groups_x = p.limits.maxComputeWorkGroupCount[0];
  return info;
}

std::vector<std::string> missing_of(const vk::raii::PhysicalDevice& device) {
  std::vector<std::string> missing;
  const auto chain = device.getFeatures2<vk::PhysicalDeviceFeatures2,
                                         vk::PhysicalDeviceVulkan12Features,
                                         vk::PhysicalDeviceVulkan13Features>();
  const auto& v12 = chain.get<vk::PhysicalDeviceVulkan12Features>();
  const auto& v13 = chain.get<vk::PhysicalDeviceVulkan13Features>();
  if (!v12.timelineSemaphore) missing.emplace_back("timeline semaphores");
  if (!v13.dynamicRendering) missing.emplace_back("dynamic rendering");
  if (!v13.synchronization2) missing.emplace_back("synchronization2");
  bool push = false;
  for (const auto& extension : device.enumerateDeviceExtensionProperties())
    push |=
        std::string_view(extension.extensionName.data()) == VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME;
  if (!push) missing.emplace_back(VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
  return missing;
}

DeviceCandidate candidate_of(const vk::raii::PhysicalDevice& device) {
  DeviceCandidate candidate{info_of(device), false, false, {}};
  for (const auto& family : device.getQueueFamilyProperties()) {
    const bool compute{family.queueFlags & vk::QueueFlagBits::eCompute};
    candidate.compute_queue |= compute;
    candidate.graphics_queue |= compute && (family.queueFlags & vk::QueueFlagBits::eGraphics);
  }
  if (candidate.info.api_version >= VK_API_VERSION_1_3) candidate.missing = missing_of(device);
  return candidate;
}

}  // namespace

Result<void> create_instance(Context::Handles& handles) {
  return guarded("starting Vulkan", [&] {
    const vk::ApplicationInfo application("opaline", 1, nullptr, 0, VK_API_VERSION_1_3);
    vk::InstanceCreateInfo info({}, &application);
    static constexpr std::array layers{kValidationLayer};
    static constexpr std::array extensions{VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                           VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    static constexpr vk::ValidationFeatureEnableEXT kBarriers =
        vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
    using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
    const auto messenger = messenger_info(handles.options.on_validation_message,
                                          Type::eValidation | Type::ePerformance);
    const vk::ValidationFeaturesEXT features(kBarriers, {}, &messenger);
    if (handles.options.validation) {
      info.setPEnabledLayerNames(layers).setPEnabledExtensionNames(extensions).setPNext(&features);
    }
    handles.instance = vk::raii::Instance(handles.loader, info);
    if (handles.options.validation)
      handles.messenger = vk::raii::DebugUtilsMessengerEXT(handles.instance, messenger);
  });
}

Result<std::vector<PhysicalDevice>> enumerate_devices(const vk::raii::Instance& instance) {
  return guarded("looking for Vulkan devices", [&] {
    std::vector<PhysicalDevice> devices;
    for (vk::raii::PhysicalDevice& device : vk::raii::PhysicalDevices(instance)) {
      DeviceCandidate candidate = candidate_of(device);
      devices.push_back({std::move(device), std::move(candidate)});
    }
    return devices;
  });
}

std::uint32_t queue_family(const vk::raii::PhysicalDevice& device, bool graphics) {
  vk::QueueFlags wanted = vk::QueueFlagBits::eCompute;
  if (graphics) wanted |= vk::QueueFlagBits::eGraphics;
  const auto families = device.getQueueFamilyProperties();
  std::uint32_t i = 0;
  while (i < families.size() && (families[i].queueFlags & wanted) != wanted) ++i;
  ENSURE(i < families.size());  // choose_device() saw one
  return i;
}

Result<void> create_device(Context::Handles& handles, PhysicalDevice chosen) {
  handles.physical = std::move(chosen.handle);
  handles.info = std::move(chosen.candidate.info);
  const Rehearsal& smaller = handles.options.rehearsal;
  if (smaller.max_binding_bytes > 0) handles.info.max_binding_bytes = smaller.max_binding_bytes;
  if (smaller.memory_bytes > 0) handles.info.memory_bytes = smaller.memory_bytes;
  handles.memory = handles.physical.getMemoryProperties();
  handles.queue_family = queue_family(handles.physical, handles.options.device.graphics);
  return guarded(fmt::format("opening {}", handles.info.name), [&] {
    const float priority = 1.0F;
    const vk::DeviceQueueCreateInfo queue({}, handles.queue_family, 1, &priority);
    static constexpr std::array extensions{VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME};
    vk::PhysicalDeviceVulkan12Features v12;
    v12.timelineSemaphore = VK_TRUE;
    vk::PhysicalDeviceVulkan13Features v13;
    v13.setDynamicRendering(VK_TRUE).setSynchronization2(VK_TRUE).setPNext(&v12);
    const vk::DeviceCreateInfo info({}, queue, {}, extensions, nullptr, &v13);
    handles.device = vk::raii::Device(handles.physical, info);
    handles.queue = vk::raii::Queue(handles.device, handles.queue_family, 0);
    const vk::SemaphoreTypeCreateInfo timeline(vk::SemaphoreType::eTimeline, 0);
    handles.timeline = vk::raii::Semaphore(handles.device, vk::SemaphoreCreateInfo({}, &timeline));
  });
}

}  // namespace opaline::gpu
