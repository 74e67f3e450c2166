#include <gtest/gtest.h>

#include <vector>

#include "daemon/cli/progress_view.h"
#include "daemon/cli/sse_parser.h"

namespace opaline::daemon {
namespace {

TEST(SseParser, PutsMessagesTogetherFromAnyPieces) {
  const std::string stream =
      ": hello\n\nid: 7\nevent: progress\ndata: {\"a\":1}\n\nevent: state\r\ndata: x\r\n\r\n";
  for (std::size_t size = 1; size < stream.size(); ++size) {
    std::vector<ServerEvent> events;
    SseParser parser([&](const ServerEvent& event) { events.push_back(event); });
    for (std::size_t i = 0; i < stream.size(); i += size) parser.feed(stream.substr(i, size));

    ASSERT_EQ(events.size(), 2U);
    EXPECT_EQ(events[0].id, 7U);
    EXPECT_EQ(events[0].type, "progress");
    EXPECT_EQ(events[0].data, "{\"a\":1}");
    EXPECT_FALSE(events[1].id);
    EXPECT_EQ(events[1].data, "x");
  }
}

TEST(ProgressLine, ShowsStepFiguresFractionAndTimeLeft) {
  const nlohmann::json progress{
      {"step", "exposures"},
      {"fraction", 0.42},
      {"seconds_left", 95.2},
      {"detail", {{"region", 3}, {"regions", 16}, {"objective", 0.0123456}}}};
  EXPECT_EQ(progress_line("capture", progress),
            "capture: exposures  objective 0.01235  region 3/16  42 %  1:35 left");
  EXPECT_EQ(progress_line("capture", nullptr), "capture");
}

}  // namespace
}  // namespace opaline::daemon
