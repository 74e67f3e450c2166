#pragma once

#include <initializer_list>
#include <string_view>
#include <vector>

#include "capture/capture_options.h"
#include "config/fields.h"
#include "config/rig_config.h"
#include "config/toml.h"

namespace opaline::config {

/// What a session and its rig must agree on, so that what is impossible on this station is told
/// before anything is lit: reported in the session file, where the key stands that can be changed.
/// What the rig's own problems leave unknown is not judged.
///
/// Each visit comes last in its table.
class Agreement {
 public:
  /// Both outlive us.
  Agreement(const RigConfig& rig, const std::vector<Problem>& rig_problems)
      : rig_(rig), rig_problems_(rig_problems) {}

  /// In [sample]: the simulated sample and its faces, the projector's reach, the camera's view.
  void visit_sample(Fields& fields, const capture::SampleGeometry& sample);
  /// In [capture], after visit_sample(): regions no smaller than a pixel.
  void visit_patterns(Fields& fields,
                      const capture::PatternOptions& patterns,
                      const capture::SampleGeometry& sample) const;
  /// In [capture.exposures]: what camera and colour wheel can expose.
  void visit_exposures(Fields& fields, const capture::ExposureOptions& exposures) const;

 private:
  bool knows(std::initializer_list<std::string_view> rig_tables) const;
  void visit_simulated(Fields& fields, const capture::SampleGeometry& sample) const;
  const RigConfig& rig_;
  const std::vector<Problem>& rig_problems_;
  bool covers_face_ = false;  // the projector, the lit face
};

}  // namespace opaline::config
