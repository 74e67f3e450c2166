#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/face_view.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/calibration.h"
#include "capture/hdr_merge.h"
#include "capture/pixel_shares.h"

namespace opaline::capture {

/// What the camera saw, on the cells of the seen face.
struct SurfaceRadiance {
  Image<float> radiance;     ///< W/(mm^2 sr), 3 channels
  Image<float> variance;     ///< of it
  Image<std::uint8_t> mask;  ///< 1: enough usable pixels
  double place_share =
      0.0;  ///< of the variance of all usable cells: what an inexact place of the camera adds
};

/// Takes camera pixels to the cells of the sample's face. A cell, projected into the picture, is a
/// quadrilateral; its radiance is the mean over the usable pixels it lies on, weighted by the area
/// shared (exact clipping), and its variance the sum of theirs with the weights squared. Pixels
/// that reach over the face's edge see something else as well and are left out.
///
/// Where the camera's place is not exact (CameraCalibration::place_covariance), nor is the point of the face that a pixel sees
/// (slip_of_cell), and a cell's variance gains g' Cov(u) g with g the radiance's slope there, by differences
/// of its neighbours. All cells and lights share that error; as a variance it tells where the place matters, at edges and veins.
class SurfaceMap {
 public:
  /// Errors: kInvalidArgument when the camera is behind the face, is turned away from it, or sees
  /// none of it.
  static Result<SurfaceMap> create(const Block& block,
                                   Face face,
                                   const CameraModel& camera,
                                   const std::array<double, 36>& place_covariance = {});
  /// What create() would say against it, without the work: whether some cell's middle is in the
  /// picture.
  static Result<void> check(const Block& block, Face face, const CameraModel& camera);
  /// Where it is not exact what the light falls on: a light that slips moves all that it does to an even sample along, so its slip
  /// adds to that of the point seen. Of a projector in perspective (its place_covariance) that lights this face or the one opposite.
  void add_light_slip(const Block& block, Face lit_face, const ProjectorCalibration& projector);
  /// A cell needs `min_coverage` of its area on usable pixels.
  SurfaceRadiance apply(const HdrImage& hdr, double min_coverage) const;
  /// 1 for camera pixels that lie wholly on the face.
  const Image<std::uint8_t>& footprint() const { return footprint_; }
  const FaceView& view() const { return view_; }

  std::size_t cell_count() const { return cells_.size(); }
  /// Of the cell at this place of the face's raster, row by row.
  const std::vector<PixelShare>& shares_of(std::size_t place) const {
    return cells_[place].pixels.shares;
  }
  double cell_area(std::size_t place) const { return cells_[place].pixels.area; }  ///< pixels

  const PointVariance& place_of(std::size_t place) const { return cells_[place].place; }
  /// The largest standard deviation of them, in cells, either way.
  double place_deviation() const;

 private:
  struct Cell {
    CellPixels pixels;
    PointVariance place;  // of the point seen
  };
  SurfaceMap(Face face, int width, int height) : face_(face), width_(width), height_(height) {}
  void drop_partial_pixels(const CameraModel& camera);
  void add_place_variance(SurfaceRadiance& surface) const;
  Face face_;
  int width_;
  int height_;
  std::vector<Cell> cells_;  // row by row
  Image<std::uint8_t> footprint_;
  FaceView view_;
};

}  // namespace opaline::capture
