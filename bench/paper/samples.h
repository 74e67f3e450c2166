#pragma once

#include <string>

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"
#include "base/transport_responses.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "sim/scene.h"

namespace opaline::bench {

/// A synthetic sample of the paper's kind and its light transport by finite elements, for every n x n that is asked for.
struct PaperSample {
  std::string name;
  sim::SceneOptions scene;
  Material truth;
};
Result<PaperSample> make_sample(std::string name, const sim::SceneOptions& scene);

/// The transport of patches x patches, from the cache or computed (bench/inverse/finite_elements.h) and put there.
Result<TransportResponses> elements_of(const PaperSample& sample, int patches);

/// Pictures under n x n regions, n a divisor of 8 or any other number; 1 % noise unless told otherwise, none held out.
Result<Dataset> measurements(const PaperSample& sample, int n, double noise);

/// E = sum (R' - R)^2 / sum R^2 over 8 x 8 patches, every cell of the seen face and the channels (Wang 2008, section 6.1).
Result<double> bssrdf_error(const PaperSample& sample,
                            const Material& material,
                            reconstruct::diffusion::FluenceSolver& solver);

}  // namespace opaline::bench
