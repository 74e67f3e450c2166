#include <gtest/gtest.h>

#include <random>

#include "reconstruct/diffusion/medium.h"
#include "reconstruct/diffusion/source.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct::diffusion {
namespace {

struct Light {
  SourceOptions options;
  Face face;
};

Medium random_medium(double highest_absorption, const Boundary& boundary) {
  const Block block{9, 7, 6, 0.4, 0.7, 0.5};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> scattering(0.3, 6.0);
  std::uniform_real_distribution<double> absorption(0.0, 1.0);
  ChannelCoefficients c;
  for (std::size_t i = 0; i < block.cell_count(); ++i) {
    c.reduced_scattering.push_back(scattering(random));
    c.absorption.push_back(highest_absorption * absorption(random));
  }
  return make_medium(block, c, boundary);
}

class Energy : public testing::TestWithParam<Light> {
 protected:
  // Everything that leaves or is absorbed, over what entered.
  double balance(double highest_absorption) {
    const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, 1.3);
    const Medium medium = random_medium(highest_absorption, boundary);
    const Block& block = medium.block;
    const FaceSource light(medium, boundary, GetParam().face, GetParam().options);
    std::vector<double> q(block.face_cell_count(GetParam().face), 0.0);
    for (std::size_t f = 0; f < q.size(); f += 3) q[f] = 1.0 + 0.1 * static_cast<double>(f);
    FieldBatch b(block.cell_count(), 1);
    FieldBatch phi(block.cell_count(), 1);
    light.deposit(q, b.values);
    testing_support::DirectSolver solver;
    EXPECT_TRUE(solver.prepare(medium));
    EXPECT_TRUE(solver.solve(b, phi, {}, {}));
    const SourcePower power = light.power(q);
    double out =
        power.ballistic + power.absorbed_first + exitance(medium, boundary, light, q, phi.values);
    for (std::size_t i = 0; i < phi.values.size(); ++i) {
      EXPECT_GE(phi.values[i], 0.0);
      out += block.cell_volume() * medium.absorption[i] * phi.values[i];
    }
    return out / power.entered;
  }

  static double exitance(const Medium& medium,
                         const Boundary& boundary,
                         const FaceSource& light,
                         const std::vector<double>& q,
                         const std::vector<double>& phi) {
    const SurfaceTerms terms = light.surface_terms(q);
    double sum = 0.0;
    for (const Face face : kFaces) {
      const bool lit = face == GetParam().face;
      std::vector<double> flux(medium.block.face_cell_count(face));
      using Values = std::span<const double>;
      net_flux(medium,
               boundary,
               face,
               phi,
               lit ? Values(terms.source) : Values(),
               lit ? Values(terms.escape) : Values(),
               flux);
      for (const double f : flux) sum += medium.block.face_cell_area(face) * f;
      if (!lit || GetParam().options.model == SourceModel::kCollimated) continue;
      for (const double entered : q)
        sum += medium.block.face_cell_area(face) * entered;  // M = q + J_n
    }
    return sum;
  }
};

// To rounding of a direct solve; 1e-5 is asked of the iterative ones.
TEST_P(Energy, ComesOutWhollyWithoutAbsorption) { EXPECT_NEAR(balance(0.0), 1.0, 1e-11); }

TEST_P(Energy, ComesOutOrIsAbsorbed) { EXPECT_NEAR(balance(0.5), 1.0, 1e-11); }

INSTANTIATE_TEST_SUITE_P(
    Sources,
    Energy,
    testing::Values(Light{{SourceModel::kCollimated, Deposit::kCentroid}, Face::kZMin},
                    Light{{SourceModel::kCollimated, Deposit::kCell}, Face::kXMax},
                    Light{{SourceModel::kSurface, Deposit::kCentroid}, Face::kYMax}));

}  // namespace
}  // namespace opaline::reconstruct::diffusion
