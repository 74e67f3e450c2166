#include "reconstruct/error_budget.h"

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/grid_correction.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kMostLights = 4;
constexpr double kLeftByRichardson = 0.25;  // of a correction: what is extrapolated, not computed

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
  CorrectionPower sum;
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const auto problem = make_channel_problem(some, static_cast<int>(c), options, Selection::kAll);
    if (!problem) return problem.error();
    const auto correction =
        grid_correction(*problem, material.channels[c], options.tolerance, solver, stop);
    if (!correction) return correction.error();
    const CorrectionPower of_channel = power(*problem, *correction);
    sum.change += of_channel.change;
    sum.pictures += of_channel.pictures;
  }
  return corrects_grid(options, dataset.block) ? kLeftByRichardson * sum.relative()
                                               : sum.relative();
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
