#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace opaline::daemon {

/// The text under a key of JSON that somebody else wrote; empty when there is none, or no object.
inline std::string text_of(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);  // end() for what is no object
  return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
}

}  // namespace opaline::daemon
