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

// The keys are those that capture/sequence.cc and reconstruct/inverse_solver.cc send.
TEST(ProgressLine, ShowsACapturesLightRegionExposureAndTimeLeft) {
  const nlohmann::json progress{
      {"step", "capture"},
      {"fraction", 0.2083},
      {"seconds_left", 95.2},
      {"detail", {{"light", 5}, {"lights", 24}, {"region", "region_1_2"}, {"exposure", "0.5 s"}}}};
  EXPECT_EQ(progress_line("capture", progress),
            "capture  light 5/24  region_1_2  exposure 0.5 s  21 %  1:35 left");
}

TEST(ProgressLine, ShowsAReconstructionsChannelAndObjective) {
  const nlohmann::json progress{{"step", "reconstruction"},
                                {"fraction", 0.4},
                                {"detail",
                                 {{"channel", "red"},
                                  {"iteration", 12},
                                  {"objective", 0.0123456},
                                  {"chi_squared_per_datum", 1.0502}}}};
  EXPECT_EQ(progress_line("reconstruct", progress),
            "reconstruct: reconstruction  channel red  iteration 12  objective 0.01235  "
            "chi2/datum 1.05  40 %");
}

TEST(ProgressLine, ShowsWhatItDoesNotKnowAfterWhatItDoes) {
  const nlohmann::json progress{{"step", "x"}, {"detail", {{"area", 2}, {"region", "black"}}}};
  EXPECT_EQ(progress_line("capture", progress), "capture: x  region black  area 2");
  EXPECT_EQ(progress_line("capture", nullptr), "capture");
}

}  // namespace
}  // namespace opaline::daemon
