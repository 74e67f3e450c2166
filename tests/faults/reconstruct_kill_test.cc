#include <gtest/gtest.h>

#include <chrono>

#include "base/io/volume_io.h"
#include "bench/faults/fault_bed.h"
#include "tests/support/named_directory.h"

namespace opaline::faults {
namespace {

constexpr int kKills = 3;

std::filesystem::path programs() { return opaline::testing::named_directory("OPALINE_BIN_DIR"); }

// The files themselves differ in one place: OpenVDB gives each its own random name.
TEST(KilledReconstruction, FindsTheVeryMaterialOfAnUndisturbedOne) {
  const auto bed = FaultBed::create({programs()});
  ASSERT_TRUE(bed) << bed.error().message;
  const auto reference = (*bed)->new_session();
  ASSERT_TRUE(reference) << reference.error().message;
  const auto captured = (*bed)->complete("opaline-capture", *reference);
  ASSERT_TRUE(captured) << captured.error().message;
  const auto copy_of_capture = [&](const std::string& name) {
    auto session = (*bed)->root() / name;
    std::filesystem::copy(*reference, session, std::filesystem::copy_options::recursive);
    return session;
  };
  std::vector<std::filesystem::path> sessions;
  sessions.reserve(kKills);
  for (int i = 0; i < kKills; ++i)
    sessions.push_back(copy_of_capture("killed-" + std::to_string(i)));
  const auto start = std::chrono::steady_clock::now();
  const auto done = (*bed)->complete("opaline-reconstruct", *reference);
  const auto length = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(done) << done.error().message;
  const auto expected = read_material(*reference / "material.vdb");
  ASSERT_TRUE(expected) << expected.error().message;

  int alive = 0;
  const auto at = moments(length, kKills, 7);
  for (int i = 0; i < kKills; ++i) {
    const auto killed = (*bed)->kill_and_complete("opaline-reconstruct", sessions[i], at[i]);
    ASSERT_TRUE(killed) << killed.error().message;
    alive += *killed ? 1 : 0;
    const auto material = read_material(sessions[i] / "material.vdb");
    ASSERT_TRUE(material) << material.error().message;
    EXPECT_TRUE(*material == *expected) << "killed after " << at[i].count() / 1'000'000 << " ms";
  }
  EXPECT_GE(alive, 1);  // the machine may be slower or quicker from run to run
}

}  // namespace
}  // namespace opaline::faults
