#include "config/rig_config.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "config/block_fields.h"
#include "config/pose_fields.h"

namespace opaline::config {
namespace {

constexpr std::array<std::string_view, 5> kSceneNames{
    "homogeneous", "layered", "wax", "marble", "stone"};
constexpr std::array<std::string_view, 3> kResponseNames{"linear", "gamma", "table"};
constexpr std::array<std::string_view, 2> kProjectorKindNames{"perpendicular", "perspective"};
constexpr Range kAtLeast0 = Range{.min = 0.0};
constexpr Range kAbove0 = Range{.min = 0.0, .min_excluded = true};
constexpr Range kPictureSize = Range{.min = 1, .max = 8192};
constexpr Range kGamma = Range{.min = 0.1, .max = 10.0};
constexpr Range kSeed = Range{.min = 0};

void visit_camera_model(Fields& fields, CameraModel& model, bool required) {
  fields.whole({"width", "of the picture, pixels", required}, model.width, kPictureSize);
  fields.whole({"height", "of the picture, pixels", required}, model.height, kPictureSize);
  fields.number({"fx", "focal length, pixels", required}, model.fx, kAbove0);
  fields.number({"fy", "focal length, pixels", required}, model.fy, kAbove0);
  fields.number({"cx", "principal point, pixels from the left edge", required}, model.cx);
  fields.number({"cy", "principal point, pixels from the top edge", required}, model.cy);
  fields.numbers({"distortion", "k1 k2 p1 p2 k3 (Brown; OpenCV's order)"}, model.distortion);
  visit_pose(fields, model.camera_from_sample);
}

void visit_projector_size(Fields& fields, int& width, int& height) {
  fields.whole({"width", "of the picture, pixels"}, width, kPictureSize);
  fields.whole({"height", "of the picture, pixels"}, height, kPictureSize);
}

/// What the simulated projector and its calibration both have.
template <class Projector>
void visit_projection(Fields& fields, Projector& p) {
  fields.one_of(
      {"kind", "parallel light, or by its lens from where it stands"}, p.kind, kProjectorKindNames);
  visit_projector_size(fields, p.width, p.height);
  fields.number({"mm_per_pixel", "of the picture on the lit face"}, p.mm_per_pixel, kAbove0);
  fields.number({"offset_x_px", "pixel at which the lit face's first column begins"},
                p.offset_x_px);
  fields.number({"offset_y_px", "pixel at which its first row begins"}, p.offset_y_px);
  fields.length_mm({"reference_distance", "at which the peak holds, in perspective"},
                   p.reference_distance_mm);
  fields.number({"gamma", "light = (code / 255)^gamma"}, p.gamma, kGamma);
  fields.number({"black_level", "light at code 0, share of the peak"},
                p.black_level,
                Range{.min = 0, .max = 1, .max_excluded = true});
  fields.numbers({"peak_irradiance_w_per_mm2", "red, green, blue, at code 255 in the middle"},
                 p.peak_irradiance,
                 kAbove0);
}

template <class Projector>
void visit_lens_of(Fields& fields, Projector& p) {
  fields.table(
      {"lens", "Its lens, as an inverse camera, when kind = \"perspective\"."}, [&](Fields& f) {
        visit_projector_lens(f, p.lens);
        f.check(p.kind != decltype(p.kind)::kPerspective || (p.lens.fx > 0.0 && p.lens.fy > 0.0),
                "fx",
                "expected the focal lengths of a projector in perspective");
        p.lens.width = p.width;
        p.lens.height = p.height;
      });
}

constexpr Key kVignetting{"vignetting",
                          "1 + v0 r^2 + v1 r^4 + v2 r^6, r = 1 in the picture's corners"};

void visit_vignetting(Fields& fields, std::array<double, 3>& v) {
  fields.numbers(kVignetting, v);
  fields.check(capture::Vignetting{v}.least() > 0.0,
               "vignetting",
               "expected light all over the picture, 0 <= r <= 1");
}

void visit_sim_camera(Fields& fields, sim::CameraOptics& c) {
  visit_camera_model(fields, c.model, false);
  fields.number({"psf_sigma_px", "Gaussian blur; 0: none"}, c.psf_sigma_px, Range::between(0, 20));
  visit_vignetting(fields, c.vignetting);
  fields.numbers(
      {"sensitivity", "red, green, blue: electrons per (W/(mm^2 sr) s)"}, c.sensitivity, kAbove0);
  fields.number({"full_well_electrons", "where a pixel clips"}, c.full_well_electrons, kAbove0);
  fields.number({"gain_electrons_per_code", ""}, c.gain_electrons_per_code, kAbove0);
  fields.number({"read_noise_electrons", "standard deviation"}, c.read_noise_electrons, kAtLeast0);
  fields.number({"dark_electrons_per_second", ""}, c.dark_electrons_per_second, kAtLeast0);
  fields.number(
      {"hot_pixel_fraction", "of all pixels"}, c.hot_pixel_fraction, Range::between(0, 1));
  fields.number(
      {"hot_pixel_electrons_per_second", ""}, c.hot_pixel_electrons_per_second, kAtLeast0);
  fields.number({"response_gamma", "code = signal^(1/gamma); 1: linear"}, c.response_gamma, kGamma);
  fields.number({"black_level", "code without light"}, c.black_level, kAtLeast0);
  fields.whole({"bit_depth", ""}, c.bit_depth, Range::between(8, 16));
  fields.check(
      c.black_level <= 0.5 * c.max_code(), "black_level", "expected at most half the codes");
  fields.number(
      {"exposure_error", "relative, of the shutter"}, c.exposure_error, Range::between(0, 0.1));
  fields.duration({"shortest_exposure", ""}, c.shortest_exposure);
  fields.duration({"longest_exposure", ""}, c.longest_exposure, Range::between(1e-9, 3600));
  fields.check(c.longest_exposure >= c.shortest_exposure,
               "longest_exposure",
               "expected at least shortest_exposure");
}

void visit_sim_projector(Fields& fields, sim::ProjectorOptics& p) {
  visit_projection(fields, p);
  visit_vignetting(fields, p.vignetting);
  fields.duration({"latency", "from the picture to its light"}, p.latency, Range::between(0, 1));
  fields.duration({"wheel_turn", "of the colour wheel: exposures are whole multiples"},
                  p.wheel_turn,
                  Range::between(1e-6, 1));
  visit_lens_of(fields, p);
}

void visit_surface(Fields& fields, sim::SurfaceOptions& surface) {
  fields.number({"reflectance_per_sr", "of its ground; 0: none"},
                surface.reflectance,
                Range::between(0, 0.3));
  fields.number({"contrast", "of its texture; 0: even"}, surface.contrast, Range::between(0, 3));
  fields.length_mm({"feature_size", "of its texture"}, surface.feature_mm);
  fields.whole({"seed", "of its texture"}, surface.seed, kSeed);
}

void visit_scene(Fields& fields, sim::SceneOptions& scene) {
  fields.one_of({"kind", "what the sample is made of"}, scene.kind, kSceneNames);
  fields.whole({"seed", "of its pattern"}, scene.seed, kSeed);
  visit_block(fields, scene.block);
  fields.number({"ior", "relative refractive index"}, scene.ior, Range::between(1, 3));
  fields.number(
      {"reduced_scattering_per_mm", "of the ground, in green"}, scene.reduced_scattering, kAbove0);
  fields.number({"absorption_per_mm", "of the ground, in green"}, scene.absorption, kAtLeast0);
  fields.number(
      {"contrast", "0: homogeneous, 1: as the kind has it"}, scene.contrast, Range::between(0, 2));
  fields.length_mm({"feature_size", "of blobs and grains, distance of veins"}, scene.feature_mm);
}

void visit_path(Fields& fields, const Key& key, std::filesystem::path& path, bool must_exist) {
  fields.path(key, path);
  std::error_code ignored;
  fields.check(!must_exist || path.empty() || std::filesystem::exists(path, ignored),
               key.name,
               fmt::format("there is no {}", path.string()));
}

void visit_transport(Fields& fields, SimConfig& sim, bool check_files) {
  sim::ResponseOptions& t = sim.transport;
  visit_path(
      fields,
      {"responses", "stored light transport of this scene; none: computed (tens of minutes)"},
      sim.responses,
      check_files);
  fields.path({"cache", "directory for computed ones; empty: the user's cache"}, sim.cache);
  visit_face(fields, {"lit_face", "where the projector's light enters"}, t.lit_face);
  visit_face(fields, {"seen_face", "what the camera looks at"}, t.seen_face);
  fields.flag({"diffuse_entry", "diffuse light instead of perpendicular"}, t.diffuse_entry);
  std::array<int, 2> patches{t.patches_x, t.patches_y};
  fields.wholes({"patches", "entry patches, columns and rows"}, patches, Range::between(1, 64));
  t.patches_x = patches[0];
  t.patches_y = patches[1];
  fields.number(
      {"anisotropy", "g of the phase function"}, t.anisotropy, Range::between(-0.95, 0.95));
  fields.whole({"seed", "of the photons"}, t.seed, kSeed);
  fields.whole({"photons_per_patch", "in each channel"}, t.photons_per_patch, Range::at_least(1));
  t.camera_centre = sim.rig.camera.model.centre();
}

void visit_sim(Fields& fields, SimConfig& sim, bool check_files) {
  fields.one_of({"run", "where the simulated station lives"}, sim.run, kRigPlaceNames);
  fields.path({"socket", "of opaline-rig when run = \"process\"; empty: by the station's name"},
              sim.socket);
  fields.whole({"seed", "of all its noise"}, sim.rig.seed, kSeed);
  fields.number({"time_factor", "how many times as fast as real time its clock runs"},
                sim.rig.time_factor,
                Range::between(1, 1000));
  fields.flag({"chart", "a ColorChecker lies before the camera instead of the sample"}, sim.chart);
  fields.table({"scene", "The sample."}, [&](Fields& f) { visit_scene(f, sim.scene); });
  fields.table({"board", "A calibration board in place of the sample."},
               [&](Fields& f) { visit_sim_board(f, sim.board); });
  fields.table({"surface", "What the sample's surface reflects, where the lit face is seen."},
               [&](Fields& f) { visit_surface(f, sim.rig.surface); });
  fields.table({"holder", "What the sample lies in: opal acrylic with a ChArUco board on it."},
               [&](Fields& f) { visit_sim_holder(f, sim.holder); });
  fields.table({"camera", "What its camera does to the light."},
               [&](Fields& f) { visit_sim_camera(f, sim.rig.camera); });
  fields.table({"projector", "What its projector does with a picture."},
               [&](Fields& f) { visit_sim_projector(f, sim.rig.projector); });
  fields.table({"transport", "How light travels in the sample (Monte Carlo)."},
               [&](Fields& f) { visit_transport(f, sim, check_files); });
  fields.table(
      {"sphere", "Translucent balls, which a simulated light stage shines on."},
      [&](Fields& f) { visit_sim_sphere(f, sim.balls, sim.rig.projector.drift_per_hour); });
}

/// A simulated station knows itself.
capture::StationCalibration truth_of(const sim::RigOptions& rig) {
  capture::StationCalibration calibration;
  capture::CameraCalibration& camera = calibration.camera;
  camera.model = rig.camera.model;
  camera.bit_depth = rig.camera.bit_depth;
  if (rig.camera.response_gamma != 1.0) camera.response.kind = capture::ResponseCurve::Kind::kGamma;
  camera.response.gamma = rig.camera.response_gamma;
  camera.black_level = rig.camera.black_level;
  camera.gain_electrons_per_code = rig.camera.gain_electrons_per_code;
  camera.full_well_electrons = rig.camera.full_well_electrons;
  camera.read_noise_electrons = rig.camera.read_noise_electrons;
  camera.vignetting.coefficients = rig.camera.vignetting;
  camera.sensitivity = rig.camera.sensitivity;
  capture::ProjectorCalibration& projector = calibration.projector;
  projector.kind = rig.projector.kind == sim::ProjectorKind::kPerspective
                       ? capture::ProjectorKind::kPerspective
                       : capture::ProjectorKind::kPerpendicular;
  projector.lens = rig.projector.lens;
  projector.reference_distance_mm = rig.projector.reference_distance_mm;
  projector.width = rig.projector.width;
  projector.height = rig.projector.height;
  projector.mm_per_pixel = rig.projector.mm_per_pixel;
  projector.offset_x_px = rig.projector.offset_x_px;
  projector.offset_y_px = rig.projector.offset_y_px;
  projector.gamma = rig.projector.gamma;
  projector.black_level = rig.projector.black_level;
  projector.vignetting.coefficients = rig.projector.vignetting;
  projector.peak_irradiance = rig.projector.peak_irradiance;
  return calibration;
}

void visit_response(Fields& fields, capture::ResponseCurve& response) {
  fields.one_of({"response", "how codes follow the light"}, response.kind, kResponseNames);
  fields.number({"response_gamma", "code = signal^(1/gamma), when response = \"gamma\""},
                response.gamma,
                kGamma);
  fields.quantities({"response_table", "signal at equally spaced codes, 0 to 1, when \"table\""},
                    response.table,
                    0,
                    Unit::kPlain,
                    Range::between(0, 1));
  const std::vector<double>& t = response.table;
  bool rises = t.size() >= 2 && t.front() == 0.0 && t.back() == 1.0;
  for (std::size_t i = 1; rises && i < t.size(); ++i) rises = t[i] > t[i - 1];
  fields.check(response.kind != capture::ResponseCurve::Kind::kTable || rises,
               "response_table",
               "expected values that rise from 0 to 1");
}

void visit_hot_pixels(Fields& fields, capture::CameraCalibration& camera) {
  std::vector<std::pair<int, int>>& pixels = camera.hot_pixels;
  std::vector<std::int64_t> flat;
  for (const auto& [x, y] : pixels) flat.insert(flat.end(), {x, y});
  fields.integers({"hot_pixels", "known ones, x, y, x, y, ... from 0; others are found"},
                  flat,
                  0,
                  Range::between(0, kPictureSize.max - 1));
  fields.check(flat.size() % 2 == 0, "hot_pixels", "expected pairs x, y");
  pixels.clear();
  for (std::size_t i = 0; i + 1 < flat.size(); i += 2) {
    pixels.emplace_back(static_cast<int>(flat[i]), static_cast<int>(flat[i + 1]));
  }
  const auto outside = std::ranges::find_if(pixels, [&](const auto& pixel) {
    return pixel.first >= camera.model.width || pixel.second >= camera.model.height;
  });
  if (outside == pixels.end()) return;
  fields.check(false,
               "hot_pixels",
               fmt::format("there is no pixel {}, {}; expected pixels of a picture of {} x {}",
                           outside->first,
                           outside->second,
                           camera.model.width,
                           camera.model.height));
}

void visit_calibrated_camera(Fields& fields, capture::CameraCalibration& c, bool required) {
  visit_camera_model(fields, c.model, required);
  fields.whole({"bit_depth", ""}, c.bit_depth, Range::between(8, 16));
  visit_response(fields, c.response);
  fields.number({"black_level", "code without light"}, c.black_level, kAtLeast0);
  fields.check(c.black_level < c.max_code(), "black_level", "expected less than the highest code");
  fields.number({"gain_electrons_per_code", ""}, c.gain_electrons_per_code, kAbove0);
  fields.number({"full_well_electrons", "where a pixel clips; 0: at the highest code"},
                c.full_well_electrons,
                kAtLeast0);
  fields.number({"read_noise_electrons", "standard deviation"}, c.read_noise_electrons, kAtLeast0);
  visit_vignetting(fields, c.vignetting.coefficients);
  fields.numbers(
      {"sensitivity", "red, green, blue: electrons per (W/(mm^2 sr) s)"}, c.sensitivity, kAbove0);
  visit_hot_pixels(fields, c);
}

void visit_calibration(Fields& fields, RigConfig& rig) {
  const bool simulated = rig.camera == Driver::kSim;
  fields.one_of({"use", "what \"opaline calibrate\" measured last, or what follows"},
                rig.calibration_use,
                kCalibrationUseNames);
  fields.table({"board", "The board that \"opaline calibrate\" measures the lenses with."},
               [&](Fields& f) { visit_board(f, rig.geometry); });
  fields.table(
      {"holder", "The board around the sample, by which sessions find it before the camera."},
      [&](Fields& f) { visit_holder(f, rig.holder); });
  fields.table({"camera", "The camera."}, [&](Fields& f) {
    const capture::CameraCalibration& c = rig.calibration.camera;
    const sim::CameraOptics& real = rig.sim.rig.camera;
    visit_calibrated_camera(f, rig.calibration.camera, !simulated);
    const bool same = c.model.width == real.model.width && c.model.height == real.model.height &&
                      c.bit_depth == real.bit_depth;
    f.check(
        !simulated || same,
        "width",
        fmt::format("the picture has {} x {} pixels of {} bits; expected the simulated camera's "
                    "{} x {} of {}",
                    c.model.width,
                    c.model.height,
                    c.bit_depth,
                    real.model.width,
                    real.model.height,
                    real.bit_depth));
  });
  fields.table({"projector", "The projector."}, [&](Fields& f) {
    capture::ProjectorCalibration& p = rig.calibration.projector;
    visit_projection(f, p);
    visit_vignetting(f, p.vignetting.coefficients);
    const sim::ProjectorOptics& real = rig.sim.rig.projector;
    f.check(rig.projector != Driver::kSim || (p.width == real.width && p.height == real.height),
            "width",
            fmt::format("the picture has {} x {} pixels; expected the simulated "
                        "projector's {} x {}",
                        p.width,
                        p.height,
                        real.width,
                        real.height));
    visit_lens_of(f, p);
  });
}

}  // namespace

void visit_rig(Fields& fields, RigConfig& rig, bool check_files) {
  fields.table({"station", "The station."}, [&](Fields& f) {
    f.text({"name", "two jobs on one station exclude each other"}, rig.station);
    f.check(!rig.station.empty() && rig.station.find('/') == std::string::npos,
            "name",
            "expected a name without \"/\"");
  });
  fields.table({"camera", "Which camera."}, [&](Fields& f) {
    f.one_of({"driver", "its back end"}, rig.camera, kDriverNames);
  });
  fields.table({"projector", "Which projector."}, [&](Fields& f) {
    f.one_of({"driver", "its back end"}, rig.projector, kDriverNames);
  });
  fields.table({"light_stage", "A sphere of lamps in place of the projector."},
               [&](Fields& f) { visit_light_stage(f, rig.light_stage); });
  fields.table({"replay", "Photographs instead of devices."}, [&](Fields& f) {
    const bool used = rig.camera == Driver::kReplay || rig.projector == Driver::kReplay;
    visit_path(f,
               {"folder", "with its index, used by driver = \"replay\""},
               rig.replay_folder,
               check_files);
    f.check(!used || !rig.replay_folder.empty(),
            "folder",
            "expected the folder of the photographs that driver = \"replay\" stands for");
  });
  fields.table({"sim", "The simulated station, used by driver = \"sim\"."},
               [&](Fields& f) { visit_sim(f, rig.sim, check_files); });
  if (fields.is_reading()) {
    rig.calibration = truth_of(rig.sim.rig);
    rig.holder = holder_of(rig.sim.holder);
    rig.sim.lights.clear();
    if (rig.light_stage.driver == StageDriver::kSim) rig.sim.lights = rig.light_stage.lights();
    rig.sim.balls.beam = sim_beam(rig.light_stage);
  }
  fields.table({"calibration",
                "What is known about the devices; of a simulated station the truth, unless given."},
               [&](Fields& f) { visit_calibration(f, rig); });
}

std::filesystem::path rig_socket(const RigConfig& rig) {
  if (!rig.sim.socket.empty()) return rig.sim.socket;
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::filesystem::path directory =
      runtime != nullptr && *runtime != '\0'
          ? std::filesystem::path(runtime) / "opaline"
          : std::filesystem::path(fmt::format("/tmp/opaline-{}", ::getuid()));
  return directory / fmt::format("rig-{}.sock", rig.station);
}

}  // namespace opaline::config
