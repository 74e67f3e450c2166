#include "daemon/report/found_source.h"

#include <nlohmann/json.hpp>

namespace opaline::daemon {

using reconstruct::diffusion::SourceModel;

std::optional<SourceModel> found_source(const nlohmann::json& reconstruction) {
  const auto options = reconstruction.find("options");
  if (options == reconstruction.end() || !options->is_object()) return std::nullopt;
  const auto source = options->find("source");
  if (source == options->end()) return std::nullopt;
  for (const SourceModel model : {SourceModel::kCollimated, SourceModel::kSurface})
    if (*source == to_string(model)) return model;
  return std::nullopt;
}

}  // namespace opaline::daemon
