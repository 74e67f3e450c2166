#include "render/surface_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

Result<void> validate_raster(const Image<float>& raster, int width, int height, const char* name) {
  if (raster.width() != width || raster.height() != height || raster.channels() != 3)
    return invalid_argument(fmt::format("{} is {} x {} with {} channels; expected {} x {} with 3",
                                        name,
                                        raster.width(),
                                        raster.height(),
                                        raster.channels(),
                                        width,
                                        height));
  if (!std::ranges::all_of(raster.samples(), [](float v) { return std::isfinite(v); }))
    return invalid_argument(fmt::format("{} holds a value that is not finite", name));
  return ok();
}

}  // namespace

Result<void> validate(const SurfaceField& field) {
  const Block& b = field.block;
  if (b.nx < 1 || b.ny < 1 || b.nz < 1 || !(b.hx > 0.0 && b.hy > 0.0 && b.hz > 0.0))
    return invalid_argument("a block without cells");
  if (!(field.ior >= 1.0 && field.ior <= 3.0))
    return invalid_argument(fmt::format("ior = {}; expected 1 to 3", field.ior));
  for (const Face face : kFaces) {
    const FaceField& f = field.faces[static_cast<std::size_t>(face)];
    const int width = b.face_width(face);
    const int height = b.face_height(face);
    const std::string where = fmt::format("face {}", to_string(face));
    if (auto good = validate_raster(f.fluence, width, height, "fluence"); !good)
      return good.error().in(where);
    if (auto good = validate_raster(f.net_flux, width, height, "net flux"); !good)
      return good.error().in(where);
    if (f.reflected.empty()) continue;
    if (auto good = validate_raster(f.reflected, width, height, "reflected light"); !good)
      return good.error().in(where);
  }
  return ok();
}

}  // namespace opaline::render
