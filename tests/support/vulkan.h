#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <string_view>

#include "gpu/context.h"

namespace opaline::tests {

/// Keeps Mesa's software driver in memory to the end, so that AddressSanitizer can name what it never frees
/// (tests/support/lsan.supp).
inline void keep_driver() {
  static const void* const kDriver = dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_NODELETE);
  (void)kDriver;
}

/// Options under which every message of the validation layer fails the running test, also those that come while the
/// context is destroyed (handles left behind).
inline gpu::ContextOptions validated() {
  keep_driver();
  gpu::ContextOptions options;
  options.validation = true;
  options.on_validation_message = [](std::string_view message) {
    ADD_FAILURE() << "Vulkan validation: " << message;
  };
  return options;
}

}  // namespace opaline::tests
