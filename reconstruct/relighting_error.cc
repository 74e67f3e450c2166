#include "reconstruct/relighting_error.h"

#include <cmath>

namespace opaline::reconstruct {
namespace {

struct Sums {
  double misfit = 0.0;
  double power = 0.0;
  double noise = 0.0;

  void add(const Illumination& measured, const Image<float>& predicted) {
    for (std::size_t s = 0; s < measured.radiance.samples().size(); ++s) {
      if (measured.mask.samples()[s / kColorChannels] == 0) continue;
      const double l = measured.radiance.samples()[s];
      const double difference = predicted.samples()[s] - l;
      misfit += difference * difference;
      power += l * l;
      noise += measured.radiance_variance.samples()[s];
    }
  }
  RelightingError error() const {
    if (!(power > 0.0)) return {};
    return {std::sqrt(misfit / power), std::sqrt(noise / power)};
  }
};

}  // namespace

RelightingError relighting_error(const Illumination& measured, const Image<float>& predicted) {
  Sums sums;
  sums.add(measured, predicted);
  return sums.error();
}

RelightingError relighting_error(const Dataset& dataset,
                                 const std::vector<Image<float>>& predicted,
                                 bool held_out) {
  Sums sums;
  for (std::size_t m = 0; m < predicted.size(); ++m) {
    if (dataset.illuminations[m].held_out == held_out)
      sums.add(dataset.illuminations[m], predicted[m]);
  }
  return sums.error();
}

}  // namespace opaline::reconstruct
