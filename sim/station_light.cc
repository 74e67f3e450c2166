#include "sim/station_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace opaline::sim {
namespace {

constexpr int kSubsamples = 4;  ///< per pixel and axis, when its area is shared among cells

struct FacePoint {
  double column = 0.0;  ///< in cells
  double row = 0.0;
};

double component(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// Where the ray through a camera's pixel position meets the plane of a face, in cells.
class FaceView {
 public:
  FaceView(const CameraModel& camera, const Block& block, Face face)
      : camera_(camera),
        centre_(camera.centre()),
        normal_axis_(axis_of(face)),
        column_axis_(normal_axis_ == 0 ? 1 : 0),
        row_axis_(normal_axis_ == 2 ? 1 : 2),
        plane_(is_max(face) ? component(block.size(), normal_axis_) : 0.0),
        spacing_(block.spacing()) {}

  std::optional<FacePoint> at(double x, double y) const {
    const Vec3 direction = camera_.ray_direction({x, y});
    const double t =
        (plane_ - component(centre_, normal_axis_)) / component(direction, normal_axis_);
    if (!(t > 0.0) || !std::isfinite(t)) return std::nullopt;
    const Vec3 hit = centre_ + direction * t;
    return FacePoint{component(hit, column_axis_) / spacing_[column_axis_],
                     component(hit, row_axis_) / spacing_[row_axis_]};
  }

 private:
  CameraModel camera_;
  Vec3 centre_;
  int normal_axis_;
  int column_axis_;
  int row_axis_;
  double plane_;
  std::array<double, 3> spacing_;
};

/// The corners of a row of pixels; a pixel is small enough to be linear between its corners.
std::vector<std::optional<FacePoint>> corner_row(const FaceView& view, int width, int y) {
  std::vector<std::optional<FacePoint>> corners;
  for (int x = 0; x <= width; ++x) corners.push_back(view.at(x, y));
  return corners;
}

FacePoint between(const std::array<FacePoint, 4>& corners, double u, double v) {
  const auto lerp = [&](auto member) {
    const double top = (1.0 - u) * corners[0].*member + u * corners[1].*member;
    const double bottom = (1.0 - u) * corners[2].*member + u * corners[3].*member;
    return (1.0 - v) * top + v * bottom;
  };
  return {lerp(&FacePoint::column), lerp(&FacePoint::row)};
}

/// Cells of a width x height raster that lie under the quadrilateral, by supersampling.
std::vector<std::pair<std::uint32_t, int>> cells_under(const std::array<FacePoint, 4>& corners,
                                                       int width,
                                                       int height) {
  std::vector<std::pair<std::uint32_t, int>> hits;
  for (int j = 0; j < kSubsamples; ++j) {
    for (int i = 0; i < kSubsamples; ++i) {
      const FacePoint p = between(corners, (i + 0.5) / kSubsamples, (j + 0.5) / kSubsamples);
      const double column = std::floor(p.column);
      const double row = std::floor(p.row);
      if (!(column >= 0.0 && row >= 0.0 && column < width && row < height)) continue;
      const auto cell = static_cast<std::uint32_t>(row * width + column);
      const auto known =
          std::find_if(hits.begin(), hits.end(), [&](const auto& h) { return h.first == cell; });
      known == hits.end() ? hits.emplace_back(cell, 1) : (++known->second, *known);
    }
  }
  return hits;
}

/// Gaussian weights from -radius to radius, normalised.
std::vector<float> gaussian(double sigma) {
  const int radius = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> weights;
  double sum = 0.0;
  for (int i = -radius; i <= radius; ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += weights.back();
  }
  std::vector<float> normalised;
  normalised.reserve(weights.size());
  for (const double weight : weights) normalised.push_back(static_cast<float>(weight / sum));
  return normalised;
}

/// -1 -> 0, -2 -> 1, size -> size - 1, and so on for as often as it takes.
int mirrored(int i, int size) {
  const int period = 2 * size;
  const int phase = ((i % period) + period) % period;
  return phase < size ? phase : period - 1 - phase;
}

/// Convolves `count` samples that lie `stride` apart, in place.
void blur_line(float* samples,
               int count,
               std::size_t stride,
               const std::vector<float>& kernel,
               std::vector<float>& padded) {
  const int radius = static_cast<int>(kernel.size() / 2);
  padded.resize(kernel.size() - 1 + static_cast<std::size_t>(count));
  for (int i = -radius; i < count + radius; ++i)
    padded[i + radius] = samples[mirrored(i, count) * stride];
  for (int i = 0; i < count; ++i) {
    float sum = 0.0f;
    for (std::size_t k = 0; k < kernel.size(); ++k) sum += kernel[k] * padded[i + k];
    samples[i * stride] = sum;
  }
}

/// Responses hold for one place of the camera; within a hundredth of its distance the picture is the same.
Result<void> check_view(const TransportResponses& r, const CameraModel& camera) {
  const Vec3 middle = r.block.face_cell_centre(
      r.seen_face, r.block.face_width(r.seen_face) / 2, r.block.face_height(r.seen_face) / 2);
  const double off = length(camera.centre() - r.camera_centre);
  if (off <= 0.01 * length(r.camera_centre - middle)) return ok();
  return invalid_argument(fmt::format("made for a camera {:.1f} mm away from where it is", off));
}

}  // namespace

Result<void> check_responses(const TransportResponses& r, const CameraModel& camera) {
  if (r.patches_x < 1 || r.patches_y < 1 ||
      r.patches.size() != static_cast<std::size_t>(r.patches_x) * r.patches_y) {
    return invalid_argument(fmt::format(
        "{} responses for {} x {} patches", r.patches.size(), r.patches_x, r.patches_y));
  }
  for (const PatchResponse& patch : r.patches) {
    if (patch.radiance.width() != r.block.face_width(r.seen_face) ||
        patch.radiance.height() != r.block.face_height(r.seen_face) ||
        patch.radiance.channels() != 3) {
      return invalid_argument("a response's size is not that of the seen face's cells");
    }
  }
  return check_view(r, camera);
}

Image<float> blurred(const Image<float>& picture, double sigma_px) {
  if (sigma_px <= 0.0 || picture.empty()) return picture;
  const std::vector<float> kernel = gaussian(sigma_px);
  Image<float> result = picture;
  const auto channels = static_cast<std::size_t>(picture.channels());
  const std::size_t row = channels * picture.width();
  std::vector<float> padded;
  for (std::size_t i = 0; i < row; ++i)
    blur_line(&result.samples()[i], picture.height(), row, kernel, padded);
  for (int y = 0; y < picture.height(); ++y) {
    for (std::size_t c = 0; c < channels; ++c) {
      blur_line(&result.samples()[y * row + c], picture.width(), channels, kernel, padded);
    }
  }
  return result;
}

StationOptics::StationOptics(const CameraOptics& camera,
                             const ProjectorOptics& projector,
                             std::shared_ptr<const TransportResponses> responses,
                             const SurfaceOptions& surface)
    : camera_(camera),
      responses_(std::move(responses)),
      patches_(projector,
               responses_->block,
               responses_->lit_face,
               responses_->patches_x,
               responses_->patches_y) {
  const Block& block = responses_->block;
  const Face face = responses_->seen_face;
  if (face == responses_->lit_face && surface.reflectance > 0.0) {
    reflectance_ = surface_reflectance(surface, block, face);
    cells_.emplace(projector, block, face, block.face_width(face), block.face_height(face));
  }
  const FaceView view(camera.model, block, face);
  auto above = corner_row(view, camera.model.width, 0);
  for (int y = 0; y < camera.model.height; ++y) {
    auto below = corner_row(view, camera.model.width, y + 1);
    for (int x = 0; x < camera.model.width; ++x) {
      first_share_.push_back(static_cast<std::uint32_t>(shares_.size()));
      if (!above[x] || !above[x + 1] || !below[x] || !below[x + 1]) continue;
      const std::array corners{*above[x], *above[x + 1], *below[x], *below[x + 1]};
      for (const auto& [cell, hits] :
           cells_under(corners, block.face_width(face), block.face_height(face))) {
        shares_.push_back({cell, static_cast<float>(hits) / (kSubsamples * kSubsamples)});
      }
    }
    above = std::move(below);
  }
  first_share_.push_back(static_cast<std::uint32_t>(shares_.size()));
}

StationLight StationOptics::light(const Image<std::uint8_t>& codes) const {
  StationLight light;
  light.patch_irradiance = patches_.irradiance(codes);
  light.surface_radiance = surface(light.patch_irradiance);
  if (!reflectance_.empty()) reflect(codes, light.surface_radiance);
  light.sensor_radiance = blurred(seen(light.surface_radiance), camera_.psf_sigma_px);
  return light;
}

StationLight StationOptics::dark() const {
  const Block& block = responses_->block;
  const Face face = responses_->seen_face;
  return {std::vector<Rgb>(responses_->patches.size(), Rgb{}),
          Image<float>(block.face_width(face), block.face_height(face), 3),
          {}};
}

Image<float> StationOptics::surface(const std::vector<Rgb>& patch_irradiance) const {
  const Block& block = responses_->block;
  const Face face = responses_->seen_face;
  Image<float> sum(block.face_width(face), block.face_height(face), 3);
  for (std::size_t p = 0; p < patch_irradiance.size(); ++p) {
    const std::span<const float> response = responses_->patches[p].radiance.samples();
    for (std::size_t i = 0; i < response.size(); ++i) {
      sum.samples()[i] += static_cast<float>(patch_irradiance[p][i % 3]) * response[i];
    }
  }
  return sum;
}

void StationOptics::reflect(const Image<std::uint8_t>& codes, Image<float>& radiance) const {
  const std::vector<Rgb> irradiance = cells_->irradiance(codes);
  const std::span<const float> reflectance = reflectance_.samples();
  for (std::size_t i = 0; i < reflectance.size(); ++i)
    radiance.samples()[i] += static_cast<float>(irradiance[i / 3][i % 3]) * reflectance[i];
}

Image<float> StationOptics::seen(const Image<float>& surface) const {
  Image<float> picture(camera_.model.width, camera_.model.height, 3);
  for (std::size_t pixel = 0; pixel < picture.pixel_count(); ++pixel) {
    for (std::uint32_t s = first_share_[pixel]; s < first_share_[pixel + 1]; ++s) {
      const Share& share = shares_[s];
      for (std::size_t c = 0; c < 3; ++c) {
        picture.samples()[3 * pixel + c] +=
            share.weight * surface.samples()[3 * std::size_t{share.cell} + c];
      }
    }
  }
  return picture;
}

}  // namespace opaline::sim
