#include "daemon/cli/render.h"

#include <fmt/format.h>

#include <utility>

#include "daemon/cli/become.h"

namespace opaline::daemon {

Error become_render(const std::filesystem::path& programs, const RenderWish& wish) {
  std::vector<std::string> words{"--turntable",
                                 fmt::format("{}", wish.turntable),
                                 "--threads",
                                 fmt::format("{}", wish.threads)};
  for (const std::string& output : wish.outputs) words.insert(words.end(), {"--output", output});
  if (!wish.stats.empty()) words.insert(words.end(), {"--stats", wish.stats});
  for (const std::string& text : wish.materials) {
    words.insert(words.end(), {"--save-material", text});
  }
  words.insert(words.end(), {"--draw", wish.draw});
  if (!wish.device.empty()) words.insert(words.end(), {"--device", wish.device});
  if (wish.no_edits) words.emplace_back("--no-edits");
  if (wish.at_rest) words.emplace_back("--at-rest");
  if (wish.swing) words.emplace_back("--swing");
  words.insert(words.end(), {"--light", wish.light});
  for (const auto& [name, value] : {std::pair{"--turn", wish.turn_deg},
                                    {"--tilt", wish.tilt_deg},
                                    {"--mesh-size", wish.mesh_size_mm}})
    words.push_back(fmt::format("{}={}", name, value));
  if (!wish.mesh.empty()) words.insert(words.end(), {"--mesh", wish.mesh});
  words.insert(words.end(), {"--", wish.scene});
  return become(programs, "opaline-render", words);
}

}  // namespace opaline::daemon
