#include "daemon/report/uncertainty_section.h"

#include <gmock/gmock.h>

namespace opaline::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

json two_channels() {
  const auto channel = [](const char* name, double amplitude) {
    return json{
        {"channel", name},
        {"determined_diffusion", 30.2},
        {"determined_absorption", 10.3},
        {"seconds", 2.25},
        {"reduced_scattering",
         {{"prior", 1.5}, {"amplitude", amplitude}, {"layers", {0.0625, 0.19, 0.225, 0.3}}}},
        {"absorption",
         {{"prior", 1.75}, {"amplitude", 0.5}, {"layers", {0.125, 0.25, 0.375, 0.4375}}}}};
  };
  return {{"uncertainty",
           {{"layer_mm", 0.5}, {"channels", {channel("red", 0.25), channel("green", 0.2)}}}}};
}

TEST(UncertaintySection, ListsTheDeviationsByDepthBesideThePriors) {
  const std::string shown = uncertainty_section(two_channels());
  EXPECT_THAT(shown, HasSubstr("<th>0.25 mm</th><th>0.75 mm</th><th>1.25 mm</th><th>1.75 mm</th>"));
  EXPECT_THAT(shown,
              HasSubstr("red: σa</td><td>1.75</td><td>0.12</td><td>0.25</td><td>0.38</td>"
                        "<td>0.44</td><td>0 of 4</td>"));
  EXPECT_THAT(shown, HasSubstr("<td>40</td><td>2.2 s</td>"));
}

TEST(UncertaintySection, CountsTheLayersOfWhichNothingButTheLevelIsKnown) {
  const std::string shown = uncertainty_section(two_channels());
  EXPECT_THAT(shown, HasSubstr("<td>2 of 4</td>"));  // red: 0.225 and 0.3 of 0.25
  EXPECT_THAT(shown, HasSubstr("<td>3 of 4</td>"));  // green: 0.19, too, of 0.2
}

TEST(UncertaintySection, DrawsEachChannelThePriorAndItsAmplitude) {
  const auto plots = uncertainty_plots(two_channels());
  ASSERT_THAT(plots, SizeIs(2));
  const CurvePlot& scattering = plots[0].second;
  ASSERT_THAT(scattering.series, SizeIs(3));
  EXPECT_THAT(scattering.series[0].x, ElementsAre(0.25, 0.75, 1.25, 1.75));
  EXPECT_THAT(scattering.series[1].y, ElementsAre(0.0625, 0.19, 0.225, 0.3));
  EXPECT_THAT(scattering.series[2].y, ElementsAre(1.5, 1.5, 1.5, 1.5));
  EXPECT_DOUBLE_EQ(scattering.level, 0.225);
}

TEST(UncertaintySection, SaysWhyThereAreNoDeviations) {
  const json homogeneous{{"uncertainty_absent", "every channel is homogeneous"}};
  EXPECT_THAT(uncertainty_section(homogeneous), HasSubstr("every channel is homogeneous"));
  EXPECT_THAT(uncertainty_plots(homogeneous), IsEmpty());
  EXPECT_THAT(uncertainty_section(json::object()), HasSubstr("does not tell"));
}

TEST(UncertaintySection, ShowsNoneWhereTheLayersDoNotFitTogether) {
  json torn = two_channels();
  torn["uncertainty"]["channels"][1]["absorption"]["layers"].erase(0);
  EXPECT_THAT(uncertainty_plots(torn), IsEmpty());
}

}  // namespace
}  // namespace opaline::daemon
