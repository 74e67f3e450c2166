#include "render/translucency.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/face_view.h"
#include "reconstruct/diffusion/camera_rays.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/diffusion/lit_surface.h"
#include "reconstruct/diffusion/medium.h"

namespace opaline::render {
namespace {

namespace diffusion = reconstruct::diffusion;

constexpr double kUselessResidual = 1e-3;  // a picture of this shows the solver, not the material

Result<void> validate(const Material& material, std::span<const Light> lights) {
  const Block& block = material.block;
  for (const ChannelCoefficients& channel : material.channels)
    if (channel.absorption.size() != block.cell_count() ||
        channel.reduced_scattering.size() != block.cell_count())
      return invalid_argument("the material's coefficients do not cover its block");
  for (std::size_t m = 0; m < lights.size(); ++m) {
    const Image<float>& e = lights[m].irradiance;
    const Face face = lights[m].lit_face;
    if (e.width() != block.face_width(face) || e.height() != block.face_height(face) ||
        e.channels() != kColorChannels)
      return invalid_argument(
          fmt::format("light {} does not cover the cells of face {}", m, to_string(face)));
    for (const float value : e.samples())
      if (!(value >= 0.0F) || !std::isfinite(value))
        return invalid_argument(fmt::format("light {}: irradiance {}; expected >= 0", m, value));
  }
  return ok();
}

/// Light transmitted into the surface, q = (1 - R(0)) E, of one channel.
std::vector<double> transmitted(const Light& light, double ior, int channel) {
  const double share = 1.0 - diffusion::normal_reflectance(ior);
  std::vector<double> q;
  q.reserve(light.irradiance.pixel_count());
  const auto samples = light.irradiance.samples();
  for (std::size_t i = channel; i < samples.size(); i += kColorChannels)
    q.push_back(share * samples[i]);
  return q;
}

/// One colour channel of a material, its equation, and how light enters it by each face.
class Channel {
 public:
  Channel(const Material& material,
          int channel,
          const diffusion::Boundary& boundary,
          const TranslucencyOptions& options)
      : channel_(channel),
        ior_(material.ior),
        boundary_(boundary),
        source_(options.source),
        medium_(diffusion::make_medium(material.block, material.channels[channel], boundary)) {
    if (!options.eye) return;
    for (const Face face : kFaces) look_at(face, *options.eye);
  }

  const diffusion::Medium& medium() const { return medium_; }

  void deposit(const Light& light, std::span<double> b) {
    entry(light.lit_face).deposit(transmitted(light, ior_, channel_), b);
  }

  void write_surface(const Light& light, std::span<const double> phi, SurfaceField& field) {
    const std::vector<double> q = transmitted(light, ior_, channel_);
    const Entered entered{entry(light.lit_face).surface_terms(q), q};
    for (const Face face : kFaces) {
      const bool lit = face == light.lit_face;
      write_face(face, phi, lit ? entered : Entered{}, field);
    }
  }

 private:
  diffusion::FaceSource& entry(Face face) {
    auto& made = entries_[static_cast<std::size_t>(face)];
    if (!made) made.emplace(medium_, boundary_, face, source_);
    return *made;
  }

  struct Entered {  // by the face; empty where it is dark
    diffusion::SurfaceTerms terms;
    std::vector<double> q;
  };
  struct View {
    std::vector<diffusion::CameraRay> directions;
    diffusion::CameraRays rays;
    std::vector<double> flux_gain;  // 2 A + 3 mu_i
  };

  void look_at(Face face, Vec3 eye) {
    const FaceView seen = view_of_face(medium_.block, face, eye);
    if (!(*std::ranges::min_element(seen.cosine.samples()) > 0.0F)) return;
    std::vector<diffusion::CameraRay> rays;
    std::vector<double> flux_gain;
    for (int row = 0; row < seen.cosine.height(); ++row) {
      for (int column = 0; column < seen.cosine.width(); ++column) {
        rays.push_back(diffusion::camera_ray(
            ior_, seen.direction.at(column, row, 0), seen.direction.at(column, row, 1)));
        flux_gain.push_back(2.0 * boundary_.a + 3.0 / rays.back().stretch);
      }
    }
    views_[static_cast<std::size_t>(face)].emplace(
        View{rays, diffusion::CameraRays(medium_, boundary_, face, rays), std::move(flux_gain)});
  }

