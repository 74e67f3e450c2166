#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/block.h"
#include "sim/light_transport_medium.h"

namespace opaline::sim {

/// The refracted ray from a point inside the block through a plane face to the camera's centre. With d the point's depth
/// under the face, H the camera's height over it, Delta their lateral distance:
///
///   Delta = d tan(i) + H tan(o),   sin(o) = n sin(i)
///   dOmega_i / dA = 1 / [ cos(o) (d / cos(i) + n H / cos(o)) (d / cos^2(i) + n H cos(i) / cos^3(o)) ]
///
/// dA is perpendicular to the ray at the camera; the two brackets are the derivatives of the ray's landing point by
/// azimuth and by i, the first over sin(i). For a far camera this is cos(o) / (n^2 cos(i) r^2), the n^2 law of radiance.
///
/// Solved for rho, the share of Delta covered inside, with s = 1 - rho, q = (Delta / H)^2, D^2 = n^2 + (n^2 - 1) q s^2:
/// rho = (d / H) s / D by Newton's iteration; cos(o) = 1 / sqrt(1 + q s^2), cos(i) = D cos(o) / n.
struct RefractedRay {
  double share_inside = 0.0;  ///< rho
  double cosine_inside = 1.0;
  double cosine_outside = 1.0;
  double distance_outside = 0.0;      ///< r, exit point to camera, mm
  double solid_angle_per_area = 0.0;  ///< dOmega_i / dA, sr/mm^2
};

RefractedRay refract_to_camera(double depth, double height, double lateral_squared, double ior);

/// Local estimation for one seen face and camera: what a scattering event adds to the radiance of a
/// cell.
///
/// Every event has a direct ray, and one through a mirror reflection at each other face (total
/// internal reflection turns sides into mirrors): rays from the event's mirror images, folded back
/// into the block. Longer chains of reflections without a scattering in between (two at opposite
/// faces, or a side and the face opposite) are left out. With periodic sides the seen face is a z
/// face.
///
/// Threads: const calls from any thread. `medium` must outlive this.
class CameraConnection {
 public:
  CameraConnection(const LightTransportMedium& medium, Face seen, Vec3 centre);

  /// Adds radiance sums to `radiance` (cells of the seen face) for an event of power `weight` (W)
  /// at `point`, reached along unit `direction`. Dividing by emitted photons is the caller's.
  /// `random` in [0, 1) thins faint reflections.
  void connect(const std::array<double, 3>& point,
               const std::array<double, 3>& direction,
               double weight,
               double random,
               std::span<double> radiance) const;

 private:
  struct Image {
    std::array<double, 3> point{};  // where the event seems to be, unfolded
    int mirrors = 0;                // bit a: mirrored along axis a
  };
  void add_image(const Image& image,
                 const std::array<double, 3>& direction,
                 double weight,
                 std::span<double> radiance) const;
  double transmittance(const std::array<double, 3>& from,
                       const std::array<double, 3>& direction,
                       double length) const;
  std::size_t folded_cell(std::array<int, 3> cell) const;

  const LightTransportMedium& medium_;
  Face seen_;
  std::array<double, 3> size_;
  std::array<double, 3> camera_;
  std::array<double, 3> spacing_;
  std::array<double, 3> inverse_spacing_;
  std::array<int, 3> cells_;
  int normal_;  // axis of the seen face
  int column_axis_;
  int row_axis_;
  double height_;  // of the camera over the face
  double reach_;   // largest tan(i) of any ray to the camera
};

}  // namespace opaline::sim
