#pragma once

#include <string>

#include "base/block.h"
#include "base/material.h"

namespace opaline::bench {

/// Prints how far a material's coefficients are from the true ones within 3 mm under a face, channel by channel: mean
/// (`..._bias`) and root mean square (`..._error`) of the logarithm of their ratio.
void print_material_error(const std::string& name,
                          const Material& material,
                          const Material& truth,
                          Face seen_face);

}  // namespace opaline::bench
