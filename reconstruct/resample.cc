#include "reconstruct/resample.h"

#include <algorithm>
#include <cmath>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Share of each of n equal cells within each of `coarse`.
MatrixXd overlaps(int n, int coarse) {
  MatrixXd o(coarse, n);
  const double ratio = static_cast<double>(n) / coarse;
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < coarse; ++c)
      o(c, i) = std::clamp(
          std::min<double>(i + 1, (c + 1) * ratio) - std::max<double>(i, c * ratio), 0.0, 1.0);
  return o;
}

MatrixXd between_centres(int coarse, int n) {
  MatrixXd m = MatrixXd::Zero(n, coarse);
  for (int i = 0; i < n; ++i) {
    const double at =
        std::clamp((i + 0.5) * coarse / n - 0.5, 0.0, static_cast<double>(coarse - 1));
    const int before = std::min(static_cast<int>(at), std::max(coarse - 2, 0));
    m(i, before) += 1.0 - (at - before);
    if (coarse > 1) m(i, before + 1) += at - before;
  }
  return m;
}

using AxisMatrix = MatrixXd (*)(int, int);

std::array<MatrixXd, 3> along_axes(AxisMatrix make, const Block& from, const Block& to) {
  std::array<MatrixXd, 3> m;
  for (std::size_t axis = 0; axis < 3; ++axis) m[axis] = make(from.cells()[axis], to.cells()[axis]);
  return m;
}

// A raster of one face: its two axes, and one of a single cell.
std::vector<double> resample_face(
    AxisMatrix make, const Block& from, const Block& to, Face face, std::vector<double> raster) {
  const std::array<MatrixXd, 3> m{make(from.face_width(face), to.face_width(face)),
                                  make(from.face_height(face), to.face_height(face)),
                                  MatrixXd::Ones(1, 1)};
  return multiply_along_axes(
      {from.face_width(face), from.face_height(face), 1}, m, std::move(raster));
}

}  // namespace

MatrixXd cell_means(int n, int coarse) {
  return overlaps(n, coarse) * (static_cast<double>(coarse) / n);
}

std::vector<double> multiply_along_axes(const Extent& extent,
                                        const std::array<MatrixXd, 3>& m,
                                        std::vector<double> field) {
  using Map = Eigen::Map<const MatrixXd>;
  ENSURE(field.size() == static_cast<std::size_t>(extent[0]) * extent[1] * extent[2]);
  const Index nx = m[0].rows();
  const Index ny = m[1].rows();
  const MatrixXd x = m[0] * Map(field.data(), extent[0], static_cast<Index>(extent[1]) * extent[2]);
  MatrixXd y(nx * ny, extent[2]);
  for (Index k = 0; k < extent[2]; ++k)
    Eigen::Map<MatrixXd>(y.col(k).data(), nx, ny) =
        x.middleCols(k * extent[1], extent[1]) * m[1].transpose();
  const MatrixXd z = y * m[2].transpose();
  return {z.data(), z.data() + z.size()};
}

Block coarser_block(const Block& block, std::size_t most) {
  const Vec3 size = block.size();
  const std::array<double, 3> extent{size.x, size.y, size.z};
  for (double h = std::min({block.hx, block.hy, block.hz});; h *= std::pow(2.0, 0.125)) {
    std::array<int, 3> n{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      n[axis] = std::clamp(static_cast<int>(std::lround(extent[axis] / h)), 1, block.cells()[axis]);
    const Block coarse{n[0], n[1], n[2], extent[0] / n[0], extent[1] / n[1], extent[2] / n[2]};
    if (coarse.cell_count() <= std::max<std::size_t>(most, 1)) return coarse;
  }
}

std::vector<double> average_cells(const Block& block,
                                  const Block& coarse,
                                  std::vector<double> field) {
  return multiply_along_axes(
      block.cells(), along_axes(cell_means, block, coarse), std::move(field));
}

std::vector<double> interpolate_cells(const Block& coarse,
                                      const Block& block,
                                      std::vector<double> field) {
  return multiply_along_axes(
      coarse.cells(), along_axes(between_centres, coarse, block), std::move(field));
}

ChannelProblem coarsen(const ChannelProblem& problem, const Block& coarse) {
  const auto seen = [&](AxisMatrix make, std::vector<double> raster) {
    return resample_face(make, problem.block, coarse, problem.seen_face, std::move(raster));
  };
  ChannelProblem out = problem;
  out.block = coarse;
  const auto mean = [&](const auto& values, auto member) {
    std::vector<double> raster;
    raster.reserve(values.size());
    for (const auto& value : values) raster.push_back(value.*member);
    return seen(cell_means, std::move(raster));
  };
  using diffusion::CameraEquation;
  using diffusion::CameraRay;
  const auto source_gain = mean(problem.camera, &CameraEquation::source_gain);
  const auto flux_gain = mean(problem.camera, &CameraEquation::flux_gain);
  out.camera.clear();
  out.rays.clear();
  for (std::size_t x = 0; x < flux_gain.size(); ++x)
    out.camera.push_back({source_gain[x], flux_gain[x]});
  if (!problem.rays.empty()) {
    const auto column = mean(problem.rays, &CameraRay::column);
    const auto row = mean(problem.rays, &CameraRay::row);
    const auto stretch = mean(problem.rays, &CameraRay::stretch);
    for (std::size_t x = 0; x < stretch.size(); ++x)
      out.rays.push_back({column[x], row[x], stretch[x]});
  }
  for (ChannelIllumination& i : out.illuminations) {
    i.irradiance =
        resample_face(cell_means, problem.block, coarse, problem.lit_face, std::move(i.irradiance));
    for (std::size_t x = 0; x < i.weight.size(); ++x) i.radiance[x] *= i.weight[x];
    i.weight = seen(overlaps, std::move(i.weight));
    i.radiance = seen(overlaps, std::move(i.radiance));
    for (std::size_t x = 0; x < i.weight.size(); ++x)
      i.radiance[x] = i.weight[x] > 0.0 ? i.radiance[x] / i.weight[x] : 0.0;
  }
  return out;
}

}  // namespace opaline::reconstruct
