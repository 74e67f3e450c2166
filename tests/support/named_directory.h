#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace opaline::testing {

/// What ctest names: OPALINE_SOURCE_DIR, OPALINE_BIN_DIR, OPALINE_FAKES. Without it a test fails and says what to do.
inline std::filesystem::path named_directory(const char* variable) {
  const char* const value = std::getenv(variable);
  if (value == nullptr)
    throw std::runtime_error(std::string(variable) +
                             " is not set: run this test by ctest, or set it as ctest does");
  return value;
}

}  // namespace opaline::testing
