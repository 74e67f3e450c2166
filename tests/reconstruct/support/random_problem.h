#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "reconstruct/channel_problem.h"

namespace opaline::reconstruct::testing_problem {

struct Case {
  const char* name;
  diffusion::SourceModel source;
  diffusion::Deposit deposit;
  Face lit;
  Face seen;
  double regularization;
  Smoothness regularizer = Smoothness::kH1;
  CameraLaw camera = CameraLaw::kSurface;
};

inline std::string case_name(const ::testing::TestParamInfo<Case>& info) { return info.param.name; }

inline ChannelCoefficients random_medium(std::size_t cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> scattering(0.5, 4.0);
  std::uniform_real_distribution<double> absorption(0.005, 0.2);
  ChannelCoefficients c;
  for (std::size_t i = 0; i < cells; ++i) {
    c.reduced_scattering.push_back(scattering(random));
    c.absorption.push_back(absorption(random));
  }
  return c;
}

/// Two illuminations of a 6 x 5 x 4 block of anisotropic cells, seen obliquely, with random data,
/// weights and mask.
inline ChannelProblem random_problem(const Case& c) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.2, 1.0);
  ChannelProblem problem{
      .block = {6, 5, 4, 0.5, 0.6, 0.4},
      .lit_face = c.lit,
      .seen_face = c.seen,
      .boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3),
      .source = {c.source, c.deposit},
      .camera = {},
      .rays = {},
      .illuminations = std::vector<ChannelIllumination>(2),
      .data_count = 0};
  const std::size_t seen = problem.block.face_cell_count(c.seen);
  for (std::size_t x = 0; x < seen; ++x) {
    problem.camera.push_back(diffusion::camera_equation(1.3, problem.boundary, uniform(random)));
  }
  for (std::size_t x = 0; c.camera == CameraLaw::kRefractedRay && x < seen; ++x)
    problem.rays.push_back(
        diffusion::camera_ray(1.3, uniform(random) - 0.6, uniform(random) - 0.6));
  for (ChannelIllumination& i : problem.illuminations) {
    for (std::size_t x = 0; x < problem.block.face_cell_count(c.lit); ++x) {
      i.irradiance.push_back(uniform(random) > 0.5 ? uniform(random) : 0.0);
    }
    for (std::size_t x = 0; x < seen; ++x) {
      i.radiance.push_back(0.02 * uniform(random));
      i.weight.push_back(uniform(random) > 0.3 ? 1e3 * uniform(random) : 0.0);
    }
  }
  return problem;
}

inline constexpr auto kCollimated = diffusion::SourceModel::kCollimated;
inline constexpr auto kSurface = diffusion::SourceModel::kSurface;
inline constexpr auto kCentroid = diffusion::Deposit::kCentroid;
inline constexpr auto kCell = diffusion::Deposit::kCell;

/// Every way for light to enter and to be seen.
inline const auto kEveryLight = ::testing::Values(
    Case{"BackLitCentroid", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 0.0},
    Case{"BackLitCell", kCollimated, kCell, Face::kZMin, Face::kZMax, 0.0},
    Case{"BackLitSurface", kSurface, kCentroid, Face::kZMin, Face::kZMax, 0.0},
    Case{"FrontLitCentroid", kCollimated, kCentroid, Face::kZMax, Face::kZMax, 0.0},
    Case{"FrontLitCell", kCollimated, kCell, Face::kZMax, Face::kZMax, 0.0},
    Case{"FrontLitSurface", kSurface, kCentroid, Face::kZMax, Face::kZMax, 0.0},
    Case{"FromTheSide", kCollimated, kCentroid, Face::kXMax, Face::kYMin, 0.0},
    Case{"Regularized", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 2.0},
    Case{"TotalVariation",
         kCollimated,
         kCentroid,
         Face::kZMin,
         Face::kZMax,
         2.0,
         Smoothness::kTotalVariation});

/// The same seen along refracted rays.
inline const auto kEveryLightAlongRays = ::testing::Values(Case{"BackLitRays",
                                                                kCollimated,
                                                                kCentroid,
                                                                Face::kZMin,
                                                                Face::kZMax,
                                                                0.0,
                                                                Smoothness::kH1,
                                                                CameraLaw::kRefractedRay},
                                                           Case{"FrontLitRays",
                                                                kCollimated,
                                                                kCentroid,
                                                                Face::kZMax,
                                                                Face::kZMax,
                                                                0.0,
                                                                Smoothness::kH1,
                                                                CameraLaw::kRefractedRay},
                                                           Case{"FrontLitSurfaceRays",
                                                                kSurface,
                                                                kCentroid,
                                                                Face::kZMax,
                                                                Face::kZMax,
                                                                0.0,
                                                                Smoothness::kH1,
                                                                CameraLaw::kRefractedRay},
                                                           Case{"FromTheSideRays",
                                                                kCollimated,
                                                                kCentroid,
                                                                Face::kXMax,
                                                                Face::kYMin,
                                                                0.0,
                                                                Smoothness::kH1,
                                                                CameraLaw::kRefractedRay});

}  // namespace opaline::reconstruct::testing_problem
