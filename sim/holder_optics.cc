#include "sim/holder_optics.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "sim/options_check.h"

namespace opaline::sim {
namespace {

constexpr int kPlacesAcross = 2;  // of a pixel, each way

/// What a ray sees of the board.
double albedo_along(const HolderScene& holder, Vec3 eye, Vec3 ray, double focal_px) {
  const Pose board_from_sample = holder.sample_from_board.inverse();
  const Vec3 from = board_from_sample.apply(eye);
  const Vec3 way = board_from_sample.rotate(ray);
  const double t = -from.z / way.z;
  if (!(t > 0.0) || from.z > 0.0) return 0.0;  // its front is at negative z
  const double footprint = t * length(way) / focal_px / kPlacesAcross;
  return holder.board.albedo(from.x + t * way.x, from.y + t * way.y, footprint);
}

Image<float> albedo_seen(const CameraOptics& camera,
                         const TransportResponses& responses,
                         const HolderScene& holder) {
  const CameraModel& lens = camera.model;
  const SeenFace face{responses.block, responses.seen_face};
  const Vec3 eye = lens.centre();
  Image<float> seen(lens.width, lens.height, 1);
  for (int y = 0; y < lens.height * kPlacesAcross; ++y) {
    for (int x = 0; x < lens.width * kPlacesAcross; ++x) {
      const Vec3 ray =
          normalized(lens.ray_direction({(x + 0.5) / kPlacesAcross, (y + 0.5) / kPlacesAcross}));
      if (face.holds(eye, ray)) continue;
      seen.at(x / kPlacesAcross, y / kPlacesAcross) +=
          static_cast<float>(albedo_along(holder, eye, ray, lens.fx) / std::numbers::pi /
                             (kPlacesAcross * kPlacesAcross));
    }
  }
  return blurred(seen, camera.psf_sigma_px);
}

Image<std::uint8_t> pixels_beside(const ProjectorOptics& projector,
                                  const TransportResponses& responses) {
  const Block& block = responses.block;
  const Face face = responses.lit_face;
  const Vec3 size = block.size();
  const double width = axis_of(face) == 0 ? size.y : size.x;
  const double height = axis_of(face) == 2 ? size.y : size.z;
  Image<std::uint8_t> beside(projector.width, projector.height, 1);
  for (int y = 0; y < projector.height; ++y) {
    for (int x = 0; x < projector.width; ++x) {
      const auto [column, row] = lit_by(projector, block, face, x + 0.5, y + 0.5);
      const bool on = column >= 0.0 && row >= 0.0 && column <= width && row <= height;
      beside.at(x, y) = on ? 0 : 1;
    }
  }
  return beside;
}

}  // namespace

Result<void> validate(const HolderScene& holder) {
  OptionsCheck check;
  check.within("holder.squares_x", holder.board.squares_x, 3, 100)
      .within("holder.squares_y", holder.board.squares_y, 3, 100)
      .above("holder.square_mm", holder.board.square_mm, 0.0)
      .within("holder.glow", holder.glow, 0.0, 1.0);
  return check.result();
}

LitHolderOptics::LitHolderOptics(const CameraOptics& camera,
                                 const ProjectorOptics& projector,
                                 std::shared_ptr<const TransportResponses> responses,
                                 const HolderScene& holder,
                                 const SurfaceOptions& surface)
    : HeldSample({camera, projector, responses, surface}),
      holder_(camera,
              projector,
              {.board = holder.board,
               .poses = {{.sample_from_board = holder.sample_from_board}},
               .projector = projector.lens,
               .reference_distance_mm = projector.reference_distance_mm,
               .focus_px = 0.0,
               .sample = SeenFace{responses->block, responses->seen_face}}) {}

StationLight LitHolderOptics::light(const Image<std::uint8_t>& codes) const {
  StationLight light = sample_.light(codes);
  const StationLight around = holder_.light(codes);
  for (std::size_t i = 0; i < light.sensor_radiance.samples().size(); ++i)
    light.sensor_radiance.samples()[i] += around.sensor_radiance.samples()[i];
  return light;
}

HolderOptics::HolderOptics(const CameraOptics& camera,
                           const ProjectorOptics& projector,
                           std::shared_ptr<const TransportResponses> responses,
                           const HolderScene& holder,
                           const SurfaceOptions& surface)
    : HeldSample({camera, projector, responses, surface}),
      camera_(camera),
      projector_(projector),
      glow_(holder.glow),
      is_beside_(pixels_beside(projector, *responses)),
      albedo_(albedo_seen(camera, *responses, holder)),
      vignetting_(vignetting_map(projector.width, projector.height, projector.vignetting)) {}

// Mean irradiance there, W/mm^2.
Rgb HolderOptics::beside(const Image<std::uint8_t>& codes) const {
  const std::array<float, 256> light = light_of_codes(projector_);
  Rgb sum{};
  double count = 0.0;
  for (std::size_t i = 0; i < is_beside_.samples().size(); ++i) {
    if (is_beside_.samples()[i] == 0) continue;
    count += 1.0;
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += vignetting_.samples()[i] * light[codes.samples()[3 * i + c]];
  }
  for (std::size_t c = 0; c < 3; ++c)
    sum[c] *= count > 0.0 ? projector_.peak_irradiance[c] / count : 0.0;
  return sum;
}

StationLight HolderOptics::light(const Image<std::uint8_t>& codes) const {
  StationLight light = sample_.light(codes);
  const Rgb irradiance = beside(codes);
  for (std::size_t i = 0; i < albedo_.samples().size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      light.sensor_radiance.samples()[3 * i + c] +=
          static_cast<float>(glow_ * irradiance[c]) * albedo_.samples()[i];
  }
  return light;
}

}  // namespace opaline::sim
