// At the extremes a result is right, or it is an error that says why: never a quiet NaN.

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>

#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/diffusion/source.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/inverse_solver.h"
#include "tests/reconstruct/support/media.h"
#include "tests/support/direct_solver.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using diffusion::Medium;
using diffusion::testing::random_medium;
using ::testing::HasSubstr;
using testing_support::make_synthetic_dataset;

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

// What is extreme about a medium, and how far its fluence may be from a direct factorisation in float64, relative to the
// whole field: behind 90 mean free paths of absorption there is nothing left to be right about.
struct Extreme {
  const char* name;
  Medium medium;
  double error;
};

Medium uniform(const Block& block, double kappa, double absorption) {
  return {block,
          std::vector<double>(block.cell_count(), kappa),
          std::vector<double>(block.cell_count(), absorption),
          2.34053};
}

Medium without_absorption(Medium medium) {
  std::fill(medium.absorption.begin(), medium.absorption.end(), 0.0);
  return medium;
}

// A layer of optical depth 100 in one voxel between clear ones.
Medium with_an_opaque_layer() {
  Medium medium = uniform({9, 9, 9, 0.5, 0.5, 0.5}, 0.3, 0.01);
  for (int j = 0; j < 9; ++j)
    for (int i = 0; i < 9; ++i) medium.diffusion[medium.block.index(i, j, 4)] = 0.5 / (3.0 * 100.0);
  return medium;
}

class ExtremeMedia : public ::testing::TestWithParam<Extreme> {};

// A residual of 1e-8, times what the medium's condition makes of it: up to 1e6 with a contrast of 1e6.
TEST_P(ExtremeMedia, AreSolvedAsADirectFactorisationSolvesThem) {
  const Medium& medium = GetParam().medium;
  const Block& block = medium.block;
  FieldBatch b(block.cell_count(), 2);
  b.field(0)[0] = 1.0;
  b.field(1)[block.index(block.nx / 2, block.ny / 2, 0)] = 1.0;
  FieldBatch phi(b.cells, b.count);
  FieldBatch exact(b.cells, b.count);
  testing_support::DirectSolver direct;
  ASSERT_TRUE(direct.prepare(medium));
  ASSERT_TRUE(direct.solve(b, exact, {}, {}));
  const auto host = host::make_host_solver({.threads = 2});
  ASSERT_TRUE(host->prepare(medium));
  const auto solved = host->solve(b, phi, {1e-8, 1000}, {});
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_EQ(solved->termination, diffusion::Termination::kConverged) << solved->message;
  ASSERT_TRUE(all_finite(phi.values));
  EXPECT_LE(diffusion::testing::worst_difference(phi, exact), GetParam().error) << solved->message;
}

INSTANTIATE_TEST_SUITE_P(
    Host,
    ExtremeMedia,
    ::testing::Values(
        Extreme{"Contrast1e6", random_medium({12, 12, 12, 0.5, 0.5, 0.5}, 1e6, 1), 1e-4},
        Extreme{"NoAbsorption",
                without_absorption(random_medium({12, 12, 12, 0.5, 0.5, 0.5}, 100.0, 2)),
                1e-6},
        Extreme{"OpaqueLayer", with_an_opaque_layer(), 1e-6},
        Extreme{"OneVoxel", uniform({1, 1, 1, 0.5, 0.5, 0.5}, 0.2, 0.01), 1e-8},
        Extreme{"SlabOfOneVoxel", random_medium({40, 40, 1, 0.5, 0.5, 0.5}, 100.0, 3), 1e-6},
        Extreme{"ColumnOfOneVoxel", random_medium({1, 1, 60, 0.5, 0.5, 0.5}, 100.0, 4), 1e-6},
        Extreme{"FlatVoxels", random_medium({12, 12, 12, 1.0, 1.0, 0.01}, 100.0, 5), 1e-6},
        Extreme{"TallVoxels", random_medium({12, 12, 12, 0.01, 0.01, 1.0}, 100.0, 6), 1e-5},
        Extreme{"AlmostBlack", uniform({10, 10, 10, 0.5, 0.5, 0.5}, 0.03, 10.0), 1e-3},
        Extreme{"AlmostClear", uniform({10, 10, 10, 0.5, 0.5, 0.5}, 1e4, 0.0), 1e-5},
        Extreme{"Micrometres", uniform({10, 10, 10, 1e-4, 1e-4, 1e-4}, 1e-4, 1.0), 1e-6},
        Extreme{"Metres", uniform({10, 10, 10, 1e3, 1e3, 1e3}, 100.0, 1e-6), 1e-6}),
    [](const auto& extreme) { return std::string(extreme.param.name); });

