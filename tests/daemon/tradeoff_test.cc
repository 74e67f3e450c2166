// opaline tradeoff, as a user calls it.

#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>

#include "base/files.h"
#include "base/io/dataset_io.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/synthetic_dataset.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class TradeoffProgram : public ::testing::Test {
 protected:
  testing::Process start(std::vector<std::string> arguments) {
    const fs::path program = opaline::testing::named_directory("OPALINE_BIN_DIR") / "opaline";
    std::vector<std::string> words{program.string(), "tradeoff"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return testing::Process(words, {}, directory_.path() / "out");
  }
  fs::path write(const Dataset& dataset) {
    EXPECT_TRUE(write_dataset(system_files(), directory_.path(), dataset));
    return directory_.path();
  }
  Dataset small() {
    return testing_support::make_synthetic_dataset(
        {.block = {8, 8, 4, 1.0, 1.0, 1.0}, .regions = 2});
  }
  std::string file(const char* name) {
    return read_text(directory_.path() / "front" / name).value_or("");
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(TradeoffProgram, WritesATableAndAPictureOfTheFront) {
  const fs::path dataset = write(small());
  auto run = start({"--quick", "--out", (directory_.path() / "front").string(), dataset.string()});
  ASSERT_EQ(run.wait(), 0) << run.output();
  EXPECT_THAT(run.output(), AllOf(HasSubstr("The front"), HasSubstr("relighting error")));
  EXPECT_THAT(file("tradeoff.csv"),
              AllOf(HasSubstr("dial,regions"), HasSubstr("\"given\",2,1,8x8x4")));
  EXPECT_THAT(file("tradeoff.svg"),
              AllOf(HasSubstr("<svg"), HasSubstr("noise alone"), HasSubstr("front")));
}

TEST_F(TradeoffProgram, KeepsWhatWasMeasuredWhenItIsInterrupted) {
  const fs::path dataset = write(
      testing_support::make_synthetic_dataset({.block = {16, 16, 8, 1.0, 1.0, 1.0}, .regions = 4}));
  auto run = start({"--out", (directory_.path() / "front").string(), dataset.string()});
  ASSERT_TRUE(testing::eventually([&] { return !file("tradeoff.csv").empty(); }));
  run.kill(SIGINT);
  EXPECT_EQ(run.wait(), 3) << run.output();
  EXPECT_THAT(file("tradeoff.csv"), HasSubstr("\n\""));
  EXPECT_THAT(file("tradeoff.svg"), HasSubstr("</svg>"));
}

TEST_F(TradeoffProgram, SaysWhatItCannotMeasure) {
  auto nothing = start({(directory_.path() / "nowhere").string()});
  EXPECT_EQ(nothing.wait(), 2);
  EXPECT_THAT(nothing.output(), HasSubstr("nowhere"));
  Dataset fitted_only = small();
  std::erase_if(fitted_only.illuminations, [](const Illumination& i) { return i.held_out; });
  auto blind = start({write(fitted_only).string()});
  EXPECT_EQ(blind.wait(), 2);
  EXPECT_THAT(blind.output(), HasSubstr("held_out_lights"));
}

}  // namespace
}  // namespace opaline::daemon
