#include <gtest/gtest.h>

#include <chrono>

#include "base/io/volume_io.h"
#include "bench/faults/fault_bed.h"
#include "tests/support/named_directory.h"

namespace opaline::faults {
namespace {

constexpr int kKills = 3;
constexpr auto kShortest = std::chrono::milliseconds(20);

std::filesystem::path programs() { return opaline::testing::named_directory("OPALINE_BIN_DIR"); }

// The files themselves differ in one place: OpenVDB gives each its own random name.
TEST(KilledReconstruction, FindsTheVeryMaterialOfAnUndisturbedOne) {
  const auto bed = FaultBed::create({programs()});
  ASSERT_TRUE(bed) << bed.error().message;
  const auto reference = (*bed)->new_session();
  ASSERT_TRUE(reference) << reference.error().message;
  const auto captured = (*bed)->complete("opaline-capture", *reference);
  ASSERT_TRUE(captured) << captured.error().message;
  const auto untouched = (*bed)->root() / "captured";
  std::filesystem::copy(*reference, untouched, std::filesystem::copy_options::recursive);
  const auto start = std::chrono::steady_clock::now();
  const auto done = (*bed)->complete("opaline-reconstruct", *reference);
  const auto length = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(done) << done.error().message;
  const auto expected = read_material(*reference / "material.vdb");
  ASSERT_TRUE(expected) << expected.error().message;

  // A second run on a machine that has become quicker may end before every moment of the first: then in half the time.
  int alive = 0;
  int sessions = 0;
  for (auto within = length; alive == 0 && within > kShortest; within /= 2) {
    for (const auto at : moments(within, kKills, 7)) {
      const auto session = (*bed)->root() / ("killed-" + std::to_string(sessions++));
      std::filesystem::copy(untouched, session, std::filesystem::copy_options::recursive);
      const auto killed = (*bed)->kill_and_complete("opaline-reconstruct", session, at);
      ASSERT_TRUE(killed) << killed.error().message;
      alive += *killed ? 1 : 0;
      const auto material = read_material(session / "material.vdb");
      ASSERT_TRUE(material) << material.error().message;
      EXPECT_TRUE(*material == *expected) << "killed after " << at.count() / 1'000'000 << " ms";
    }
  }
  EXPECT_GE(alive, 1);
}

}  // namespace
}  // namespace opaline::faults
