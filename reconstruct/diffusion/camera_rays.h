#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/block.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct::diffusion {

/// A camera's ray behind one cell of the seen face, refracted there.
struct CameraRay {
  double column = 0.0;   ///< what the ray moves along the face's column axis for each mm of depth
  double row = 0.0;      ///< the same along its row axis
  double stretch = 1.0;  ///< 1 / mu_i: length for each mm of depth
};

/// `column` and `row` are the components of the unit vector towards the camera, outside, along the face's axes.
CameraRay camera_ray(double ior, double column, double row);

/// What a camera sees of diffused light inside a medium, along refracted rays: the formal solution of the transport
/// equation over isotropic scattering of the fluence (docs/physics.md, "Radiance towards a camera"),
///
///   L = F_t / (4 pi eta^2) Phi,   Phi = integral of alpha' phi e^(-tau) dtau
///
/// A ray crosses layers n = 1..N of cells with t_n = stretch h sigma_t'_n and alpha'_n, of the layer's four cells
/// around the ray; E_n = E_(n-1) e^(-t_n), D_n = E_(n-1) - E_n. phi is piecewise linear between the layers' centres
/// (bilinear among the four cells: v_n) and the surface, v_0 = phi_s = S + 2 A g_b (phi - S), and is taken at each
/// layer's centroid of e^(-tau), beta(t) before the centre:
///
///   Phi = sum_n alpha'_n D_n ((1 - b_n) v_n + b_n v_(n-1)) + alpha'_N E_N (v_N + k (v_N - v_(N-1)))
///   b_1 = 2 beta(t_1), else beta(t_n);   k = 1/2 + 1/t_N, twice that where N = 1
///
/// The last term goes on along the last slope: where phi is linear, Phi is the P1 law's phi_s + 3 J_n mu_i, to alpha'.
/// N is the block's depth, or less where E_N is so small that the curvature beyond does not matter.
///
/// Shapes: rasters over the cells of the seen face. Threads: const members from any.
class CameraRays {
 public:
  CameraRays(const Medium& medium,
             const Boundary& boundary,
             Face face,
             std::span<const CameraRay> rays);

  /// Phi of one field; `source` is the face's S, or empty where it is not lit.
  void gather(const double* phi, std::span<const double> source, std::span<double> out) const;
  /// b += transposed gather of g (what depends on S left out).
  void scatter(std::span<const double> g, double* b) const;

  /// Adds the derivative of sum_m g_m . Phi_m by the medium at fixed fluence. `source` and `g` are
  /// one raster an illumination; those of `source` may be empty.
  void add_gradient(const FieldBatch& phi,
                    std::span<const std::vector<double>> source,
                    std::span<const std::vector<double>> g,
                    MediumGradient& gradient) const;
  /// The same forwards: adds dPhi/dmedium . change at fixed fluence to `out`.
  void add_tangent(const double* phi,
                   std::span<const double> source,
                   const MediumChange& change,
                   std::span<double> out) const;

 private:
  struct Sample {          // where a ray crosses the middle of a layer
    std::size_t cell = 0;  // the first of the four
    std::array<double, 4> weight{};
    double t = 0.0;
    double albedo = 0.0;     // alpha'
    double deposited = 0.0;  // D
    double remaining = 0.0;  // E
    double shift = 0.0;      // b
    double shift_slope = 0.0;
    double share = 0.0;  // of v_n in Phi
  };
  struct Ray {
    std::size_t surface = 0;  // the cell behind the pixel
    std::size_t first = 0;    // sample
    std::size_t count = 0;
    double stretch = 1.0;
    double surface_share = 0.0;  // of v_0 in Phi
    double fluence_share = 0.0;  // of phi in v_0, 2 A g_b
    double fluence_slope = 0.0;  // d fluence_share / dkappa
  };
  struct Slopes {  // by one layer
    double t = 0.0;
    double albedo = 0.0;
  };
  class Raster;

  Sample sample(const Medium& medium,
                const Raster& raster,
                double column,
                double row,
                std::size_t layer) const;
  void trace(const Medium& medium, const Raster& raster, int column, int row, const CameraRay& ray);
  void add_shares(Ray& ray);
  double tail_slope(std::size_t n, double t) const;
  std::span<const Sample> samples(const Ray& ray) const {
    return std::span(samples_).subspan(ray.first, ray.count);
  }
  double at(const Sample& s, const double* field) const;
  /// v_0 ... v_N.
  void values(const Ray& ray, const double* phi, double source, std::span<double> v) const;
  /// The derivatives of Phi from the layers' values.
  void slopes(std::span<const Sample> samples,
              std::span<const double> v,
              std::span<Slopes> out) const;

  double h_ = 0.0;
  std::array<std::size_t, 4> corner_{};  // offsets of the four cells
  std::size_t deepest_ = 0;              // the largest count
  std::vector<double> diffusion_;        // of the medium
  std::vector<double> absorption_;
  std::vector<Ray> rays_;
  std::vector<Sample> samples_;
};

}  // namespace opaline::reconstruct::diffusion
