#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "gpu/device_choice.h"

namespace opaline::gpu {

class Commands;

/// A device treated as smaller than it is, and made to fail on cue: for tests of what happens then.
struct Rehearsal {
  std::uint64_t max_binding_bytes = 0;  ///< 0: the device's own
  std::uint64_t memory_bytes = 0;       ///< 0: the device's own
  int lost_at_submission = 0;  ///< the device is lost at the n-th, counted from 1; 0: never
  int full_at_allocation = 0;  ///< its memory is full at the n-th; 0: never
};

struct ContextOptions {
  DeviceWish device;
  /// Khronos' validation layer, synchronisation (missing barriers) included; slow, finds real errors.
  bool validation = validation_from_environment();
  std::chrono::milliseconds deadline{30'000};  ///< for the work of one submission; > 0
  /// Hears every warning and error of the validation layer, from any thread, also while the context
  /// is destroyed; nobody there: they go to the log.
  std::function<void(std::string_view)> on_validation_message;
  Rehearsal rehearsal;

  /// True when OPALINE_VULKAN_VALIDATION is set to anything but 0.
  static bool validation_from_environment();
};

/// What went to and from a device so far, by upload() and download().
struct Traffic {
  std::uint64_t uploaded_bytes = 0;
  std::uint64_t downloaded_bytes = 0;
  std::uint64_t submissions = 0;  ///< of commands, those for the copies included
};

/// A Vulkan device with one queue and the timeline of what was submitted to it.
///
///   created -> (submit, wait)* -> destroyed
///                   | device lost, or a deadline passed
///                   v
///                 lost: every further call answers kUnavailable; make a new context
///
/// Threads: one at a time per context and everything made from it; separate contexts are
/// independent.
class Context {
 public:
  /// Errors: kUnavailable without a driver, a layer or a device that will do (with the reason for
  /// each).
  static Result<std::unique_ptr<Context>> create(const ContextOptions& options);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& device() const;
  /// What is left of the device's memory, as far as this context's own buffers are concerned.
  std::uint64_t memory_left() const;
  const Traffic& traffic() const;

  /// Sends recorded commands to the device and waits for them until the options' deadline.
  /// Work that was submitted cannot be recalled: submit little at a time and look at a stop token
  /// between. Errors: kTimeout, kUnavailable when the device is lost.
  Result<void> run(const Commands& commands);
  /// The two halves of run(). submit() answers the point on the timeline that marks the end of the
  /// commands, which must be neither recorded again nor destroyed before wait() has seen it pass.
  Result<std::uint64_t> submit(const Commands& commands);
  Result<void> wait(std::uint64_t point, std::chrono::nanoseconds deadline);

  /// Vulkan's own handles, for the files of gpu/ (gpu/handles.h).
  struct Handles;
  Handles& handles() { return *handles_; }

 private:
  Context();
  std::unique_ptr<Handles> handles_;
};

/// Every device of this machine, with the reason why it does not serve `wish` (empty: it does).
struct DeviceReport {
  DeviceInfo info;
  std::string refusal;
};
Result<std::vector<DeviceReport>> list_devices(const DeviceWish& wish);

}  // namespace opaline::gpu
