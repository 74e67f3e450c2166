#include "sim/blob_transfer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::sim {
namespace {

constexpr double kRadius = 10.0;  // mm
constexpr double kPixel = 0.15;
constexpr int kColumns = 100;
constexpr int kHalf = 7;
constexpr double kReach = kHalf * kPixel;

/// What a camera far away along z sees of a ball, within 45 degrees of its middle, whose light follows its normal.
struct Picture {
  std::vector<SeenPlace> places;
  std::vector<std::uint32_t> pixel_of;
  std::vector<BlobTransfer> transfer;
};
Picture ball_that_shows_its_normal() {
  Picture p;
  for (int y = 0; y < kColumns; ++y)
    for (int x = 0; x < kColumns; ++x) {
      const double px = (x + 0.5 - 0.5 * kColumns) * kPixel / kRadius;
      const double py = (y + 0.5 - 0.5 * kColumns) * kPixel / kRadius;
      const double square = px * px + py * py;
      if (square > 0.5) continue;
      const Vec3 n{px, py, std::sqrt(1.0 - square)};
      p.places.push_back({n * kRadius, n, {0, 0, 1}});
      p.pixel_of.push_back(static_cast<std::uint32_t>(y * kColumns + x));
      BlobTransfer t;
      t.terms[0] = 1.0F;
      t.terms[1] = static_cast<float>(n.y);
      t.terms[2] = static_cast<float>(n.z);
      t.terms[3] = static_cast<float>(n.x);
      t.variance = 1.0F;
      p.transfer.push_back(t);
    }
  return p;
}

// A mean over the same reach would show gradients smaller by reach^2 / (4 R^2), 3e-3.
TEST(Smoothed, KeepsWhatABallShows) {
  const Picture p = ball_that_shows_its_normal();
  ThreadTeam team(2);

  const auto smooth = smoothed(p.transfer, p.places, p.pixel_of, kColumns, kHalf, kReach, team);

  ASSERT_EQ(smooth.size(), p.transfer.size());
  for (std::size_t n = 0; n < smooth.size(); ++n) {
    const auto& t = smooth[n].terms;
    EXPECT_NEAR(t[0], 1.0, 1e-5);
    EXPECT_NEAR(std::sqrt(t[1] * t[1] + t[2] * t[2] + t[3] * t[3]), 1.0, 2e-4) << n;
  }
}

// The middle of a quadratic fit over a disc of n places has 4/n of one's variance.
TEST(Smoothed, LeavesLittleOfTheNoise) {
  const Picture p = ball_that_shows_its_normal();
  ThreadTeam team(2);

  const auto smooth = smoothed(p.transfer, p.places, p.pixel_of, kColumns, kHalf, kReach, team);

  double least = 1.0;
  for (const BlobTransfer& t : smooth) least = std::min<double>(least, t.variance);
  EXPECT_NEAR(least * 149.0 / 4.0, 1.0, 0.1);  // 149 pixels within seven of one
}

}  // namespace
}  // namespace opaline::sim
