#include "daemon/light_switch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "drivers/udmx/udmx_stage.h"
#include "tests/support/fake_udmx.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;

constexpr int kLamps = 600;  // on two interfaces

config::RigConfig udmx_rig() {
  config::RigConfig rig;
  rig.light_stage.driver = config::StageDriver::kUdmx;
  rig.light_stage.lamps = kLamps;
  rig.light_stage.beam.power_w = 0.001;
  return rig;
}

/// What a capture leaves shining that is killed: interfaces keep their values, nobody closes the stage.
void leave_lit(support::FakeUdmx& world, const config::RigConfig& rig) {
  drivers::UdmxOptions options = rig.light_stage.udmx;
  options.lights = rig.light_stage.lights();
  auto* killed = new drivers::UdmxStage(options, world.bus());  // NOLINT: no destructor may run
  static auto* kept = new std::vector<drivers::UdmxStage*>;     // NOLINT: so that it is no leak
  kept->push_back(killed);
  ASSERT_TRUE(killed->open());
  ASSERT_TRUE(killed->set({1, std::vector<std::uint8_t>(options.lights.size(), 200)}, {}));
}

TEST(LightSwitch, MakesTheLampsAndTheBeamOfEveryInterfaceDarkWhenTheirCaptureDied) {
  support::FakeUdmx world({"1-1", "1-2"});
  const config::RigConfig rig = udmx_rig();
  const auto make_dark = light_switch(rig, [&] { return world.bus(); });
  leave_lit(world, rig);
  ASSERT_EQ(world.values(0)[0], 200);
  ASSERT_EQ(world.values(1)[kLamps - 512], 200) << "the beam, behind the last lamp";

  ASSERT_TRUE(make_dark());

  EXPECT_TRUE(world.is_dark());
}

TEST(LightSwitch, SaysSoWhenAnInterfaceIsGoneAndTriesAgainWhenItIsBack) {
  support::FakeUdmx world({"1-1", "1-2"});
  const config::RigConfig rig = udmx_rig();
  const auto make_dark = light_switch(rig, [&] { return world.bus(); });
  leave_lit(world, rig);
  world.plug(1, false);

  const auto gone = make_dark();
  ASSERT_FALSE(gone);
  EXPECT_THAT(gone.error().message, HasSubstr("601 channels need 2 uDMX interfaces"));

  world.plug(1, true);
  ASSERT_TRUE(make_dark());
  EXPECT_TRUE(world.is_dark());
}

}  // namespace
}  // namespace opaline::daemon
