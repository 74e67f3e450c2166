#include "daemon/cli/view.h"

#include <fmt/format.h>

#include "daemon/cli/become.h"

namespace opaline::daemon {

Error become_view(const std::filesystem::path& programs, const ViewWish& wish) {
  std::vector<std::string> words{"--frames",
                                 fmt::format("{}", wish.frames),
                                 "--width",
                                 fmt::format("{}", wish.width),
                                 "--height",
                                 fmt::format("{}", wish.height),
                                 "--threads",
                                 fmt::format("{}", wish.threads)};
  for (const std::string& action : wish.actions) words.insert(words.end(), {"--do", action});
  if (!wish.screenshot.empty()) words.insert(words.end(), {"--screenshot", wish.screenshot});
  if (!wish.step_pictures.empty()) {
    words.insert(words.end(), {"--step-pictures", wish.step_pictures});
  }
  if (!wish.device.empty()) words.insert(words.end(), {"--device", wish.device});
  if (wish.validation) words.emplace_back("--validation");
  words.insert(words.end(), {"--", wish.scene});
  return become(programs, "opaline-view", words);
}

}  // namespace opaline::daemon
