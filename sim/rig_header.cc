#include "sim/rig_header.h"

#include <fmt/format.h>

namespace opaline::sim {

const nlohmann::json& RigHeader::find(std::string_view name) const {
  static const nlohmann::json none;
  const auto found = header_.is_object() ? header_.find(name) : header_.end();
  return found == header_.end() ? none : *found;
}

double RigHeader::number(std::string_view name) {
  const nlohmann::json& field = find(name);
  if (field.is_number()) return field.get<double>();
  fail(name, "a number");
  return 0.0;
}

bool RigHeader::flag(std::string_view name) {
  const nlohmann::json& field = find(name);
  if (field.is_boolean()) return field.get<bool>();
  fail(name, "true or false");
  return false;
}

std::string RigHeader::text(std::string_view name) {
  const nlohmann::json& field = find(name);
  if (field.is_string()) return field.get<std::string>();
  fail(name, "a text");
  return {};
}

void RigHeader::fail(std::string_view name, std::string_view expected) {
  if (!result_) return;
  result_ = invalid_argument(
      fmt::format("not what goes over the rig's socket: {}: expected {}", name, expected));
}

}  // namespace opaline::sim
