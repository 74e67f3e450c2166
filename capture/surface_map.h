#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/face_view.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/hdr_merge.h"

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
/// Where the camera's place is not exact, nor is the point of the face that a pixel sees. A small motion of what the camera sees moves
/// the point p under its ray of direction d, on the face of normal n, by
///
///   u = -(m - d (n m) / (n d)),    m = [w]x R p + s in the sample's frame
///
/// (CameraCalibration::place_covariance), and a cell's variance gains g' Cov(u) g with g the radiance's slope there, by differences
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
  /// A cell needs `min_coverage` of its area on usable pixels.
  SurfaceRadiance apply(const HdrImage& hdr, double min_coverage) const;
  /// 1 for camera pixels that lie wholly on the face.
  const Image<std::uint8_t>& footprint() const { return footprint_; }
  const FaceView& view() const { return view_; }

  /// What a cell has of a camera pixel.
  struct Share {
    int x;
    int y;
    float area;  ///< of the pixel, in pixels
  };
  std::size_t cell_count() const { return cells_.size(); }
  /// Of the cell at this place of the face's raster, row by row.
  const std::vector<Share>& shares_of(std::size_t place) const { return cells_[place].shares; }
  double cell_area(std::size_t place) const { return cells_[place].area; }  ///< pixels

  /// Of the point seen where a cell should be: variances along columns and rows, and their covariance, in cells.
  struct PlaceVariance {
    double column = 0.0;
    double row = 0.0;
    double both = 0.0;
  };
  const PlaceVariance& place_of(std::size_t place) const { return cells_[place].place; }
  /// The largest standard deviation of them, in cells, either way.
  double place_deviation() const;

 private:
  struct Cell {
    std::vector<Share> shares;
    double area = 0.0;  // of the whole quadrilateral, in pixels
    PlaceVariance place;
  };
  SurfaceMap(int width, int height) : width_(width), height_(height) {}
  void add_cell(const std::vector<CameraModel::Pixel>& corners, const CameraModel& camera);
  void drop_partial_pixels(const CameraModel& camera);
  void add_place_variance(SurfaceRadiance& surface) const;
  int width_;
  int height_;
  std::vector<Cell> cells_;  // row by row
  Image<std::uint8_t> footprint_;
  FaceView view_;
};

}  // namespace opaline::capture
