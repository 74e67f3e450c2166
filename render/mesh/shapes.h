#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "render/mesh/signed_distance.h"

namespace opaline::render {

/// Solids by closed forms, around the origin, each about `size` mm across: something to render, and to test with, where no
/// scan is at hand. Distances after Quilez's list of signed distance functions; unions are minima, so inside they may be
/// smaller than the true distance.
///
///   sphere        diameter = size
///   torus         around z, genus 1, tube a quarter of the size thick
///   genus3        a block size x size x size/4 with three round holes
///   knot          a trefoil's tube, size/8 thick, genus 1
///   figurine      a seated body, smoothly joined, with arms, legs and ears: thick and thin parts
///   sheet         a square plate, 1/40 of the size thick
///
/// Errors: kInvalidArgument for another name (the message has the names) or a size that is not > 0.
Result<std::unique_ptr<SignedDistance>> make_shape(std::string_view name, double size_mm);

std::vector<std::string_view> shape_names();

}  // namespace opaline::render
