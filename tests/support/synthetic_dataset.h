#pragma once

#include <cstdint>
#include <functional>

#include "base/dataset.h"

namespace opaline::testing_support {

/// sigma_s' and sigma_a at a point of the sample, 1/mm.
struct Coefficients {
  double reduced_scattering = 0.0;
  double absorption = 0.0;
};

/// Pictures of a heterogeneous block that the reconstruction does not make with its own discretisation: solved
/// directly on a grid twice as fine, light put at cell centres, seen along the normal, averaged over 2 x 2 cells.
struct SyntheticOptions {
  Block block{12, 12, 6, 1.0, 1.0, 1.0};  ///< of the dataset
  int regions = 3;                        ///< n x n regions of the lit face z_min, to fit
  double noise = 0.01;  ///< relative standard deviation; also a floor of 1e-3 of the brightest
  bool heterogeneous = true;
  bool layered =
      false;  ///< when not heterogeneous: the half at the camera scatters half and absorbs three times as much
  std::uint32_t seed = 1;
  double ior = 1.3;
  /// In place of synthetic_coefficients(), where given.
  std::function<Coefficients(Vec3 point, int channel)> coefficients{};
};

/// n x n regions for the fit, and (n-1) x (n-1) regions shifted by half, held out. Three channels of different magnitude.
Dataset make_synthetic_dataset(const SyntheticOptions& options);

Coefficients synthetic_coefficients(const SyntheticOptions& options, Vec3 point, int channel);

}  // namespace opaline::testing_support
