#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/dataset.h"
#include "base/events.h"
#include "base/files.h"
#include "base/result.h"
#include "capture/calibration.h"
#include "capture/capture_options.h"
#include "capture/station.h"

namespace opaline::capture {

/// What is to be captured, with what.
struct CaptureTask {
  CaptureOptions options;
  SampleGeometry sample;
  StationCalibration calibration;
};

/// Where the capture works. All outlive the call.
struct Workplace {
  std::filesystem::path directory;  ///< of the session
  FileOperations& files;
  EventSink& events;
  /// Bytes free for files in a directory; none asks the operating system.
  std::function<Result<std::uint64_t>(const std::filesystem::path&)> free_bytes = nullptr;
};

struct CaptureSummary {
  int lights = 0;                     ///< regions and held-out lights
  int taken = 0;                      ///< in this run, black frames not counted
  int retaken = 0;                    ///< times that a light was taken again for a bad frame
  std::vector<std::string> unusable;  ///< lights without one usable cell: clipped, black, uncovered
};

/// Captures a session, or what is left of it: black frames, then every light; frames/, hdr/ and at
/// last the dataset. What lies in the directory whole and undamaged is not taken again, so a
/// capture that was killed or lost its power repeats at most the light it was at, and its HDR and
/// dataset files are those of an undisturbed one, bit for bit, where the devices deliver the same
/// frames. The lamp is dark when it returns.
///
/// A light without one usable cell, clipped even at the shortest exposure or seen by too few good
/// pixels, one that is black while the lamp is seen to work, or one whose exposures do not agree with each other however often it is taken
/// (SteadinessCheck), is masked and the session goes on,
/// until fewer than `usable_share` of the regions can be used. A dead lamp stops it: when a light
/// and the whole picture lit are both black, at every retry. Lights that were taken at other exposures than the black frames,
/// since options or devices have changed, are taken again.
///
/// Facts: capture.planned, region.captured, region.unsteady, region.retaken, region.damaged, region.unusable,
/// capture.completed. Progress: step "capture", detail {light, lights, region, exposure}:
/// "region_1_2", the fifth of 24, exposed for "0.5 s".
/// Errors: kInvalidArgument for options, calibration or geometry, for a camera that is not the
/// calibrated one, and for frames of a newer version; kUnavailable for devices, disk or lamp, with
/// the remedy; kTimeout; kCancelled.
Result<CaptureSummary> capture_session(const CaptureTask& task,
                                       const Station& station,
                                       const Workplace& workplace,
                                       std::stop_token stop);

}  // namespace opaline::capture
