#include "reconstruct/prediction.h"

#include "reconstruct/channel_problem.h"
#include "reconstruct/grid_correction.h"
#include "reconstruct/objective.h"

namespace opaline::reconstruct {
namespace {

using Radiances = std::vector<std::vector<double>>;  // per illumination on the seen face's cells

Result<Radiances> radiances(const ChannelProblem& problem,
                            const ChannelCoefficients& coefficients,
                            const InverseOptions& options,
                            diffusion::FluenceSolver& solver,
                            const std::stop_token& stop) {
  if (!corrects_grid(options, problem.block))
    return Objective(problem, solver, {options.tolerance, 0.0}).predict(coefficients, stop);
  auto found = grid_correction(problem, coefficients, options.tolerance, solver, stop);
  if (!found) return found.error();
  Radiances sum = std::move(found->predicted);
  for (std::size_t m = 0; m < sum.size(); ++m)
    for (std::size_t x = 0; x < sum[m].size(); ++x) sum[m][x] += found->change[m][x];
  return sum;
}

}  // namespace

Result<void> predict_channel(const Dataset& dataset,
                             const ChannelCoefficients& coefficients,
                             int channel,
                             const InverseOptions& options,
                             diffusion::FluenceSolver& solver,
                             std::vector<Image<float>>& pictures,
                             std::stop_token stop) {
  const auto problem = make_channel_problem(dataset, channel, options, Selection::kAll);
  if (!problem) return problem.error();
  const auto radiance = radiances(*problem, coefficients, options, solver, stop);
  if (!radiance) return radiance.error();
  for (std::size_t m = 0; m < radiance->size(); ++m) {
    for (std::size_t x = 0; x < (*radiance)[m].size(); ++x) {
      pictures[m].samples()[x * kColorChannels + channel] = static_cast<float>((*radiance)[m][x]);
    }
  }
  return ok();
}

Result<std::vector<Image<float>>> predict(const Dataset& dataset,
                                          const Material& material,
                                          const InverseOptions& options,
                                          diffusion::FluenceSolver& solver,
                                          std::stop_token stop) {
  if (!(material.block == dataset.block))
    return invalid_argument("material and dataset have different blocks");
  std::vector<Image<float>> pictures = empty_pictures(dataset);
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const auto& coefficients = material.channels[static_cast<std::size_t>(channel)];
    auto done = predict_channel(dataset, coefficients, channel, options, solver, pictures, stop);
    if (!done) return done.error();
  }
  return pictures;
}

std::vector<Image<float>> empty_pictures(const Dataset& dataset) {
  const int width = dataset.block.face_width(dataset.seen_face);
  const int height = dataset.block.face_height(dataset.seen_face);
  return std::vector<Image<float>>(dataset.illuminations.size(),
                                   Image<float>(width, height, kColorChannels));
}

}  // namespace opaline::reconstruct