  // The net flux whose P1 radiance is what the rays see.
  void see(const View& view,
           Face face,
           std::span<const double> phi,
           const Entered& entered,
           std::span<double> flux) const {
    const diffusion::SurfaceTerms& terms = entered.terms;
    view.rays.gather(phi.data(), terms.source, flux);
    if (source_.model == diffusion::SourceModel::kCollimated && !entered.q.empty()) {
      const auto more =
          diffusion::lit_surface(medium_, boundary_, ior_, face, view.directions, entered.q);
      for (std::size_t i = 0; i < flux.size(); ++i) flux[i] += more[i];
    }
    for (std::size_t i = 0; i < flux.size(); ++i) {
      const double source = terms.source.empty() ? 0.0 : terms.source[i];
      const double escape = terms.escape.empty() ? 0.0 : terms.escape[i];
      flux[i] = (flux[i] - source) / view.flux_gain[i] + escape;
    }
  }

  void write_face(Face face,
                  std::span<const double> phi,
                  const Entered& entered,
                  SurfaceField& field) const {
    const diffusion::SurfaceTerms& terms = entered.terms;
    std::vector<double> flux(medium_.block.face_cell_count(face));
    if (const auto& view = views_[static_cast<std::size_t>(face)]) {
      see(*view, face, phi, entered, flux);
    } else {
      diffusion::net_flux(medium_, boundary_, face, phi, terms.source, terms.escape, flux);
    }
    FaceField& out = field.faces[static_cast<std::size_t>(face)];
    for (std::size_t i = 0; i < flux.size(); ++i) {
      const double source = terms.source.empty() ? 0.0 : terms.source[i];
      const std::size_t at = kColorChannels * i + channel_;
      out.net_flux.samples()[at] = static_cast<float>(flux[i]);
      out.fluence.samples()[at] = static_cast<float>(source + 2.0 * boundary_.a * flux[i]);
    }
  }

  int channel_;
  double ior_;
  diffusion::Boundary boundary_;
  diffusion::SourceOptions source_;
  diffusion::Medium medium_;
  std::array<std::optional<diffusion::FaceSource>, 6> entries_;
  std::array<std::optional<View>, 6> views_;
};

SurfaceField dark(const Material& material) {
  SurfaceField field{material.block, material.ior, {}};
  for (const Face face : kFaces) {
    const Image<float> black(
        material.block.face_width(face), material.block.face_height(face), kColorChannels);
    field.faces[static_cast<std::size_t>(face)] = {black, black};
  }
  return field;
}

Result<void> illuminate_channel(Channel& channel,
                                std::span<const Light> lights,
                                const diffusion::SolveOptions& options,
                                diffusion::FluenceSolver& solver,
                                std::stop_token stop,
                                std::vector<SurfaceField>& fields) {
  if (auto prepared = solver.prepare(channel.medium()); !prepared) return prepared;
  const std::size_t cells = channel.medium().block.cell_count();
  diffusion::FieldBatch b(cells, static_cast<int>(lights.size()));
  diffusion::FieldBatch phi(cells, b.count);
  for (int m = 0; m < b.count; ++m) channel.deposit(lights[m], {b.field(m), cells});
  const auto summary = solver.solve(b, phi, options, std::move(stop));
  if (!summary) return summary.error();
  if (!(summary->relative_residual < kUselessResidual))
    return internal_error(fmt::format("the diffusion solver {}", summary->message));
  for (int m = 0; m < b.count; ++m)
    channel.write_surface(lights[m], {phi.field(m), cells}, fields[m]);
  return ok();
}

}  // namespace

Image<float> reflected(const Image<float>& reflectance, const Image<float>& irradiance) {
  Image<float> radiance = reflectance;
  for (std::size_t i = 0; i < radiance.samples().size(); ++i)
    radiance.samples()[i] *= irradiance.samples()[i];
  return radiance;
}

Result<std::vector<SurfaceField>> illuminate(const Material& material,
                                             std::span<const Light> lights,
                                             const TranslucencyOptions& options,
                                             diffusion::FluenceSolver& solver,
                                             std::stop_token stop) {
  if (auto good = validate(material, lights); !good) return good.error();
  const auto boundary = diffusion::make_boundary(options.boundary, material.ior);
  if (!boundary) return boundary.error();
  std::vector<SurfaceField> fields(lights.size(), dark(material));
  if (lights.empty()) return fields;
  for (int c = 0; c < kColorChannels; ++c) {
    Channel channel(material, c, *boundary, options);
    auto lit = illuminate_channel(channel, lights, options.solve, solver, stop, fields);
    if (!lit) return lit.error().in(fmt::format("{} channel", kChannelNames[c]));
  }
  return fields;
}

}  // namespace opaline::render
