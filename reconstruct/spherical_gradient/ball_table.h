#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"

namespace opaline::reconstruct {

/// What balls show under constant and gradient light, from transport: the default way from pictures to scattering parameters.
///
/// The dipole, even corrected (curvature_ratio.h), returns 1.3 to 3.9 times the true D of Monte Carlo balls at k l_d of 0.05 to 0.4: light
/// that comes in slanted goes on slanted, which a ball's normals notice and a dipole does not. So (alpha', k l_d) is looked up in traced
/// balls (bench/ball_table.cc; sim/ball_transport.h), k the mean curvature, l_d = 1/sigma_tr = 3 D / g the translucency, g = sqrt(3 (1 - alpha')):
///
///   ln r = sum_i a_i g^i + g sum_(j=1..6) x^j sum_i f_ji g^i,     logit R = sum_(j=0..5) x^j sum_i h_ji g^i,     x = k l_d
///
/// fitted to the balls by least squares, each ball weighed by its own deviation (of R not less than 0.3 %). Both are smooth in g, where absorption ends too.
///
/// Threads: const after make().
class BallTable {
 public:
  struct Row {
    double reduced_albedo;
    double curvature;    ///< k l_d
    double reflectance;  ///< R: flux out over flux in, constant light
    double reflectance_deviation;
    double ratio;  ///< r, of unshifted patterns
    double ratio_deviation;
  };
  struct Light {
    double reflectance;
    double ratio;
  };
  /// Where a search ended.
  enum class End : std::uint8_t {
    kFound,
    kFlat,            ///< the ratio is that of a flat surface, or below
    kTooTranslucent,  ///< for its curvature: k l_d beyond that of any ball
    kTooBright,
    kTooDark,
    kNoNumber,  ///< reflectance outside 0 to 1, or a ratio that is not above 0
  };
  struct Found {
    End end = End::kNoNumber;  ///< nothing else is set where it is not kFound
    double reduced_albedo = 0.0;
    double curvature = 0.0;  ///< k l_d
    /// d(ln g, ln k l_d) / d(reflectance, ratio), row by row: what errors of the pictures do.
    std::array<double, 4> sensitivity{};
  };

  /// Errors: kInvalidArgument where the rows do not determine the fit.
  static Result<BallTable> make(std::span<const Row> rows);
  /// The balls of index 1.4 that come with the program.
  static const BallTable& standard();
  static std::span<const Row> standard_rows();
  /// Balls of any index from 1.3 to 1.5: ln r and logit R of those traced at 1.3, 1.4 and 1.5 as parabolas of the index.
  /// Errors: kInvalidArgument for another one.
  static Result<BallTable> of_index(double ior);

  Light light(double reduced_albedo, double curvature) const;
  /// Newton's iteration in (u, x), u = ln g.
  Found find(double reflectance, double ratio) const;
  /// The same answer, sooner where `near` is what a neighbour found.
  Found find(double reflectance, double ratio, const Found& near) const;
  /// k l_d of what was found on a ball, where the surface bends by k_1 and k_2 instead, k = H their mean: what is linear in k is light that goes on slanted,
  /// and sees the surface bend by H; the rest is how far light spreads, by the mean of the squared normal curvatures,
  ///
  ///   f_1 x + N(x sqrt(1 + unevenness)) = f_1 x_ball + N(x_ball),    N the powers from 2 on, unevenness = ((k_1 - k_2)/2)^2 / H^2
  double curvature_where(const Found& found, double unevenness) const;
  /// r of a flat surface of that reflectance: where find() begins.
  double flat_ratio(double reflectance) const;

  /// Relative standard deviation that the traced balls leave in r of a flat surface.
  double ratio_deviation() const { return ratio_deviation_; }
  double ratio_misfit() const { return ratio_misfit_; }  ///< chi^2 a degree of freedom of the fit
  double reflectance_misfit() const { return reflectance_misfit_; }

 private:
  static constexpr std::size_t kFlat = 3;    // powers of g in a
  static constexpr std::size_t kBend = 5;    // in f_j
  static constexpr std::size_t kBright = 6;  // in h_j
  struct Value {                             // u = ln g
    double value;
    double by_u;
    double by_x;
  };
  struct Place {
    double u;
    double x;
    Value ratio;  // ln r and logit R where the last step began
    Value logit;
    double determinant() const { return ratio.by_u * logit.by_x - ratio.by_x * logit.by_u; }
  };
  bool search(double log_ratio, double logit, int steps, Place& at) const;
  Found found(double reflectance, double ratio, const Place& at) const;
  Value log_ratio(double u, double x) const;
  Value logit_reflectance(double u, double x) const;
  double decay_of(double reflectance, double curvature) const;  // u

  std::array<double, kFlat> flat_{};
  std::array<std::array<double, kBend>, 6> bend_{};  // f_j
  std::array<std::array<double, kBright>, 6> bright_{};
  double least_u_ = 0.0;
  double most_u_ = 0.0;
  double most_x_ = 0.0;
  double ratio_deviation_ = 0.0;
  double ratio_misfit_ = 0.0;
  double reflectance_misfit_ = 0.0;
};

}  // namespace opaline::reconstruct
