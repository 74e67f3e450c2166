#pragma once

#include <string>

namespace opaline::bench {

/// One picture's light of the torus for each method, size, K, tolerance and precision: processor seconds against the error of its
/// radiance. Prints each, and which are on the front; draws them where `plot` names an SVG file (bench/front.h).
/// Returns whether that could be written; why not is on standard error.
bool measure_dials(const std::string& plot);

}  // namespace opaline::bench
