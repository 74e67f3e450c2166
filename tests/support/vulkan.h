#pragma once

#include <gtest/gtest.h>

#include <string_view>

#include "gpu/context.h"

namespace opaline::tests {

/// Options under which every message of the validation layer fails the running test, also those
/// that come while the context is destroyed (handles left behind).
inline gpu::ContextOptions validated() {
  gpu::ContextOptions options;
  options.validation = true;
  options.on_validation_message = [](std::string_view message) {
    ADD_FAILURE() << "Vulkan validation: " << message;
  };
  return options;
}

}  // namespace opaline::tests
