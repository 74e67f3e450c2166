#include "daemon/report/relighting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "daemon/report/surface_radiance.h"

namespace opaline::daemon {
namespace {

constexpr int kOutlineMargin = 3;  // pixels: five standard deviations of the demo's lens

/// Where a pixel's ray meets the face's plane, as a cell of its raster.
struct FaceCell {
  int column = 0;
  int row = 0;
};
std::optional<FaceCell> cell_seen_by(const CameraModel& camera,
                                     const Block& block,
                                     Face face,
                                     CameraModel::Pixel pixel) {
  const Vec3 from = camera.centre();
  const Vec3 ray = camera.ray_direction(pixel);
  const int axis = axis_of(face);
  const std::array<double, 3> o{from.x, from.y, from.z};
  const std::array<double, 3> d{ray.x, ray.y, ray.z};
  const Vec3 size = block.size();
  const double plane = is_max(face) ? std::array{size.x, size.y, size.z}[axis] : 0.0;
  if (d[axis] == 0.0) return std::nullopt;
  const double t = (plane - o[axis]) / d[axis];
  const std::array<double, 3> h = block.spacing();
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  const int column = static_cast<int>(std::floor((o[u] + t * d[u]) / h[u]));
  const int row = static_cast<int>(std::floor((o[v] + t * d[v]) / h[v]));
  if (t <= 0.0 || column < 0 || column >= block.face_width(face) || row < 0 ||
      row >= block.face_height(face)) {
    return std::nullopt;
  }
  return FaceCell{column, row};
}

bool is_covered_around(const Image<float>& rendered, int x, int y, int margin) {
  for (int v = y - margin; v <= y + margin; ++v) {
    for (int u = x - margin; u <= x + margin; ++u) {
      if (u < 0 || v < 0 || u >= rendered.width() || v >= rendered.height()) return false;
      if (rendered.at(u, v, 3) < 0.999F) return false;
    }
  }
  return true;
}

Image<float> without_coverage(const Image<float>& rgba) {
  Image<float> rgb(rgba.width(), rgba.height(), 3);
  for (int y = 0; y < rgba.height(); ++y) {
    for (int x = 0; x < rgba.width(); ++x) {
      for (int c = 0; c < 3; ++c) rgb.at(x, y, c) = rgba.at(x, y, c);
    }
  }
  return rgb;
}

ChannelErrors compare(const RelitLight& light, const HdrPicture& captured) {
  ChannelErrors errors;
  for (int y = 0; y < light.counts.height(); ++y) {
    for (int x = 0; x < light.counts.width(); ++x) {
      if (light.counts.at(x, y) == 0) continue;
      for (int c = 0; c < kColorChannels; ++c) {
        errors.channels[c].add(
            light.relit.at(x, y, c), captured.radiance.at(x, y, c), captured.variance.at(x, y, c));
      }
    }
  }
  return errors;
}

}  // namespace

Image<std::uint8_t> pixels_that_count(const Image<float>& rendered,
                                      const CameraModel& camera,
                                      const Block& block,
                                      Face seen_face,
                                      const Image<std::uint8_t>& cell_mask,
                                      int margin) {
  Image<std::uint8_t> counts(rendered.width(), rendered.height(), 1);
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) {
      if (!is_covered_around(rendered, x, y, margin)) continue;
      const auto cell = cell_seen_by(camera, block, seen_face, {x + 0.5, y + 0.5});
      counts.at(x, y) = cell && cell_mask.at(cell->column, cell->row) != 0 ? 1 : 0;
    }
  }
  return counts;
}

Result<RelitLight> relight(render::Renderer& renderer,
                           const render::SurfaceField& field,
                           const CameraModel& camera,
                           const Dataset& dataset,
                           const Illumination& light,
                           const HdrPicture& captured,
                           std::stop_token stop) {
  if (captured.radiance.width() != camera.width || captured.radiance.height() != camera.height) {
    return invalid_argument(fmt::format("{}: the picture has {} x {} pixels, the camera {} x {}",
                                        light.name,
                                        captured.radiance.width(),
                                        captured.radiance.height(),
                                        camera.width,
                                        camera.height));
  }
  const auto drawn = renderer.draw(field, camera, std::move(stop));
  if (!drawn) return drawn.error().in(light.name);
  RelitLight relit{
      light.name,
      captured.radiance,
      without_coverage(*drawn),
      pixels_that_count(
          *drawn, camera, dataset.block, dataset.seen_face, light.mask, kOutlineMargin),
      {}};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (captured.usable.at(x, y) == 0) relit.counts.at(x, y) = 0;
    }
  }
  relit.errors = compare(relit, captured);
  return relit;
}

SurfaceFit fit_on_surface(const Dataset& dataset,
                          const Illumination& light,
                          const render::SurfaceField& field,
                          double model_error) {
  SurfaceFit fit{light.name,
                 light.held_out,
                 surface_radiance(field, dataset.seen_face, dataset.view_cosine),
                 {},
                 0.0};
  double chi_squared = 0.0;
  std::size_t count = 0;
  for (int row = 0; row < light.mask.height(); ++row) {
    for (int column = 0; column < light.mask.width(); ++column) {
      if (light.mask.at(column, row) == 0) continue;
      for (int c = 0; c < kColorChannels; ++c) {
        const double measured = light.radiance.at(column, row, c);
        const double variance = light.radiance_variance.at(column, row, c);
        const double difference = fit.predicted.at(column, row, c) - measured;
        fit.errors.channels[c].add(fit.predicted.at(column, row, c), measured, variance);
        const double model = model_error * measured;
        chi_squared += difference * difference / (variance + model * model);
        ++count;
      }
    }
  }
  if (count > 0) fit.chi_squared_per_datum = chi_squared / static_cast<double>(count);
  return fit;
}

}  // namespace opaline::daemon
