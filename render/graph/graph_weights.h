#pragma once

#include <cstdint>

namespace opaline::render {

/// How a QuadGraph's neighbours weigh.
enum class GraphWeights : std::uint8_t {
  kTwoPoint,     ///< those of TwoPoint
  kAsPublished,  ///< kappa_k / d^2 of the link (Wang 2010, Eqs. 5 and 8): a discretisation of laplace(kappa phi), and not
                 ///< consistent on irregular tetrahedra (docs/physics.md)
};

}  // namespace opaline::render
