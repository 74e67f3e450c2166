#include "calibration/store.h"

#include <gmock/gmock.h>

#include "tests/support/temporary_directory.h"

namespace opaline::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class StoreTest : public ::testing::Test {
 protected:
  Record record(int version, double margin) {
    Record r;
    r.version = version;
    r.station = "demo";
    r.created = "2026-01-31T12:34:56.789Z";
    r.camera = {"camera", "1", 64, 64, 12};
    for (const std::string_view step : kSteps)
      r.steps.push_back({std::string(step), "", {{"lamp drift", margin, 1.0, "", "wait"}}, {}});
    r.measured.black_level = 64.0;
    r.measured.hot_pixels = {{3, 4}};
    EXPECT_TRUE(store_.write(r));
    return r;
  }
  testing::TemporaryDirectory directory_;
  Store store_{system_files(), directory_.path(), "demo"};
};

TEST_F(StoreTest, ListsAndReadsWhatWasWritten) {
  record(2, 0.5);
  record(11, 0.5);
  EXPECT_THAT(store_.versions(), ElementsAre(2, 11));
  const auto read = store_.read(11);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->version, 11);
  EXPECT_EQ(read->state(), RecordState::kAccepted);
  EXPECT_THAT(read->measured.hot_pixels, ElementsAre(std::pair{3, 4}));
  EXPECT_THAT(store_.read(3).error().message, HasSubstr("there are 2, 11"));
  EXPECT_THAT(stations_in(directory_.path()), ElementsAre("demo"));
}

TEST_F(StoreTest, RollsBackInOneCall) {
  record(1, 0.5);
  record(2, 0.5);
  EXPECT_FALSE(store_.read_active()->has_value());
  ASSERT_TRUE(store_.activate(1));
  ASSERT_TRUE(store_.activate(2));
  EXPECT_EQ(store_.used_before(2)->value(), 1);
  EXPECT_FALSE(store_.used_before(1)->has_value());
  ASSERT_TRUE(store_.activate(1));
  EXPECT_EQ(store_.active()->value(), 1);
  EXPECT_EQ(store_.read_active()->value().version, 1);
}

TEST_F(StoreTest, ActivatesNothingThatWasRefused) {
  record(1, 1.5);
  const auto activated = store_.activate(1);
  ASSERT_FALSE(activated);
  EXPECT_EQ(activated.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(activated.error().message, HasSubstr("warm_up: lamp drift"));
  EXPECT_FALSE(store_.active()->has_value());
}

TEST_F(StoreTest, KeepsTheActiveOneWhereTheFreshOneIsClearlyWorse) {
  const Record active = record(1, 0.3);
  EXPECT_TRUE(should_activate(record(2, 0.45), active));
  EXPECT_FALSE(should_activate(record(3, 0.8), active));
  EXPECT_TRUE(should_activate(record(4, 0.8), std::nullopt));
  EXPECT_FALSE(should_activate(record(5, 1.1), std::nullopt));
  Record other = record(6, 0.8);
  other.camera.serial = "2";
  EXPECT_TRUE(should_activate(other, active));
}

TEST_F(StoreTest, RefusesWhatIsDamagedOrOfANewerVersion) {
  record(1, 0.5);
  const auto file = store_.directory_of(1) / "calibration.json";
  ASSERT_TRUE(write_whole(system_files(), file, R"({"format": 9})"));
  EXPECT_THAT(store_.read(1).error().message, HasSubstr("newer version"));
  ASSERT_TRUE(write_whole(system_files(), file, R"({"format": 1, "version": "one"})"));
  EXPECT_THAT(store_.read(1).error().message, HasSubstr("is damaged"));
  ASSERT_TRUE(write_whole(system_files(), store_.directory() / "active.json", "{"));
  EXPECT_THAT(store_.read_active().error().message, HasSubstr("opaline calibration activate"));
}

}  // namespace
}  // namespace opaline::calibration
