#include "reconstruct/error_budget.h"

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/prediction.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kMostLights = 4;

struct Sums {
  double misfit = 0.0;
  double noise = 0.0;
  double calibration = 0.0;
  double power = 0.0;

  void add(const Illumination& measured, const Image<float>& predicted) {
    for (std::size_t s = 0; s < measured.radiance.samples().size(); ++s) {
      if (measured.mask.samples()[s / kColorChannels] == 0) continue;
      const double l = measured.radiance.samples()[s];
      misfit += std::pow(predicted.samples()[s] - l, 2);
      const double variance = measured.radiance_variance.samples()[s];
      noise += (1.0 - measured.calibration_share) * variance;
      calibration += measured.calibration_share * variance;
      power += l * l;
    }
  }
};

double root_of_excess(double squares, double part) {
  return std::sqrt(std::max(squares - part * part, 0.0));
}

// Each sample becomes 2 x 2 of the same value.
template <class T>
Image<T> refined(const Image<T>& image) {
  Image<T> fine(2 * image.width(), 2 * image.height(), image.channels());
  for (int y = 0; y < fine.height(); ++y)
    for (int x = 0; x < fine.width(); ++x)
      for (int c = 0; c < fine.channels(); ++c) fine.at(x, y, c) = image.at(x / 2, y / 2, c);
  return fine;
}

Block refined(const Block& b) {
  return {2 * b.nx, 2 * b.ny, 2 * b.nz, b.hx / 2.0, b.hy / 2.0, b.hz / 2.0};
}

std::vector<double> refined(const Block& block, const std::vector<double>& field) {
  const Block fine = refined(block);
  std::vector<double> out;
  for (int k = 0; k < fine.nz; ++k)
    for (int j = 0; j < fine.ny; ++j)
      for (int i = 0; i < fine.nx; ++i) out.push_back(field[block.index(i / 2, j / 2, k / 2)]);
  return out;
}

Material refined(const Material& material) {
  Material fine;
  fine.block = refined(material.block);
  fine.ior = material.ior;
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const ChannelCoefficients& of = material.channels[c];
    fine.channels[c] = {refined(material.block, of.absorption),
                        refined(material.block, of.reduced_scattering)};
  }
  return fine;
}

Dataset refined(Dataset dataset) {
  dataset.block = refined(dataset.block);
  dataset.view_cosine = refined(dataset.view_cosine);
  dataset.view_direction = refined(dataset.view_direction);
  for (Illumination& i : dataset.illuminations) {
    i.irradiance = refined(i.irradiance);
    i.radiance = refined(i.radiance);
    i.radiance_variance = refined(i.radiance_variance);
    i.mask = refined(i.mask);
  }
  return dataset;
}

// Means over 2 x 2.
Image<float> coarsened(const Image<float>& fine) {
  Image<float> image(fine.width() / 2, fine.height() / 2, fine.channels());
  for (int y = 0; y < fine.height(); ++y)
    for (int x = 0; x < fine.width(); ++x)
      for (int c = 0; c < fine.channels(); ++c)
        image.at(x / 2, y / 2, c) += 0.25F * fine.at(x, y, c);
  return image;
}

Dataset some_held_out(Dataset dataset) {
  std::erase_if(dataset.illuminations, [](const Illumination& i) { return !i.held_out; });
  if (dataset.illuminations.size() > kMostLights) dataset.illuminations.resize(kMostLights);
  return dataset;
}

}  // namespace

double ErrorBudget::sum() const {
  return std::sqrt(noise * noise + calibration * calibration + model * model +
                   discretisation * discretisation + undetermined * undetermined);
}

std::optional<ErrorBudget> error_budget(const Dataset& dataset,
                                        const std::vector<Image<float>>& predicted,
                                        double discretisation,
                                        double held_out_variance) {
  ENSURE(predicted.size() == dataset.illuminations.size());
  Sums fitted;
  Sums held_out;
  for (std::size_t m = 0; m < dataset.illuminations.size(); ++m) {
    const Illumination& i = dataset.illuminations[m];
    (i.held_out ? held_out : fitted).add(i, predicted[m]);
  }
  if (!(fitted.power > 0.0 && held_out.power > 0.0)) return std::nullopt;
  ErrorBudget budget;
  budget.measured = std::sqrt(held_out.misfit / held_out.power);
  budget.noise = std::sqrt(held_out.noise / held_out.power);
  budget.calibration = std::sqrt(held_out.calibration / held_out.power);
  budget.discretisation = discretisation;
  budget.model = root_of_excess((fitted.misfit - fitted.noise - fitted.calibration) / fitted.power,
                                discretisation);
  budget.undetermined = std::sqrt(held_out_variance / held_out.power);
  return budget;
}

Result<double> discretisation_error(const Dataset& dataset,
                                    const Material& material,
                                    const InverseOptions& options,
                                    diffusion::FluenceSolver& solver,
                                    std::stop_token stop) {
  const Dataset some = some_held_out(dataset);
  if (some.illuminations.empty())
    return invalid_argument("no light was held out; expected one to judge the grid by");
  const auto coarse = predict(some, material, options, solver, stop);
  if (!coarse) return coarse.error();
  const auto fine = predict(refined(some), refined(material), options, solver, std::move(stop));
  if (!fine) return fine.error();
  double change = 0.0;
  double power = 0.0;
  for (std::size_t m = 0; m < fine->size(); ++m) {
    const Image<float> mean = coarsened((*fine)[m]);
    for (std::size_t s = 0; s < mean.samples().size(); ++s) {
      if (some.illuminations[m].mask.samples()[s / kColorChannels] == 0) continue;
      change += std::pow((*coarse)[m].samples()[s] - mean.samples()[s], 2);
      power += std::pow(mean.samples()[s], 2);
    }
  }
  return power > 0.0 ? 4.0 / 3.0 * std::sqrt(change / power) : 0.0;
}

Result<std::optional<ChannelProblem>> held_out_problem(const Dataset& dataset,
                                                       int channel,
                                                       const InverseOptions& options) {
  auto problem = make_channel_problem(dataset, channel, options, Selection::kHeldOut);
  if (!problem) return problem.error();
  if (problem->data_count == 0) return std::optional<ChannelProblem>();
  for (ChannelIllumination& i : problem->illuminations)
    for (double& w : i.weight) w = w > 0.0 ? 1.0 : 0.0;
  return std::optional(*std::move(problem));
}

}  // namespace opaline::reconstruct
