#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/parametrization.h"

namespace opaline::reconstruct {

/// One model of a sample: what may vary in it.
struct ModelRung {
  Model model = Model::kHomogeneous;  ///< never kAuto
  std::string name;  ///< "homogeneous", "layered", "heterogeneous, a node every 4 cells"
  Parametrization parametrization;
};

/// The models a choice climbs through, from the simplest: each holds the one before.
///   kAuto           homogeneous, layered, heterogeneous with a node every 4 cells along the lit face (every cell in
///                   depth), every cell; what is no finer than the one before is left out
///   kHomogeneous    that alone
///   kLayered        homogeneous, layered
///   kHeterogeneous  homogeneous, every cell
std::vector<ModelRung> models_to_try(Model choice, const Block& block, Face lit_face);

/// How a model explains some illuminations, in the units of the objective: chi^2 = sum w (L - L*)^2, w = 1 / (measured
/// variance + that of the model's error).
struct Misfit {
  struct Picture {
    double chi_squared = 0.0;
    std::size_t count = 0;         ///< of data
    std::vector<double> radiance;  ///< L, as the model has it
  };
  std::vector<Picture> pictures;  ///< one an illumination

  /// chi^2 per datum: 1 where noise and the model's error are what the weights say.
  double per_datum() const;
  /// Of that, by the scatter between illuminations, whose data are correlated within a picture; never below what
  /// independent data of variance 1 have, sqrt(2 / N).
  double standard_error() const;
};
Misfit misfit(const ChannelProblem& problem, std::vector<std::vector<double>> radiance);

/// Whether a misfit is what noise and the model's error make by themselves: at most one standard error above 1.
bool is_explained(const Misfit& misfit);

/// What a finer model gains: the fall of chi^2 per datum over the same illuminations, pairwise,
///
///   g = sum_m D_m / sum_m N_m,   D_m = chi^2_m(simpler) - chi^2_m(finer)
///
/// with the larger of two standard errors, so that few illuminations cannot pretend to certainty: that of a ratio
/// estimated from blocks (Cochran, Sampling Techniques, 1977, sec. 6.4), M/(M-1) sum_m (D_m - g N_m)^2 / (sum N)^2, and
/// that of independent data of variance 1/w, 4 sum w (L_simpler - L_finer)^2 / (sum N)^2.
struct Gain {
  double per_datum = 0.0;
  double standard_error = 0.0;
  /// The one-standard-error rule (Breiman et al., Classification and Regression Trees, 1984, sec. 3.4.3).
  bool is_significant() const { return per_datum > standard_error; }
};
Gain gain(const ChannelProblem& problem, const Misfit& simpler, const Misfit& finer);

}  // namespace opaline::reconstruct
