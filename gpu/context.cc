#include "gpu/context.h"

#include <fmt/format.h>

#include <cstdlib>
#include <mutex>

#include "gpu/instance.h"

namespace opaline::gpu {
namespace {

/// Mesa's lavapipe initialises LLVM with the first device and is not safe to do so from two threads
/// at once.
std::mutex& creation_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::vector<DeviceCandidate> candidates_of(const std::vector<PhysicalDevice>& devices) {
  std::vector<DeviceCandidate> candidates;
  candidates.reserve(devices.size());
  for (const PhysicalDevice& device : devices) candidates.push_back(device.candidate);
  return candidates;
}

Result<void> open(Context::Handles& handles) {
  if (auto made = create_instance(handles); !made) return made.error();
  auto devices = enumerate_devices(handles.instance);
  if (!devices) return devices.error();
  const auto chosen = choose_device(candidates_of(*devices), handles.options.device);
  if (!chosen) return chosen.error();
  return create_device(handles, std::move((*devices)[*chosen]));
}

}  // namespace

bool ContextOptions::validation_from_environment() {
  const char* set = std::getenv("OPALINE_VULKAN_VALIDATION");
  const std::string_view value = set != nullptr ? set : "";
  return !value.empty() && value != "0";
}

Context::Context() = default;

Context::~Context() {
  if (!handles_) return;
  release_if_busy(*handles_, handles_->timeline, handles_->queue, handles_->device);
}

Result<std::unique_ptr<Context>> Context::create(const ContextOptions& options) {
  const std::lock_guard lock(creation_mutex());
  std::unique_ptr<Context> context(new Context);
  auto handles = guarded("loading Vulkan", [] { return std::make_unique<Handles>(); });
  if (!handles) return handles.error();
  context->handles_ = *std::move(handles);
  context->handles_->options = options;
  if (auto opened = open(*context->handles_); !opened) return opened.error();
  return context;
}

const DeviceInfo& Context::device() const { return handles_->info; }

const Traffic& Context::traffic() const { return handles_->traffic; }

std::uint64_t Context::memory_left() const {
  return handles_->info.memory_bytes - handles_->allocated_bytes;
}

Result<void> Context::run(const Commands& commands) {
  const auto point = submit(commands);
  if (!point) return point.error();
  return wait(*point, handles_->options.deadline);
}

Result<std::uint64_t> Context::submit(const Commands& commands) {
  Handles& h = *handles_;
  if (h.lost) return unavailable(fmt::format("{} was lost earlier", h.info.name));
  auto sent = guarded("submitting work to the GPU", [&] {
    const vk::CommandBufferSubmitInfo buffer(*commands.handles().commands);
    const vk::SemaphoreSubmitInfo signal(
        *h.timeline, h.submitted + 1, vk::PipelineStageFlagBits2::eAllCommands);
    const auto lost_at = static_cast<std::uint64_t>(h.options.rehearsal.lost_at_submission);
    if (++h.traffic.submissions == lost_at) throw vk::DeviceLostError("");
    h.queue.submit2(vk::SubmitInfo2({}, {}, buffer, signal));
  });
  if (!sent) {
    h.lost = true;
    return sent.error();
  }
  return ++h.submitted;
}

Result<void> Context::wait(std::uint64_t point, std::chrono::nanoseconds deadline) {
  Handles& h = *handles_;
  const auto result = guarded("waiting for the GPU", [&] {
    const vk::SemaphoreWaitInfo info({}, *h.timeline, point);
    return h.device.waitSemaphores(info, static_cast<std::uint64_t>(deadline.count()));
  });
  if (result && *result == vk::Result::eSuccess) return ok();
  h.lost = true;
  if (!result) return result.error();
  return timeout(
      fmt::format("{} did not finish within {} ms; it may hang, or the work is too large for it",
                  h.info.name,
                  std::chrono::duration_cast<std::chrono::milliseconds>(deadline).count()));
}

bool Context::Handles::busy() const {
  const auto value = guarded("asking the GPU", [&] { return timeline.getCounterValue(); });
  return value && *value < submitted;
}

Result<std::uint32_t> Context::Handles::memory_type(std::uint32_t allowed,
                                                    vk::MemoryPropertyFlags needed,
                                                    vk::MemoryPropertyFlags liked) const {
  if (const auto type = memory_type_of(memory, allowed, needed, liked)) return *type;
  return unavailable(fmt::format("{} has no memory of the kind needed", info.name));
}

Result<std::vector<DeviceReport>> list_devices(const DeviceWish& wish) {
  const std::lock_guard lock(creation_mutex());
  auto handles = guarded("loading Vulkan", [] { return std::make_unique<Context::Handles>(); });
  if (!handles) return handles.error();
  if (auto made = create_instance(**handles); !made) return made.error();
  const auto devices = enumerate_devices((*handles)->instance);
  if (!devices) return devices.error();
  std::vector<DeviceReport> reports;
  for (const PhysicalDevice& device : *devices)
    reports.push_back({device.candidate.info, refusal(device.candidate, wish)});
  return reports;
}

}  // namespace opaline::gpu
