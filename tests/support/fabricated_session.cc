#include "tests/support/fabricated_session.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "base/event_log.h"
#include "base/face_view.h"
#include "base/io/dataset_io.h"
#include "base/io/image_io.h"
#include "base/io/volume_io.h"
#include "config/session_config.h"
#include "daemon/report/surface_radiance.h"
#include "reconstruct/host/host_solver.h"
#include "render/renderer.h"
#include "render/translucency.h"

namespace opaline::testing {
namespace {

/// Unit light on a part of the lit face, in shares of its size.
Illumination part_of_face(const Block& block, std::string name, double x, double y, double size) {
  Illumination light{std::move(name), false, Image<float>(block.nx, block.ny, 3), {}, {}, {}};
  for (int j = 0; j < block.ny; ++j) {
    for (int i = 0; i < block.nx; ++i) {
      const double u = (i + 0.5) / block.nx;
      const double v = (j + 0.5) / block.ny;
      const bool lit = u >= x && u < x + size && v >= y && v < y + size;
      for (int c = 0; c < 3; ++c) light.irradiance.at(i, j, c) = lit ? 1e-3F : 0.0F;
    }
  }
  return light;
}

std::vector<Illumination> lights_on(const Block& block, int regions, int held_out) {
  std::vector<Illumination> lights;
  const double size = 1.0 / regions;
  for (int row = 0; row < regions; ++row) {
    for (int column = 0; column < regions; ++column) {
      lights.push_back(part_of_face(
          block, fmt::format("region_{}_{}", column, row), column * size, row * size, size));
    }
  }
  for (auto& light : {part_of_face(block, "held_out_shifted", 0.5 * size, 0.5 * size, size),
                      part_of_face(block, "held_out_large", 0.0, 0.25, 2.0 * size),
                      part_of_face(block, "held_out_small", 0.5, 0.25, 0.5 * size)}) {
    if (held_out-- <= 0) break;
    lights.push_back(light);
    lights.back().held_out = true;
  }
  return lights;
}

class Fabricator {
 public:
  Fabricator(const std::filesystem::path& directory, const Fabrication& what)
      : directory_(directory), what_(what) {}

  Result<SessionDirectory> run() {
    auto session = make_directory();
    if (!session) return session;
    if (auto made = make_pictures(*session); !made) return made.error();
    if (auto written = write_dataset(files_, session->path(), dataset_); !written) {
      return written.error();
    }
    if (auto written = write_material(files_, session->material(), what_.found, "test"); !written) {
      return written.error();
    }
    if (auto written = write_whole(files_, session->reconstruction(), reconstruction()); !written) {
      return written.error();
    }
    if (auto logged = log(*session); !logged) return logged.error();
    return session;
  }

 private:
  Result<SessionDirectory> make_directory() {
    config::SessionConfig config;
    config.name = "fabricated";
    config.sample_name = "marble";
    config.rig_file = directory_ / "rig.toml";
    config.rig.sim.responses = what_.responses;
    config.sample.block = what_.truth.block;
    config.preview.object = what_.object;
    config.preview.object_tetrahedra = 2000;
    config.rig.sim.rig.camera.model = config.rig.calibration.camera.model = what_.camera;
    return SessionDirectory::create(
        files_, directory_, {config.name, "", "", config::to_toml(config)});
  }

  Result<void> make_pictures(const SessionDirectory& session) {
    const Block& block = what_.truth.block;
    dataset_.block = block;
    dataset_.ior = what_.truth.ior;
    dataset_.view_cosine = view_of_face(block, Face::kZMax, what_.camera.centre()).cosine;
    dataset_.illuminations = lights_on(block, what_.regions, what_.held_out);
    std::vector<render::Light> lights;
    for (const auto& light : dataset_.illuminations)
      lights.push_back({Face::kZMin, light.irradiance});
    const auto solver = reconstruct::host::make_host_solver({});
    const auto fields = render::illuminate(what_.truth, lights, {}, *solver, {});
    if (!fields) return fields.error();
    const auto renderer = render::Renderer::create({.gpu = what_.gpu});
    if (!renderer) return renderer.error();
    if (auto made = files_.make_directories(session.hdr()); !made) return made;
    for (std::size_t m = 0; m < lights.size(); ++m) {
      measure_surface((*fields)[m], dataset_.illuminations[m]);
      const auto picture = (*renderer)->draw((*fields)[m], what_.camera, {});
      if (!picture) return picture.error();
      if (auto taken = write_hdr(session, dataset_.illuminations[m], *picture); !taken) {
        return taken;
      }
    }
    return ok();
  }

  void measure_surface(const render::SurfaceField& field, Illumination& light) {
    light.radiance = daemon::surface_radiance(field, Face::kZMax, dataset_.view_cosine);
    light.radiance_variance = Image<float>(light.radiance.width(), light.radiance.height(), 3);
    light.mask = Image<std::uint8_t>(
        light.radiance.width(), light.radiance.height(), 1, is_usable(light) ? 1 : 0);
    for (std::size_t i = 0; i < light.radiance.samples().size(); ++i) {
      disturb(light.radiance.samples()[i], light.radiance_variance.samples()[i]);
    }
  }

