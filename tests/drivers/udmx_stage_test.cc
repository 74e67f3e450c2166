#include "drivers/udmx/udmx_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/support/fake_udmx.h"

namespace opaline::drivers {
namespace {

using support::FakeUdmx;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

UdmxOptions options_of(std::size_t lights) {
  UdmxOptions options;
  options.lights = light_sphere(static_cast<int>(lights), 600.0, 0.5);
  return options;
}

StagePattern pattern_of(std::size_t lights, std::uint8_t code, std::uint64_t id = 1) {
  return {id, std::vector<std::uint8_t>(lights, code)};
}

/// bRequest, wValue, wIndex, and the data, as they went over the wire.
std::vector<int> bytes_of(const FakeUdmx::Write& write) {
  std::vector<int> bytes{write.request.request, write.request.value, write.request.index};
  bytes.insert(bytes.end(), write.data.begin(), write.data.end());
  return bytes;
}

TEST(UdmxStage, SendsARangeAndThenOnlyWhatChanges) {
  FakeUdmx world({"1-1"});
  UdmxStage stage(options_of(4), world.bus());
  ASSERT_TRUE(stage.open());
  auto writes = world.take_writes();
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_THAT(bytes_of(writes[0]), ElementsAre(2, 4, 0, 0, 0, 0, 0));  // dark from the start
  ASSERT_TRUE(stage.set({1, {10, 20, 30, 40}}, {}));
  writes = world.take_writes();
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_THAT(bytes_of(writes[0]), ElementsAre(2, 4, 0, 10, 20, 30, 40));
  ASSERT_TRUE(stage.set({2, {10, 20, 255, 40}}, {}));
  writes = world.take_writes();
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_THAT(bytes_of(writes[0]), ElementsAre(1, 255, 2));  // a single channel
  ASSERT_TRUE(stage.set({3, {10, 21, 255, 41}}, {}));
  writes = world.take_writes();
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_THAT(bytes_of(writes[0]), ElementsAre(2, 3, 1, 21, 255, 41));
  ASSERT_TRUE(stage.set({4, {10, 21, 255, 41}}, {}));
  EXPECT_THAT(world.take_writes(), IsEmpty());
}

TEST(UdmxStage, GoesOnOverInterfacesByWhereTheyArePluggedIn) {
  FakeUdmx world({"1-1", "1-2", "3-1.4"});
  UdmxOptions options = options_of(346);
  options.channels_per_light = 3;
  options.interfaces = {"3-1.4", "1-1", "1-2"};
  UdmxStage stage(options, world.bus());
  ASSERT_TRUE(stage.open());
  EXPECT_EQ(stage.info()->serial, "3-1.4, 1-1, 1-2");
  StagePattern pattern = pattern_of(346, 0);
  pattern.codes[170] = 7;  // channels 511, 512 and 513
  pattern.codes[345] = 9;  // 1036 to 1038
  ASSERT_TRUE(stage.set(pattern, {}));
  EXPECT_EQ(world.values(2)[509], 0);
  EXPECT_EQ(world.values(2)[510], 7);
  EXPECT_EQ(world.values(2)[511], 7);
  EXPECT_EQ(world.values(0)[0], 7);
  EXPECT_EQ(world.values(0)[1], 0);
  EXPECT_EQ(world.values(1)[1035 - 1024], 9);
  EXPECT_EQ(world.values(1)[1037 - 1024], 9);
  EXPECT_EQ(world.values(1)[1038 - 1024], 0);
}

TEST(UdmxStage, TurnsItsPolarizerByAChannel) {
  FakeUdmx world({"1-1"});
  UdmxOptions options = options_of(4);
  options.polarizer_channel = 9;
  options.cross_code = 12;
  options.parallel_code = 200;
  UdmxStage stage(options, world.bus());
  ASSERT_TRUE(stage.open());
  EXPECT_TRUE(stage.info()->turns_polarizer);
  StagePattern pattern = pattern_of(4, 50);
  ASSERT_TRUE(stage.set(pattern, {}));
  EXPECT_EQ(world.values(0)[8], 12);
  pattern.polarization = Polarization::kParallel;
  world.take_writes();
  ASSERT_TRUE(stage.set(pattern, {}));
  const auto writes = world.take_writes();
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_THAT(bytes_of(writes[0]), ElementsAre(1, 200, 8));
}

TEST(UdmxStage, NothingButTheTwoRequestsIsEverSent) {
  FakeUdmx world({"1-1"});
  UdmxStage stage(options_of(156), world.bus());
  ASSERT_TRUE(stage.open());
  for (int code = 0; code < 256; ++code)
    ASSERT_TRUE(stage.set(pattern_of(156, static_cast<std::uint8_t>(code)), {}));
  ASSERT_TRUE(stage.blank());
  stage.close();
  for (const auto& write : world.take_writes()) {
    EXPECT_TRUE(write.request.request == 1 || write.request.request == 2);
    EXPECT_LE(write.request.index + (write.request.request == 2 ? write.request.value : 1), 512);
  }
}

TEST(UdmxStage, AnotherProcessBlanksWhatADeadOneLeftLit) {
  FakeUdmx world({"1-1", "1-2"});
  const UdmxOptions options = options_of(600);
  auto dying = std::make_unique<UdmxStage>(options, world.bus());
  ASSERT_TRUE(dying->open());
  ASSERT_TRUE(dying->set(pattern_of(600, 200), {}));
  world.plug(false);
  dying.reset();  // killed: its own close reaches nothing
  world.plug(true);
  EXPECT_FALSE(world.is_dark());
  UdmxStage guardian(options, world.bus());
  ASSERT_TRUE(guardian.blank());
  EXPECT_TRUE(world.is_dark());
}

TEST(UdmxStage, BlanksTheOtherInterfacesWhenOneIsGone) {
  FakeUdmx world({"1-1", "1-2"});
  UdmxStage stage(options_of(600), world.bus());
  ASSERT_TRUE(stage.open());
  ASSERT_TRUE(stage.set(pattern_of(600, 200), {}));
  world.plug(0, false);
  EXPECT_FALSE(stage.blank());
  EXPECT_EQ(world.values(1)[10], 0);
}

TEST(UdmxStage, BlankKeepsItsSecondWhenInterfacesDoNotAnswer) {
  FakeUdmx world({"1-1", "1-2"});
  UdmxStage stage(options_of(600), world.bus());
  ASSERT_TRUE(stage.open());
  world.slow_down(std::chrono::seconds(10));
  const auto start = std::chrono::steady_clock::now();
  const auto blanked = stage.blank();
  ASSERT_FALSE(blanked);
  EXPECT_EQ(blanked.error().code, ErrorCode::kTimeout);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
  world.slow_down({});
}

TEST(UdmxStage, APatternThatHalfArrivedEndsDarkAndClosed) {
  FakeUdmx world({"1-1", "1-2"});
  UdmxStage stage(options_of(600), world.bus());
  ASSERT_TRUE(stage.open());
  world.plug(1, false);
  const auto set = stage.set(pattern_of(600, 200), {});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(world.values(0)[10], 0);
  EXPECT_EQ(stage.info().error().code, ErrorCode::kUnavailable);
}

TEST(UdmxStage, SaysWhatIsMissing) {
  FakeUdmx none({});
  EXPECT_THAT(UdmxStage(options_of(156), none.bus()).open().error().message,
              HasSubstr("156 channels need 1 uDMX interfaces (USB 16c0:05dc), and there are 0"));
  FakeUdmx one({"1-1"});
  UdmxOptions options = options_of(156);
  options.interfaces = {"1-3"};
  EXPECT_THAT(UdmxStage(options, one.bus()).open().error().message,
              HasSubstr("no uDMX interface at 1-3; there are: 1-1"));
  options = options_of(156);
  options.polarizer_channel = 100;
  EXPECT_THAT(validate(options).error().message,
              HasSubstr("polarizer_channel = 100; expected none of the lights' channels"));
  options = options_of(1000);
  options.channels_per_light = 3;
  EXPECT_THAT(validate(options).error().message, HasSubstr("expected at most 2048"));
}

}  // namespace
}  // namespace opaline::drivers
