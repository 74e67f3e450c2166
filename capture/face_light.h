#pragma once

#include <cstdint>
#include <memory>

#include "base/block.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/calibration.h"

namespace opaline::capture {

/// A rectangle on the lit face, mm from the corner where its raster begins.
struct LitRectangle {
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;
  double height = 0.0;
};

/// Which pixels of a projector light which part of the sample's lit face, and with what irradiance.
///
/// Threads: one at a time.
class FaceLight {
 public:
  virtual ~FaceLight() = default;
  /// Whether the projector reaches all of a rectangle, and with pixels no larger than it. Errors: kInvalidArgument.
  virtual Result<void> check(const LitRectangle& rectangle) const = 0;
  /// 1 where a pixel's light falls on the rectangle, which has been checked: whole pixels, those whose middle lies in it.
  virtual Image<std::uint8_t> pixels_on(const LitRectangle& rectangle) const = 0;
  /// On the face's cells while the projector shows `codes`, less that of code 0, W/mm^2: each pixel's light, shared among cells by
  /// the area that it covers of each (exact overlap).
  virtual Image<float> irradiance(const Image<std::uint8_t>& codes) const = 0;
};

/// By ProjectorCalibration::kind.
std::unique_ptr<FaceLight> make_face_light(const Block& block,
                                           Face lit_face,
                                           const ProjectorCalibration& projector);

/// Through the projector's lens, from where it stands: a rectangle is a quadrilateral with bent sides in its picture.
std::unique_ptr<FaceLight> make_perspective_light(const Block& block,
                                                  Face lit_face,
                                                  const ProjectorCalibration& projector);

}  // namespace opaline::capture
