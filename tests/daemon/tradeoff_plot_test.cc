#include "daemon/tradeoff/tradeoff_plot.h"

#include <gmock/gmock.h>

namespace opaline::daemon {
namespace {

using reconstruct::TradeoffPoint;
using ::testing::HasSubstr;

TradeoffPoint point(const char* dial, double seconds, double error) {
  TradeoffPoint p;
  p.setting.dial = dial;
  p.seconds = seconds;
  p.held_out.error = error;
  p.held_out.noise_floor = 0.01;
  return p;
}

TEST(TradeoffPlot, DrawsEveryDialThatWasTurned) {
  const auto svg = tradeoff_svg({point("given", 1.0, 0.02),
                                 point("grid correction", 2.0, 0.015),
                                 point("quality draft", 0.5, 0.03),
                                 point("quality reference", 9.0, 0.012),
                                 point("weather", 3.0, 0.018)},
                                {});
  ASSERT_TRUE(svg) << svg.error().message;
  for (const char* text :
       {"given", "grid correction", "corrected", "quality", "draft", "reference", "weather"})
    EXPECT_THAT(*svg, HasSubstr(text));
}

}  // namespace
}  // namespace opaline::daemon
