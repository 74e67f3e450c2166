#pragma once

#include <filesystem>

#include "base/camera_model.h"
#include "base/material.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "gpu/context.h"

namespace opaline::testing {

/// What a session is made up from, without a capture and without a reconstruction.
struct Fabrication {
  Material truth;  ///< makes the pictures
  Material found;  ///< what was "reconstructed"
  CameraModel camera;
  double noise = 0.01;  ///< relative standard deviation of every pixel
  int regions = 2;
  int held_out = 3;                 ///< lights kept from the fit, 0 to 3
  bool held_out_works = true;       ///< false: no pixel of theirs can be used
  int saturated_rows = 0;           ///< of every picture, from the top
  gpu::ContextOptions gpu;          ///< that draws the pictures
  std::string object = "none";      ///< config's preview.object
  std::filesystem::path responses;  ///< stored light transport of the truth, or empty
};

/// A session directory as capture and reconstruction leave it: region pictures under n x n regions
/// and the held-out lights, drawn by the renderer from the truth.
Result<SessionDirectory> fabricate_session(const std::filesystem::path& directory,
                                           const Fabrication& what);

}  // namespace opaline::testing
