#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "base/light_sphere.h"
#include "capture/capture_options.h"
#include "capture/sequence.h"
#include "capture/stage_patterns.h"

namespace opaline::capture {

/// How an object is captured in a sphere of lights.
struct GradientOptions {
  StagePatternOptions patterns;
  bool check_lamps =
      true;  ///< light each lamp alone first, and go on without those that do not shine
  double object_threshold =
      0.02;  ///< of a white surface's radiance: what is brighter is the object; 0 to 1 (excluded)
  double drift_limit = 0.01;  ///< relative, of the lamps from first to last picture; > 0
  double object_depth_mm =
      0.0;  ///< of its outline's plane before the sphere's middle, towards the camera
};
Result<void> validate(const GradientOptions& options);

struct GradientTask {
  CaptureOptions options;  ///< exposures, retries, settle_periods
  GradientOptions gradient;
  CameraCalibration camera;  ///< its pose is in the sphere's frame
  std::vector<SphereLight> lights;
  double depolarised = 0.5;  ///< share of depolarised light that passes the crossed polarisers
  bool beam = false;         ///< the last of `lights` is a thin beam, which is photographed alone
};

struct GradientSummary {
  int pictures = 0;
  int taken = 0;  ///< in this run
  int retaken = 0;
  std::vector<int> dead_lamps;  ///< that were not known to be
  double drift = 0.0;           ///< relative
};

/// Captures an object in a sphere of lights, or what is left of it: black, "constant", the gradients, "constant_parallel", "beam", "constant_again" (stage_patterns.h), each in
/// HDR with proof of its pattern (RegionTaker): frames/, hdr/, and at last light_stage.json. The first picture tells where the object is; from
/// then on only its pixels decide how long to expose. Lamps are taken to drift evenly from the first picture to the last, and the record
/// says by how much each is brighter. Resumes as capture_session does.
///
/// Lamps that do not shine (lamp_check.h) are looked for first, once a session (lamps.json); the patterns then do without them, and the record
/// says that they are dark.
///
/// The station's projector is the stage (StageProjector). Facts: as capture_session, "stage.lamps" {tried, dead}, "stage.drift" {drift, limit} beyond the limit.
/// Errors: as capture_session; kUnavailable when nothing is seen (lamps, lens cap, polariser), and when the lamps drift by more than ten
/// times the limit.
Result<GradientSummary> capture_gradients(const GradientTask& task,
                                          const Station& station,
                                          const Workplace& workplace,
                                          std::stop_token stop);

}  // namespace opaline::capture