  bool is_usable(const Illumination& light) const {
    return !light.held_out || what_.held_out_works;
  }

  void disturb(float& value, float& variance) {
    const double deviation = what_.noise * value + 1e-12;
    value = static_cast<float>(value + deviation * normal_(random_));
    variance = static_cast<float>(deviation * deviation);
  }

  Result<void> write_hdr(const SessionDirectory& session,
                         const Illumination& light,
                         const Image<float>& drawn) {
    Image<float> pixels(drawn.width(), drawn.height(), 8);
    for (int y = 0; y < drawn.height(); ++y) {
      for (int x = 0; x < drawn.width(); ++x) {
        for (int c = 0; c < 3; ++c) {
          pixels.at(x, y, c) = drawn.at(x, y, c);
          disturb(pixels.at(x, y, c), pixels.at(x, y, 3 + c));
        }
        const bool saturated = y < what_.saturated_rows;
        pixels.at(x, y, 6) = is_usable(light) && !saturated ? 1.0F : 0.0F;
        pixels.at(x, y, 7) = saturated ? 1.0F : 0.0F;
      }
    }
    const auto bytes = encode_image(
        {std::move(pixels), {"R", "G", "B", "var.R", "var.G", "var.B", "mask", "saturated"}, {}},
        ImageFormat::kExr);
    if (!bytes) return bytes.error();
    return write_whole(files_, session.hdr() / (light.name + ".exr"), *bytes);
  }

  static std::string reconstruction() {
    nlohmann::json channels = nlohmann::json::array();
    for (const char* name : kChannelNames) {
      nlohmann::json history = nlohmann::json::array();
      for (int i = 0; i <= 40; ++i) {
        history.push_back({{"iteration", i}, {"chi_squared_per_datum", 1.0 + 80.0 / (1 + i * i)}});
      }
      nlohmann::json ladder = nlohmann::json::array();
      for (const char* model : {"homogeneous", "layered", "heterogeneous"}) {
        const auto tried = static_cast<double>(ladder.size());
        const bool taken = std::string_view(model) != "layered";
        ladder.push_back({{"model", model},
                          {"parameters", 2 + 10 * ladder.size()},
                          {"fitted_chi_squared_per_datum", 40.0 / (1.0 + tried)},
                          {"held_out_chi_squared_per_datum", 50.0 / (1.0 + tried)},
                          {"held_out_standard_error", 1.5},
                          {"gain", 25.0},
                          {"gain_standard_error", 2.5},
                          {"seconds", 1.25},
                          {"taken", taken},
                          {"why", taken ? "the held-out error falls" : "no more than chance"}});
      }
      channels.push_back(
          {{"channel", name},
           {"model", "heterogeneous"},
           {"model_reason", "there is no finer model"},
           {"ladder", ladder},
           {"held_out_noise_chi_squared_per_datum", 0.5},
           {"homogeneous",
            {{"reduced_scattering", 1.25},
             {"absorption", 0.02},
             {"reduced_scattering_interval_95", {1.125, 1.375}},
             {"absorption_interval_95", {0.015, 0.025}}}},
           {"history", history},
           {"chi_squared_per_datum", 1.05},
           {"data", 1000},
           {"target_chi_squared_per_datum", 1.0},
           {"solves", 5000},
           {"seconds", 12.3},
           {"stop_reason", "discrepancy"},
           {"stop_explanation", "the pictures are explained to within their noise"}});
    }
    return nlohmann::json{{"format", 1}, {"channels", channels}, {"uncertainty", uncertainty()}}
        .dump();
  }

  static nlohmann::json uncertainty() {
    nlohmann::json channels = nlohmann::json::array();
    for (const char* name : kChannelNames) {
      channels.push_back(
          {{"channel", name},
           {"determined_diffusion", 40.25},
           {"determined_absorption", 12.5},
           {"seconds", 2.5},
           {"reduced_scattering",
            {{"prior", 1.5},
             {"amplitude", 0.25},
             {"layers", {0.03, 0.06, 0.12, 0.24, 0.25, 0.26}}}},
           {"absorption",
            {{"prior", 1.625}, {"amplitude", 0.5}, {"layers", {0.3, 0.4, 0.44, 0.46, 0.5, 0.5}}}}});
    }
    return {{"layer_mm", 1.0}, {"channels", channels}};
  }

  Result<void> log(const SessionDirectory& session) {
    const auto log = EventLog::open(files_, session.events());
    if (!log) return log.error();
    for (const char* job : {"capture", "reconstruct"}) {
      const auto started = (*log)->append("job.started", {{"job", job}});
      const auto finished =
          (*log)->append("job.finished", {{"job", job}, {"outcome", "succeeded"}});
      if (!started || !finished) return internal_error("event log");
    }
    return ok();
  }

  std::filesystem::path directory_;
  const Fabrication& what_;
  FileOperations& files_ = system_files();
  Dataset dataset_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

}  // namespace

Result<SessionDirectory> fabricate_session(const std::filesystem::path& directory,
                                           const Fabrication& what) {
  return Fabricator(directory, what).run();
}

}  // namespace opaline::testing
