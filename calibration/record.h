#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/camera_model.h"
#include "base/result.h"
#include "calibration/color_correction.h"
#include "capture/calibration.h"

namespace opaline::calibration {

/// The steps in the order that they must be done: each believes what those before it found.
inline constexpr std::array<std::string_view, 6> kSteps{
    "warm_up", "black_level", "linearity", "radiometric", "geometry", "check"};
/// Done only where the rig file has a board.
inline constexpr std::string_view kGeometryStep = "geometry";
/// Steps that are done when asked for, once all of kSteps are accepted: sessions do without.
inline constexpr std::array<std::string_view, 1> kExtraSteps{"colour"};
/// Place of a step in kSteps, kExtraSteps behind them. Errors: kInvalidArgument listing them.
Result<std::size_t> step_index(std::string_view name);

/// One figure that a step must keep to be accepted: value <= limit.
struct Gate {
  std::string name;  ///< "swapped channels": what is wrong when it fails
  double value = 0.0;
  double limit = 0.0;
  std::string unit;
  std::string remedy;  ///< what to do when it fails

  bool passed() const { return value <= limit; }  // false for NaN
};

/// What a step did.
struct StepRecord {
  std::string step;
  std::string finished;  ///< UTC
  std::vector<Gate> gates;
  nlohmann::json values = nlohmann::json::object();  ///< figures for people and for comparing

  bool accepted() const;
};

/// A camera or projector, so that a calibration is not used with another.
struct DeviceIdentity {
  std::string model;
  std::string serial;
  int width = 0;
  int height = 0;
  int bit_depth = 0;  ///< of a camera
  bool operator==(const DeviceIdentity&) const = default;
};

/// A lens as measured: its place, and the standard deviations of fx fy cx cy k1 k2 p1 p2 k3.
struct MeasuredLens {
  CameraModel
      model;  ///< camera_from_sample: of a projector, projector_from_camera; of a camera, the identity
  std::array<double, 9> deviation{};
};

/// What the steps have measured so far; a step sets what it finds.
struct Measured {
  std::optional<double> black_level;  ///< code without light
  std::array<double, 3> black_of_channels{};
  double dark_codes_per_second = 0.0;
  std::vector<std::pair<int, int>> hot_pixels;  ///< (x, y)
  std::optional<double> clipping_code;
  std::optional<capture::ResponseCurve> response;
  std::optional<double> projector_gamma;
  std::optional<double> projector_black;  ///< light at code 0, as a share of that at 255
  std::optional<double> gain_electrons_per_code;
  std::optional<double> read_noise_electrons;
  std::optional<ColorCorrection> color;                   ///< of light above black, in any unit
  std::vector<capture::ExposureFactor> exposure_factors;  ///< empty: the camera reports them right
  std::optional<MeasuredLens> camera_lens;
  std::optional<MeasuredLens> projector_lens;
  std::optional<capture::Vignetting> camera_vignetting;
  std::optional<capture::Vignetting> projector_vignetting;
};

enum class RecordState : std::uint8_t { kIncomplete, kRefused, kAccepted };
std::string_view to_string(RecordState state);

/// One calibration of a station: what was measured, by which steps, and whether it may be used. Never changed once it is
/// accepted.
struct Record {
  static constexpr int kFormat = 1;

  int version = 0;  ///< 1, 2, ... of the station
  std::string station;
  std::string created;  ///< UTC
  std::string program;  ///< what made it
  DeviceIdentity camera;
  DeviceIdentity projector;
  std::vector<StepRecord> steps;  ///< in order; the first ones of kSteps, then extra ones
  Measured measured;

  const StepRecord* find(std::string_view step) const;
  /// The step's record anew, in its place, and none of those after it, which rested on the old one; but a warm-up changes nothing that
  /// they found.
  void put(StepRecord step);
  RecordState state() const;
  /// The largest of value / limit over all gates: 1 and more is refused; infinite without any.
  double margin() const;
};

/// JSON, with its format; the same record gives the same text.
std::string to_text(const Record& record);
/// Errors: kInvalidArgument for what is damaged, saying where, or written by a newer version.
Result<Record> record_from_text(std::string_view text, const std::string& file);

}  // namespace opaline::calibration
