#pragma once

#include <array>

namespace opaline::calibration {

/// CIE L*, a*, b*.
using Lab = std::array<double, 3>;
/// CIE X, Y, Z relative to the white, whose Y is 1.
using Xyz = std::array<double, 3>;

/// D50 for the 2 degree observer.
inline constexpr Xyz kD50{0.96422, 1.0, 0.82521};

/// CIE 15:2004, 8.2.1, with the straight part below (6/29)^3.
Lab lab_from_xyz(const Xyz& xyz, const Xyz& white = kD50);
Xyz xyz_from_lab(const Lab& lab, const Xyz& white = kD50);

/// The colour difference CIEDE2000 with k_L = k_C = k_H = 1 (Sharma, Wu, Dalal 2005, Eqs. 2 to 22).
double delta_e_2000(const Lab& first, const Lab& second);

}  // namespace opaline::calibration
