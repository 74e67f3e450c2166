#include "config/session_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "base/ensure.h"
#include "base/files.h"
#include "config/agreement.h"
#include "config/block_fields.h"
#include "config/quality.h"
#include "config/rig_text.h"

namespace opaline::config {
namespace {

namespace fs = std::filesystem;
using reconstruct::InverseOptions;

/// How light enters, as the file has it.
enum class LightEntry : std::uint8_t { kAuto, kCollimated, kSurface };
constexpr std::array<std::string_view, 3> kSourceNames{"auto", "collimated", "surface"};
constexpr std::array<std::string_view, 2> kDepositNames{"centroid", "cell"};
constexpr std::array<std::string_view, 4> kBoundaryNames{
    "two_moment", "jensen", "keijzer", "milne"};
constexpr std::array<std::string_view, 2> kCameraNames{"refracted_ray", "surface"};
constexpr std::array<std::string_view, 2> kKindNames{"block", "led_sphere"};
constexpr std::array<std::string_view, 3> kExposureNames{"bracket", "planned", "fixed"};
constexpr std::array<std::string_view, 2> kPatternNames{"shifted", "split"};
constexpr std::array<std::string_view, 3> kQualityNames{"draft", "standard", "reference"};
constexpr std::array<std::string_view, 2> kStructureNames{"separate", "shared"};
constexpr std::array<std::string_view, 4> kModelNames{
    "auto", "homogeneous", "layered", "heterogeneous"};
constexpr std::array<std::string_view, 3> kMethodNames{"lbfgs", "gauss_newton", "as_published"};
constexpr std::array<std::string_view, 2> kSmoothnessNames{"h1", "tv"};
constexpr std::array<std::string_view, 3> kPrecisionNames{"half", "single", "double"};
constexpr std::array<std::string_view, 7> kObjectNames{
    "none", "sphere", "torus", "genus3", "knot", "figurine", "sheet"};
constexpr std::array<std::string_view, 4> kBackEndNames{"auto", "host", "vulkan", "reference"};

void visit_sample(Fields& fields, SessionConfig& session) {
  capture::SampleGeometry& sample = session.sample;
  fields.text({"name", "what it is"}, session.sample_name);
  visit_block(fields, sample.block);
  fields.number({"ior", "relative refractive index"}, sample.ior, Range::between(1, 3));
  visit_face(fields, {"lit_face", "where the projector's light enters"}, sample.lit_face);
  visit_face(fields, {"seen_face", "what the camera looks at"}, sample.seen_face);
}

void visit_exposures(Fields& fields, capture::ExposureOptions& e) {
  fields.one_of({"mode", "planned: least time by the camera's noise; fixed: all exposures"},
                e.mode,
                kExposureNames);
  fields.duration({"shortest", "is rounded to whole turns of the colour wheel"}, e.shortest);
  fields.duration({"longest", ""}, e.longest);
  fields.check(e.longest >= e.shortest, "longest", "expected at least shortest");
  fields.number({"ratio", "each exposure over the one before"},
                e.ratio,
                Range{.min = 1.0, .max = 16.0, .min_excluded = true});
  fields.number({"wanted_snr", "bracket: of a dark pixel on the sample; longer until it is met"},
                e.wanted_snr,
                Range::above(0));
  fields.number(
      {"dark_quantile", "which pixel counts as dark"}, e.dark_quantile, Range::between(0, 0.5));
  fields.number(
      {"planned_snr", "planned: of surface cells, each channel"}, e.planned_snr, Range::above(0));
  fields.number({"planned_share", "planned: of the cells that must have it"},
                e.planned_share,
                Range{.min = 0.0, .max = 1.0, .min_excluded = true});
  fields.number({"dim_share", "planned: of the brightest cells; darker ones need only its noise"},
                e.dim_share,
                Range::between(0, 1));
}

void visit_capture(Fields& fields, SessionConfig& session, const Agreement* agreement) {
  capture::CaptureOptions& c = session.capture;
  fields.whole({"regions", "n: the lit face is lit in n x n regions"},
               c.patterns.regions,
               Range::between(1, 32));
  fields.whole({"held_out_lights", "kept from the fit: shifted by half a region, larger, smaller"},
               c.patterns.held_out_lights,
               Range::between(0, 8));
  fields.flag(
      {"uniform_light",
       "the whole face at once, too, where the lit face is seen: tells its surface's reflectance"},
      c.patterns.uniform_light);
  fields.whole(
      {"uniform_light_code", "the projector's for it: lit cells are far brighter than others"},
      c.patterns.uniform_light_code,
      Range::between(1, 255));
  fields.check(!c.patterns.uniform_light || session.sample.lit_face == session.sample.seen_face,
               "uniform_light",
               "expected false where the lit face is not the seen one");
  fields.whole({"retries", "of a region after a bad frame"}, c.retries, Range::between(0, 100));
  fields.whole({"settle_periods", "projector frames to wait on top of its latency"},
               c.settle_periods,
               Range::between(0, 1000));
  fields.number({"min_coverage", "share of a surface cell that usable pixels must see"},
                c.min_coverage,
                Range{.min = 0.0, .max = 1.0, .min_excluded = true});
  fields.length_mm(
      {"direct_light_margin", "masked around a lit region on the seen face: blur, stray light"},
      c.direct_light_margin_mm,
      Range::between(0, 1000));
  fields.number({"usable_share", "of the regions; fewer usable ones end the session"},
                c.usable_share,
                Range::between(0, 1));
  fields.table({"exposures", "Exposures the bracket is chosen from."}, [&](Fields& f) {
    visit_exposures(f, c.exposures);
    if (agreement != nullptr) agreement->visit_exposures(f, c.exposures);
  });
  if (agreement != nullptr) agreement->visit_patterns(fields, c.patterns, session.sample);
}

void visit_bounds(Fields& fields, reconstruct::CoefficientBounds& bounds) {
  fields.number({"lowest_per_mm", ""}, bounds.lowest, Range::above(0));
  fields.number({"highest_per_mm", ""}, bounds.highest, Range::above(0));
  fields.check(
      bounds.highest > bounds.lowest, "highest_per_mm", "expected more than lowest_per_mm");
}

void visit_reduction(Fields& fields, reconstruct::Reduction& r) {
  fields.number({"grid_step", "cells of the sample to one that is solved for, along each axis"},
                r.grid_step,
                Range::between(1, 64));
  fields.whole({"use_regions", "n: put the captured ones together to n x n; 0: as captured"},
               r.regions,
               Range::between(0, 32));
}

void visit_reconstruction(Fields& fields, SessionConfig& session) {
  InverseOptions& r = session.reconstruction;
  using reconstruct::diffusion::SourceModel;
  LightEntry entry = r.choose_source                        ? LightEntry::kAuto
                     : r.source == SourceModel::kCollimated ? LightEntry::kCollimated
                                                            : LightEntry::kSurface;
  fields.one_of({"source", "how light enters; auto: as the pictures ask for"}, entry, kSourceNames);
  r.choose_source = entry == LightEntry::kAuto;
  r.source = entry == LightEntry::kSurface ? SourceModel::kSurface : SourceModel::kCollimated;
  fields.one_of({"deposit", "where a cell's share of the collimated source is put"},
                r.deposit,
                kDepositNames);
  fields.one_of({"boundary", "condition at the surface"}, r.boundary, kBoundaryNames);
  fields.one_of({"camera", "what the camera sees of the diffused light"}, r.camera, kCameraNames);
  fields.number({"model_error", "relative, of the diffusion model itself"},
                r.model_error,
                Range::at_least(0));
  fields.number({"direct_light_paths",
                 "transport mean free paths around a lit region on the seen face, left out"},
                r.direct_light_paths,
                Range::at_least(0));
  fields.number(
      {"regularization", "weight of smoothness; 0: none"}, r.regularization, Range::at_least(0));
  fields.one_of(
      {"regularizer", "smooth blobs, or few edges however sharp"}, r.regularizer, kSmoothnessNames);
  fields.one_of({"method", "of minimisation; as_published (Wang 2008) is for comparison only"},
                r.method,
                kMethodNames);
  fields.one_of({"model", "of the sample; auto: as much as the held-out lights ask for"},
                r.model,
                kModelNames);
  fields.one_of({"structure", "of the colour channels; shared: one pattern, scaled for each"},
                r.structure,
                kStructureNames);
  fields.whole({"coarser_grids", "that the answer is found on first"},
               r.coarser_grids,
               Range::between(0, 10));
  fields.flag({"grid_correction", "fit to the pictures less what the grid leaves out of them"},
              r.grid_correction);
  fields.whole({"max_iterations", "per channel and model; 0: the homogeneous fit"},
               r.max_iterations,
               Range::between(0, 100000));
  fields.number({"tolerance", "of every diffusion solve, relative residual"},
                r.tolerance,
                Range{.min = 0.0, .max = 0.1, .min_excluded = true});
  fields.number({"discrepancy", "stop at the chi^2 of the noise and this share of model_error"},
                r.discrepancy,
                Range::between(0, 1));
  fields.number({"stalled", "stop when ten iterations gain less than this fraction"},
                r.stalled,
                Range::at_least(0));
  fields.whole({"checkpoint_every", "iterations"}, r.checkpoint_every, Range::between(1, 100000));
  fields.path({"start", "a maps.exr, its session, or a material.vdb to start from; empty: a table"},
              session.start);
  visit_reduction(fields, session.reduction);
  fields.flag({"uncertainty", "also find how well each cell is known"}, session.uncertainty);
  fields.one_of({"back_end", "what computes"}, r.back_end, kBackEndNames);
  fields.flag({"back_end_fallback", "host takes over when the device of vulkan fails"},
              r.back_end_fallback);
  fields.whole({"threads", "0: one a core"}, r.threads, Range::between(0, 1024));
  fields.one_of({"precision", "of host between float64 residuals"}, r.precision, kPrecisionNames);
  fields.check(r.precision == reconstruct::diffusion::Precision::kSingle ||
                   r.back_end != reconstruct::BackEnd::kVulkan,
               "precision",
               "expected \"single\", which is what back_end = \"vulkan\" computes in");
  fields.table({"absorption", "Bounds of sigma_a."},
               [&](Fields& f) { visit_bounds(f, r.absorption); });
  fields.table({"reduced_scattering", "Bounds of sigma_s'."},
               [&](Fields& f) { visit_bounds(f, r.reduced_scattering); });
}

void visit_preview(Fields& fields, PreviewOptions& p) {
  fields.whole({"samples_per_axis", "of each pixel"}, p.samples_per_axis, Range::between(1, 8));
  fields.number({"white_quantile", "of the captured picture: what is shown as white"},
                p.white_quantile,
                Range::between(0.5, 1));
  fields.number({"tolerance", "of the light's solution in the material, relative residual"},
                p.tolerance,
                Range{.min = 0.0, .max = 0.1, .min_excluded = true});
  const auto named = std::ranges::find(kObjectNames, std::string_view(p.object));
  auto object = static_cast<std::size_t>(named - kObjectNames.begin());
  fields.choice({"object", "made of the material, drawn as well"}, object, kObjectNames);
  p.object = kObjectNames[object];
  fields.number({"object_tetrahedra", "about so many it is cut into"},
                p.object_tetrahedra,
                Range::between(100, 2e7));
}

void visit_led_sphere(Fields& fields, LedSphereOptions& o) {
  capture::GradientOptions& c = o.capture;
  std::size_t pattern = c.patterns.split ? 1 : 0;
  fields.choice({"pattern", "of gradients: (1 + omega)/2, or their bright and dark halves"},
                pattern,
                kPatternNames);
  c.patterns.split = pattern == 1;
  fields.flag({"specular", "also a picture with parallel polarisers"}, c.patterns.specular);
  fields.flag({"beam", "also a picture of the rig's thin beam: the reference method"}, o.beam);
  fields.flag({"check_lamps", "first light each lamp alone, and go on without dead ones"},
              c.check_lamps);
  fields.share({"object_threshold", "of a white surface: what is brighter is the object"},
               c.object_threshold,
               Range{.min = 0, .max = 1, .min_excluded = true, .max_excluded = true});
  fields.share({"drift_limit", "of the lamps: more is told, ten times as much refused"},
               c.drift_limit,
               Range{.min = 0, .max = 1, .min_excluded = true});
  fields.length_mm({"object_depth", "of its outline's plane before the sphere's middle"},
                   c.object_depth_mm,
                   Range::between(-1000, 1000));
  fields.number(
      {"ior", "relative refractive index of the object"}, o.ior, Range::between(1.3, 1.5));
  fields.number({"ior_deviation", "how far that may be off; 0: it is known"},
                o.ior_deviation,
                Range::between(0, 0.1));
  fields.whole(
      {"edge_px", "left out along the object's outline"}, o.edge_px, Range::between(0, 100));
  fields.share({"certain", "deviation of curvature and excess ratio that needs no larger window"},
               o.certain,
               Range{.min = 0, .max = 1, .min_excluded = true});
  fields.number({"sigmas", "of what is called certain"}, o.sigmas, Range::between(0, 10));
  fields.whole(
      {"largest_window", "pixels on either side"}, o.largest_window, Range::between(2, 1000));
  fields.share({"lamp_deviation", "of each lamp's intensity"}, o.lamp_deviation);
  fields.share({"white_deviation", "of all reflectances"}, o.white_deviation);
  fields.path({"mesh", "OBJ with texture coordinates, drawn turned; empty: the seen surface"},
              o.mesh);
  fields.length_mm({"mesh_size", "its largest extent; 0: its coordinates are mm"},
                   o.mesh_size_mm,
                   Range::at_least(0));
  fields.number({"turn_deg", "of that view, to the right"}, o.turn_deg, Range::between(-180, 180));
}

/// Before all that the quality sets, so that what is written out has the last word.
void visit_accuracy(Fields& fields, SessionConfig& session) {
  fields.one_of(
      {"quality", "sets what is not set below (docs/accuracy.md)"}, session.quality, kQualityNames);
  if (fields.is_reading()) apply(session.quality, session);
  fields.share({"target_error", "relighting error to reach by the cheapest settings; 0 %: none"},
               session.target_error);
}

/// `agreement` with the rig, when that has been read.
void visit_session(Fields& fields, SessionConfig& session, Agreement* agreement = nullptr) {
  const bool has_rig = agreement != nullptr;
  fields.text({"name", "of the session, for people"}, session.name);
  std::string rig_file = session.rig_file.string();
  fields.text({"rig", "the rig file", true}, rig_file);
  session.rig_file = rig_file;
  fields.one_of({"kind", "what is measured, by what light"}, session.kind, kKindNames);
  const bool in_sphere = session.kind == SessionKind::kLedSphere;
  if (in_sphere) agreement = nullptr;
  if (in_sphere && has_rig)
    fields.check(session.rig.has_stage(),
                 "kind",
                 "the rig has no light stage; expected [light_stage] driver in its file");
  visit_accuracy(fields, session);
  fields.table({"sample", "What is measured."}, [&](Fields& f) {
    visit_sample(f, session);
    if (agreement != nullptr) agreement->visit_sample(f, session.sample);
  });
  fields.table({"capture", "How it is captured."},
               [&](Fields& f) { visit_capture(f, session, agreement); });
  fields.check(!in_sphere || session.capture.exposures.mode == capture::ExposureMode::kBracket,
               "kind",
               "exposures are planned for surface cells, which a sphere of lights has none of; "
               "expected capture.exposures.mode = \"bracket\"");
  fields.table({"reconstruction", "How the material is found."},
               [&](Fields& f) { visit_reconstruction(f, session); });
  fields.table({"preview", "How the report's pictures are made."},
               [&](Fields& f) { visit_preview(f, session.preview); });
  fields.table({"led_sphere", "When kind = \"led_sphere\"."},
               [&](Fields& f) { visit_led_sphere(f, session.led_sphere); });
  fields.check(!(session.target_error > 0.0) || session.capture.patterns.held_out_lights > 0,
               "target_error",
               "cannot be measured without capture.held_out_lights; expected 4 or more of those");
}

/// Both files, and all that is wrong with them.
struct Loaded {
  SessionConfig session;
  std::vector<Problem> problems;
};

Result<SessionConfig> accept(Loaded loaded) {
  if (!loaded.problems.empty()) return invalid_argument(to_string(loaded.problems));
  return std::move(loaded.session);
}

/// Reads the rig before the session, so that the session's own visit can compare.
Loaded read_both(const Source& session, const Source& rig, bool check_files) {
  Loaded loaded;
  const auto of_rig =
      read_toml(rig, [&](Fields& f) { visit_rig(f, loaded.session.rig, check_files); });
  Agreement agreement(loaded.session.rig, of_rig);
  loaded.problems =
      read_toml(session, [&](Fields& f) { visit_session(f, loaded.session, &agreement); });
  loaded.problems.insert(loaded.problems.end(), of_rig.begin(), of_rig.end());
  return loaded;
}

Result<Source> read_source(const fs::path& file) {
  auto text = read_text(file, 1u << 20);
  if (!text) return text.error();
  std::error_code failed;
  const fs::path absolute = fs::absolute(file, failed);
  return Source{file.string(), *std::move(text), absolute.parent_path()};
}

/// The rig file that a session names, without looking at anything else.
struct RigReference {
  fs::path file;
  std::vector<Problem> problems;
};

RigReference rig_reference(const Source& session, const Error* missing) {
  RigReference reference;
  reference.problems = read_toml(session, [&](Fields& f) {
    SessionConfig ignored;
    visit_session(f, ignored);
    reference.file = ignored.rig_file;
    if (missing != nullptr) {
      f.check(false, "rig", fmt::format("{}; expected a rig file", missing->message));
    }
  });
  return reference;
}

Result<Loaded> load_both(const fs::path& session_file) {
  const auto session = read_source(session_file);
  if (!session) return session.error();
  const RigReference reference = rig_reference(*session, nullptr);
  if (reference.file.empty()) return Loaded{{}, reference.problems};
  const fs::path rig_file = (session->directory / reference.file).lexically_normal();
  const auto rig = read_source(rig_file);
  if (!rig) return Loaded{{}, rig_reference(*session, &rig.error()).problems};
  Loaded loaded = read_both(*session, *rig, true);
  loaded.session.rig_file = rig_file;
  return loaded;
}

/// By its tables: what has one of a session's is a session, whatever strayed into it.
bool is_rig_file(const Source& source) {
  const auto keys = top_level_keys(source);
  const auto has_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::ranges::find_first_of(keys, names) != keys.end();
  };
  return !has_one_of({"rig", "sample", "capture", "reconstruction", "preview", "led_sphere"}) &&
         has_one_of(
             {"station", "camera", "light_stage", "projector", "sim", "calibration", "replay"});
}

}  // namespace

