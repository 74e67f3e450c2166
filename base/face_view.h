#pragma once

#include "base/block.h"
#include "base/image.h"

namespace opaline {

/// How a camera sees the cells of a face, from their centres.
struct FaceView {
  Image<float> cosine;  ///< 1 channel: of the camera to the outward normal; < 0 behind the face
  Image<float>
      direction;  ///< 2 channels: of the unit vector to the camera, along the face's column and row axes
};

/// `eye` is the camera's centre in the sample's frame, mm.
FaceView view_of_face(const Block& block, Face face, Vec3 eye);

}  // namespace opaline