/// 113 bits of mantissa.
__extension__ using Quadruple = __float128;

/// K = L L^T of docs/physics.md, "Discretisation on a block sample", dense and in quadruple precision.
class QuadrupleFactor {
 public:
  explicit QuadrupleFactor(const Medium& medium)
      : n_(medium.block.cell_count()), l_(n_ * n_, Quadruple(0)) {
    assemble(medium);
    for (std::size_t c = 0; c < n_; ++c) eliminate(c);
  }

  std::vector<Quadruple> solve(std::vector<Quadruple> x) const {
    for (std::size_t r = 0; r < n_; ++r) {
      for (std::size_t c = 0; c < r; ++c) x[r] -= at(r, c) * x[c];
      x[r] /= at(r, r);
    }
    for (std::size_t r = n_; r-- > 0;) {
      for (std::size_t c = r + 1; c < n_; ++c) x[r] -= at(c, r) * x[c];
      x[r] /= at(r, r);
    }
    return x;
  }

  /// ||K^-1||_2, by the power method from below.
  double inverse_norm() const {
    std::vector<Quadruple> v(n_, Quadruple(1));
    double norm = 0.0;
    for (int iteration = 0; iteration < 60; ++iteration) {
      double length = 0.0;
      for (const Quadruple& value : v) length = std::hypot(length, static_cast<double>(value));
      for (Quadruple& value : v) value /= Quadruple(length);
      v = solve(v);
      norm = 0.0;
      for (const Quadruple& value : v) norm = std::hypot(norm, static_cast<double>(value));
    }
    return norm;
  }

 private:
  Quadruple& at(std::size_t row, std::size_t column) { return l_[row * n_ + column]; }
  Quadruple at(std::size_t row, std::size_t column) const { return l_[row * n_ + column]; }

  void assemble(const Medium& medium) {
    const Block& block = medium.block;
    const std::array<std::size_t, 3> stride{
        1, static_cast<std::size_t>(block.nx), static_cast<std::size_t>(block.nx) * block.ny};
    for (std::size_t c = 0; c < n_; ++c) {
      const Quadruple own = medium.diffusion[c];
      at(c, c) += Quadruple(block.hx) * block.hy * block.hz * medium.absorption[c];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto count = static_cast<std::size_t>(block.cells()[axis]);
        const std::size_t place = c / stride[axis] % count;
        const Quadruple h = block.spacing()[axis];
        const Quadruple area = Quadruple(block.hx) * block.hy * block.hz / h;
        const Quadruple wall = area / (2 * Quadruple(medium.boundary_a) + h / (2 * own));
        if (place == 0) at(c, c) += wall;
        if (place + 1 == count) {
          at(c, c) += wall;
          continue;
        }
        const std::size_t other = c + stride[axis];
        const Quadruple its = medium.diffusion[other];
        const Quadruple g = area / h * 2 * own * its / (own + its);
        at(c, c) += g;
        at(other, other) += g;
        at(other, c) -= g;
      }
    }
  }

  void eliminate(std::size_t c) {
    for (std::size_t k = 0; k < c; ++k) at(c, c) -= at(c, k) * at(c, k);
    at(c, c) = root(at(c, c));
    for (std::size_t r = c + 1; r < n_; ++r) {
      for (std::size_t k = 0; k < c; ++k) at(r, c) -= at(r, k) * at(c, k);
      at(r, c) /= at(c, c);
    }
  }

  static Quadruple root(Quadruple value) {
    Quadruple x = std::sqrt(static_cast<double>(value));
    for (int newton = 0; newton < 3; ++newton) x = (x + value / x) / 2;
    return x;
  }

  std::size_t n_;
  std::vector<Quadruple> l_;
};