std::string_view to_string(Quality quality) {
  return kQualityNames[static_cast<std::size_t>(quality)];
}

Result<SessionConfig> parse_session(const Source& session, const Source& rig) {
  return accept(read_both(session, rig, false));
}

Result<SessionConfig> load_session(const fs::path& session_file) {
  auto loaded = load_both(session_file);
  if (!loaded) return loaded.error();
  return accept(*std::move(loaded));
}

Result<RigConfig> parse_rig(const Source& source) {
  RigConfig rig;
  const auto problems = read_toml(source, [&](Fields& f) { visit_rig(f, rig, true); });
  if (!problems.empty()) return invalid_argument(to_string(problems));
  return rig;
}

Result<RigConfig> load_rig(const fs::path& rig_file) {
  const auto source = read_source(rig_file);
  if (!source) return source.error();
  return parse_rig(*source);
}

Result<std::vector<Problem>> check(const fs::path& file) {
  const auto source = read_source(file);
  if (!source) return source.error();
  if (is_rig_file(*source)) {
    RigConfig rig;
    return read_toml(*source, [&](Fields& f) { visit_rig(f, rig, true); });
  }
  auto loaded = load_both(file);
  if (!loaded) return loaded.error();
  return loaded->problems;
}

namespace {

void visit_resolved(Fields& fields, SessionConfig& session) {
  fields.table({"session", ""}, [&](Fields& f) { visit_session(f, session); });
  fields.table({"rig", ""}, [&](Fields& f) { visit_rig(f, session.rig, false); });
}

}  // namespace

