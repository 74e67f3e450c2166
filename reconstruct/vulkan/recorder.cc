#include "reconstruct/vulkan/recorder.h"

namespace opaline::reconstruct::vulkan {

void Recorder::fail(const Error& error) {
  if (!error_) error_ = error;
}

bool Recorder::start() {
  if (error_) return false;
  if (recording_) return true;
  if (auto begun = commands_.begin(); !begun)
    fail(begun.error());
  else
    recording_ = true;
  return recording_;
}

void Recorder::dispatch(const gpu::Pipeline& kernel,
                        std::initializer_list<const gpu::Buffer*> buffers,
                        std::span<const std::byte> push,
                        std::array<std::uint32_t, 3> groups) {
  if (!start()) return;
  commands_.dispatch(kernel, {std::span(buffers.begin(), buffers.size()), push}, groups);
  commands_.barrier();
}

void Recorder::copy(const gpu::Buffer& from, gpu::Buffer& to) {
  if (start()) commands_.copy(from, to, from.bytes());
}

void Recorder::fill_zero(gpu::Buffer& buffer) {
  if (start()) commands_.fill_zero(buffer);
}

void Recorder::barrier() {
  if (start()) commands_.barrier();
}

void Recorder::finish() {
  if (!recording_) return;
  recording_ = false;
  if (auto ended = commands_.end(); !ended) return fail(ended.error());
  if (auto done = context_.run(commands_); !done) fail(done.error());
}

}  // namespace opaline::reconstruct::vulkan
