#include "config/quality.h"

namespace opaline::config {

void apply(Quality quality, SessionConfig& s) {
  switch (quality) {
    case Quality::kDraft:
      s.capture.patterns.regions = 2;
      s.capture.exposures.ratio = 8.0;
      s.capture.exposures.wanted_snr = 25.0;
      s.capture.exposures.planned_snr = 50.0;
      s.reduction.grid_step = 2.0;
      s.reconstruction.tolerance = 1e-3;
      s.reconstruction.max_iterations = 20;
      s.preview.samples_per_axis = 1;
      s.preview.tolerance = 1e-4;
      s.preview.object_tetrahedra = 1.5e4;
      return;
    case Quality::kStandard:
      return;
    case Quality::kReference:
      s.capture.patterns.regions = 8;
      s.capture.exposures.ratio = 2.0;
      s.capture.exposures.wanted_snr = 100.0;
      s.capture.exposures.planned_snr = 200.0;
      s.reconstruction.tolerance = 1e-6;
      s.reconstruction.max_iterations = 1000;
      s.reconstruction.grid_correction = true;
      s.reconstruction.discrepancy = 0.0;
      s.reconstruction.stalled = 0.002;
      s.preview.samples_per_axis = 4;
      s.preview.tolerance = 1e-8;
      s.preview.object_tetrahedra = 2e5;
      return;
  }
}

}  // namespace opaline::config