std::string to_toml(const SessionConfig& session) {
  SessionConfig copy = session;
  return write_toml([&](Fields& f) { visit_resolved(f, copy); }, false);
}

Result<SessionConfig> parse_resolved(const Source& resolved) {
  SessionConfig session;
  const auto problems = read_toml(resolved, [&](Fields& f) { visit_resolved(f, session); });
  if (!problems.empty()) return invalid_argument(to_string(problems));
  return session;
}

Result<SessionConfig> load_resolved(const SessionDirectory& session) {
  const auto source = read_source(session.resolved_toml());
  if (!source) return source.error();
  return parse_resolved(*source);
}

Result<SessionDirectory::Contents> read_contents(const fs::path& session_file) {
  const auto session = load_session(session_file);
  if (!session) return session.error();
  auto session_text = read_text(session_file);
  if (!session_text) return session_text.error();
  auto rig_text = read_text(session->rig_file);
  if (!rig_text) return rig_text.error();
  return SessionDirectory::Contents{
      session->name, *std::move(session_text), *std::move(rig_text), to_toml(*session)};
}

std::string session_example() {
  SessionConfig session;
  session.rig_file = "rig.example.toml";
  return "# Every key of a session file, with its default. Copy what you change.\n" +
         write_toml([&](Fields& f) { visit_session(f, session); }, true);
}

std::string rig_example() {
  RigConfig rig;
  const auto none = read_toml({}, [&](Fields& f) { visit_rig(f, rig, false); });
  ENSURE(none.empty());  // an empty rig file is the simulated rig
  return "# Every key of a rig file, with its default. Copy what you change.\n" +
         write_toml([&](Fields& f) { visit_rig(f, rig, false); }, true);
}

}  // namespace opaline::config