Medium hard(double contrast) {
  Medium medium = random_medium({5, 6, 5, 0.5, 0.5, 0.5}, contrast, 1);
  medium.diffusion[medium.block.index(2, 3, 2)] = 0.5 / (3.0 * 100.0);  // optical depth 100
  return medium;
}

class QuadrupleTruth : public ::testing::TestWithParam<diffusion::Precision> {};

// ||x - K^-1 b|| <= ||K^-1|| ||b - K x||, whatever the solver computes in: the residual in float64 is what counts. Half
// as much again for the power method, which finds ||K^-1|| from below, and for the rounding of the residual itself.
TEST_P(QuadrupleTruth, IsAsFarAwayAsTheResidualSaysAtMost) {
  for (const double contrast : {1.0, 1e3, 1e6}) {
    const Medium medium = hard(contrast);
    const QuadrupleFactor factor(medium);
    FieldBatch b(medium.block.cell_count(), 1);
    b.values[medium.block.index(2, 2, 0)] = 1.0;
    FieldBatch phi(b.cells, 1);
    const auto host = host::make_host_solver({2, GetParam()});
    ASSERT_TRUE(host->prepare(medium));
    const auto solved = host->solve(b, phi, {1e-11, 1000}, {});
    ASSERT_TRUE(solved);
    ASSERT_EQ(solved->termination, diffusion::Termination::kConverged) << solved->message;
    const auto exact = factor.solve({b.values.begin(), b.values.end()});
    double off = 0.0;
    for (std::size_t c = 0; c < b.cells; ++c)
      off = std::hypot(off, static_cast<double>(Quadruple(phi.values[c]) - exact[c]));
    EXPECT_LE(off, 1.5 * factor.inverse_norm() * solved->relative_residual)
        << "contrast " << contrast;
    EXPECT_GT(off, 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Host,
                         QuadrupleTruth,
                         ::testing::Values(diffusion::Precision::kHalf,
                                           diffusion::Precision::kSingle,
                                           diffusion::Precision::kDouble),
                         [](const auto& precision) {
                           return std::string(diffusion::to_string(precision.param));
                         });

class ExtremeIndex : public ::testing::TestWithParam<double> {};

// Everything that enters comes out, at both ends of the range of refractive indices.
TEST_P(ExtremeIndex, LosesNoEnergy) {
  const auto boundary = diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, GetParam());
  ASSERT_TRUE(boundary);
  Medium medium = without_absorption(random_medium({8, 8, 8, 0.5, 0.5, 0.5}, 10.0, 7));
  medium.boundary_a = boundary->a;
  const diffusion::FaceSource light(medium, *boundary, Face::kZMin, {});
  const std::vector<double> q(64, 1.0);
  FieldBatch b(medium.block.cell_count(), 1);
  light.deposit(q, b.values);
  FieldBatch phi(b.cells, 1);
  testing_support::DirectSolver direct;
  ASSERT_TRUE(direct.prepare(medium));
  ASSERT_TRUE(direct.solve(b, phi, {}, {}));
  const auto power = light.power(q);
  const auto terms = light.surface_terms(q);
  double out = power.ballistic + power.absorbed_first;
  for (const Face face : kFaces) {
    std::vector<double> flux(medium.block.face_cell_count(face));
    const bool lit = face == Face::kZMin;
    using Values = std::span<const double>;
    diffusion::net_flux(medium,
                        *boundary,
                        face,
                        phi.values,
                        lit ? Values(terms.source) : Values(),
                        lit ? Values(terms.escape) : Values(),
                        flux);
    for (const double f : flux) out += medium.block.face_cell_area(face) * f;
  }
  EXPECT_NEAR(out / power.entered, 1.0, 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Range, ExtremeIndex, ::testing::Values(1.0, 1.05, 2.0, 3.0));

TEST(ExtremeIndices, BeyondTheRangeAreRefused) {
  for (const double ior : {0.9, 3.1, std::numeric_limits<double>::quiet_NaN()}) {
    const auto boundary = diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, ior);
    ASSERT_FALSE(boundary) << ior;
    EXPECT_EQ(boundary.error().code, ErrorCode::kInvalidArgument);
  }
}

Result<InverseResult> invert(const Dataset& dataset, InverseOptions options = {}) {
  options.max_iterations = std::min(options.max_iterations, 20);
  const auto solver = host::make_host_solver({.threads = 2});
  NullSink events;
  const SystemClock clock;
  return reconstruct_material(dataset, options, {*solver, events, clock}, {});
}

void expect_finite(const InverseResult& result) {
  for (const ChannelCoefficients& c : result.material.channels) {
    EXPECT_TRUE(all_finite(c.absorption));
    EXPECT_TRUE(all_finite(c.reduced_scattering));
  }
}

testing_support::SyntheticOptions small(double noise) {
  return {.block = {8, 8, 4, 1.0, 1.0, 1.0}, .regions = 2, .noise = noise};
}

class ExtremeNoise : public ::testing::TestWithParam<double> {};

// The held-out pictures carry the same noise, so the error cannot be less; the grid, twice as coarse as the data's, and
// four regions for the fit add 6 % on this block, where there is no noise at all.
TEST_P(ExtremeNoise, IsNotFitted) {
  const auto result = invert(make_synthetic_dataset(small(GetParam())));
  ASSERT_TRUE(result) << result.error().message;
  expect_finite(*result);
  EXPECT_LE(result->held_out.error, std::hypot(1.15 * result->held_out.noise_floor, 0.075));
}

INSTANTIATE_TEST_SUITE_P(Range, ExtremeNoise, ::testing::Values(0.0, 1e-4, 0.05, 0.2));

TEST(ExtremePictures, AllBlackIsAnAnswerWithinTheBounds) {
  Dataset dataset = make_synthetic_dataset(small(0.01));
  for (Illumination& i : dataset.illuminations) {
    std::ranges::fill(i.radiance.samples(), 0.0F);
    std::ranges::fill(i.radiance_variance.samples(), 1e-12F);
  }
  const auto result = invert(dataset);
  ASSERT_TRUE(result) << result.error().message;
  expect_finite(*result);
}

TEST(ExtremePictures, OneRegionLeftIsEnoughForAnAnswer) {
  Dataset dataset = make_synthetic_dataset(small(0.01));
  int kept = 0;
  for (Illumination& i : dataset.illuminations) {
    if (!i.held_out && kept++ > 0) std::ranges::fill(i.mask.samples(), std::uint8_t{0});
  }
  const auto result = invert(dataset);
  ASSERT_TRUE(result) << result.error().message;
  expect_finite(*result);
}

TEST(ExtremePictures, NoneLeftIsAnErrorThatSaysSo) {
  Dataset dataset = make_synthetic_dataset(small(0.01));
  for (Illumination& i : dataset.illuminations)
    std::ranges::fill(i.mask.samples(), std::uint8_t{0});
  const auto result = invert(dataset);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("every cell is masked"));
}

TEST(ExtremePictures, InfiniteRadianceIsAnErrorThatNamesTheIllumination) {
  Dataset dataset = make_synthetic_dataset(small(0.01));
  dataset.illuminations[2].radiance.at(1, 1, 0) = std::numeric_limits<float>::infinity();
  const auto result = invert(dataset);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(result.error().message, HasSubstr("region_2"));
}

TEST(ExtremePictures, ASampleOneVoxelThickIsFitted) {
  testing_support::SyntheticOptions thin = small(0.01);
  thin.block = {8, 8, 1, 1.0, 1.0, 4.0};
  const auto result = invert(make_synthetic_dataset(thin));
  ASSERT_TRUE(result) << result.error().message;
  expect_finite(*result);
  EXPECT_LE(result->fitted.error, 0.1);  // one cell for a heterogeneous depth
}

}  // namespace
}  // namespace opaline::reconstruct
