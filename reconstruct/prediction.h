#pragma once

#include <stop_token>
#include <vector>

#include "base/dataset.h"
#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// The radiance that a material sends towards the camera under one channel of every illumination of the dataset,
/// held-out ones too; writes that channel of `pictures` (one a illumination, over the seen face, three channels).
/// The dataset's pictures and masks are not used; of the options, the model, the tolerance and whether the grid is corrected
/// for (corrects_grid()).
Result<void> predict_channel(const Dataset& dataset,
                             const ChannelCoefficients& coefficients,
                             int channel,
                             const InverseOptions& options,
                             diffusion::FluenceSolver& solver,
                             std::vector<Image<float>>& pictures,
                             std::stop_token stop);

/// All three channels of a material on the dataset's block.
Result<std::vector<Image<float>>> predict(const Dataset& dataset,
                                          const Material& material,
                                          const InverseOptions& options,
                                          diffusion::FluenceSolver& solver,
                                          std::stop_token stop);

/// Black pictures of the right shape, one an illumination.
std::vector<Image<float>> empty_pictures(const Dataset& dataset);

}  // namespace opaline::reconstruct
