#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/session_directory.h"
#include "capture/capture_options.h"
#include "capture/gradient_sequence.h"
#include "config/rig_config.h"
#include "config/toml.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/reduction.h"

namespace opaline::config {

/// How the pictures of the report are made.
struct PreviewOptions {
  int samples_per_axis = 2;       ///< of each pixel: 2 takes 4 samples a pixel; 1 to 8
  double white_quantile = 0.995;  ///< of the captured picture: what is shown as white; 0.5 to 1
  double tolerance = 1e-6;        ///< of the light's solution in the material; > 0
  /// Shape of an object of the material that is drawn, too (daemon/preview/object_scene.h): a shape's name, or "none".
  std::string object = "torus";
  double object_tetrahedra = 6e4;  ///< that it is cut into, about; 100 to 2e7
};

/// One word for the settings that trade time for accuracy (config/quality.h).
enum class Quality : std::uint8_t { kDraft, kStandard, kReference };
std::string_view to_string(Quality quality);  ///< "draft" | "standard" | "reference"

/// What is measured, by what light.
enum class SessionKind : std::uint8_t {
  kBlock,      ///< a block under a projector: a volume of coefficients
  kLedSphere,  ///< an object in a sphere of lights: scattering parameters of every pixel
};

/// [led_sphere]: how an object in a sphere of lights is captured, and what is asked of its maps.
struct LedSphereOptions {
  capture::GradientOptions capture;
  bool beam = true;                ///< the reference method by a thin beam, where the rig has one
  double ior = 1.4;                ///< of the object; 1.3 to 1.5
  double ior_deviation = 0.0;      ///< how far its index may be off; 0: it is known
  int edge_px = 3;                 ///< pixels along the object's outline that are left out: blur
  double certain = 0.04;           ///< MapOptions::certain
  double sigmas = 2.0;             ///< MapOptions::sigmas
  int largest_window = 32;         ///< pixels on either side
  double lamp_deviation = 0.01;    ///< relative, of each lamp's intensity, independent
  double white_deviation = 0.005;  ///< relative, of all reflectances
  std::filesystem::path
      mesh;  ///< OBJ with texture coordinates that the report draws turned; empty: the seen surface
  double mesh_size_mm = 0.0;  ///< its largest extent; 0: its coordinates are mm
  double turn_deg = 35.0;     ///< of that view, to the right
};

/// A session file with its rig file: all that a session is made from.
struct SessionConfig {
  std::string name = "session";          ///< for people
  Quality quality = Quality::kStandard;  ///< what the settings were taken from that stand nowhere
  /// Relighting error to reach with the cheapest settings that do (reconstruct/target_error.h); 0:
  /// the settings as they are.
  double target_error = 0.0;
  std::filesystem::path rig_file;
  RigConfig rig;
  SessionKind kind = SessionKind::kBlock;
  LedSphereOptions led_sphere;
  std::string sample_name = "sample";
  capture::SampleGeometry sample;
  capture::CaptureOptions capture;
  reconstruct::InverseOptions reconstruction;
  reconstruct::Reduction reduction;  ///< in [reconstruction], too
  std::filesystem::path start;  ///< in [reconstruction], too: maps.exr or material.vdb; none: empty
  bool uncertainty = false;     ///< in [reconstruction]: whether the material's is found, too
  PreviewOptions preview;
};

/// Reads a session file and the rig file it names.
/// Errors: kNotFound when the session file is missing; kInvalidArgument with every problem of both
/// files, one a line: FILE:LINE:COLUMN: what is wrong, and what would be right.
Result<SessionConfig> load_session(const std::filesystem::path& session_file);

/// The same from texts. A relative path in a source without a directory is a problem.
Result<SessionConfig> parse_session(const Source& session, const Source& rig);

/// The rig file alone.
Result<RigConfig> load_rig(const std::filesystem::path& rig_file);

/// Every problem of a file, whether it is a session (then its rig file's, too) or a rig file.
/// Errors: kNotFound, kUnavailable when the file cannot be read.
Result<std::vector<Problem>> check(const std::filesystem::path& file);

/// resolved.toml: every key with its value, in the tables [session] and [rig], paths absolute.
std::string to_toml(const SessionConfig& session);
Result<SessionConfig> parse_resolved(const Source& resolved);
/// From a session directory's resolved.toml.
Result<SessionConfig> load_resolved(const SessionDirectory& session);

/// What a session directory is made from, read from a session file and its rig file.
Result<SessionDirectory::Contents> read_contents(const std::filesystem::path& session_file);

/// The explained files with every key and its default: config/session.example.toml and
/// config/rig.example.toml.
std::string session_example();
std::string rig_example();

}  // namespace opaline::config
