#include "daemon/report/relighting.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

/// 1 where a pixel's middle sees the face, fully covered, on a cell that the mask keeps; 2 where the
/// mask leaves the cell out; 0 elsewhere.
Image<std::uint8_t> views_of_face(const Image<float>& rendered,
                                  const CameraModel& camera,
                                  const Block& block,
                                  Face face,
                                  const Image<std::uint8_t>& cell_mask) {
  Image<std::uint8_t> views(rendered.width(), rendered.height(), 1);
  for (int y = 0; y < views.height(); ++y) {
    for (int x = 0; x < views.width(); ++x) {
      if (rendered.at(x, y, 3) < 0.999F) continue;
      const auto cell = cell_seen_by(camera, block, face, {x + 0.5, y + 0.5});
      if (cell) views.at(x, y) = cell_mask.at(cell->column, cell->row) != 0 ? 1 : 2;
    }
  }
  return views;
}

bool sees_face_around(const Image<std::uint8_t>& views, int x, int y, int margin) {
  if (x < margin || y < margin || x + margin >= views.width() || y + margin >= views.height()) {
    return false;
  }
  for (int v = y - margin; v <= y + margin; ++v) {
    for (int u = x - margin; u <= x + margin; ++u) {
      if (views.at(u, v) == 0) return false;
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

/// Root mean square of each channel over the cells that can be used.
std::array<double, kColorChannels> levels_of(const Illumination& light) {
  std::array<double, kColorChannels> levels{};
  std::size_t count = 0;
  for (int y = 0; y < light.mask.height(); ++y) {
    for (int x = 0; x < light.mask.width(); ++x) {
      if (light.mask.at(x, y) == 0) continue;
      for (int c = 0; c < kColorChannels; ++c) {
        levels[c] += std::pow(light.radiance.at(x, y, c), 2.0);
      }
      ++count;
    }
  }
  for (double& level : levels)
    level = std::sqrt(level / static_cast<double>(std::max<std::size_t>(count, 1)));
  return levels;
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
  const auto views = views_of_face(rendered, camera, block, seen_face, cell_mask);
  Image<std::uint8_t> counts(rendered.width(), rendered.height(), 1);
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) {
      counts.at(x, y) = views.at(x, y) == 1 && sees_face_around(views, x, y, margin) ? 1 : 0;
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
  const auto levels = levels_of(light);
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
        const double model = model_error * std::hypot(measured, levels[c]);
        chi_squared += difference * difference / (variance + model * model);
        ++count;
      }
    }
  }
  if (count > 0) fit.chi_squared_per_datum = chi_squared / static_cast<double>(count);
  return fit;
}

}  // namespace opaline::daemon
