#include "daemon/report/bssrdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/face_view.h"
#include "daemon/report/surface_radiance.h"

namespace opaline::daemon {
namespace {

/// Share of cell `index` of `cells` that lies in part `part` of `parts` equal ones.
double overlap(int index, int cells, int part, int parts) {
  const double begin =
      std::max(static_cast<double>(index) / cells, static_cast<double>(part) / parts);
  const double end = std::min((index + 1.0) / cells, (part + 1.0) / parts);
  return std::max(0.0, (end - begin) * cells);
}

/// Unit irradiance on one patch, over the cells of the lit face.
render::Light light_on_patch(const TransportResponses& responses, int column, int row) {
  const Block& block = responses.block;
  const Face face = responses.lit_face;
  render::Light light{face, Image<float>(block.face_width(face), block.face_height(face), 3)};
  for (int y = 0; y < light.irradiance.height(); ++y) {
    for (int x = 0; x < light.irradiance.width(); ++x) {
      const double share = overlap(x, block.face_width(face), column, responses.patches_x) *
                           overlap(y, block.face_height(face), row, responses.patches_y);
      for (int c = 0; c < kColorChannels; ++c) {
        light.irradiance.at(x, y, c) = static_cast<float>(share);
      }
    }
  }
  return light;
}

ChannelErrors compare(const Image<float>& predicted, const PatchResponse& stored) {
  ChannelErrors errors;
  for (int y = 0; y < predicted.height(); ++y) {
    for (int x = 0; x < predicted.width(); ++x) {
      for (int c = 0; c < kColorChannels; ++c) {
        errors.channels[c].add(
            predicted.at(x, y, c), stored.radiance.at(x, y, c), stored.variance.at(x, y, c));
      }
    }
  }
  return errors;
}

}  // namespace

Result<ChannelErrors> bssrdf_error(const Material& material,
                                   const TransportResponses& responses,
                                   const render::TranslucencyOptions& options,
                                   reconstruct::diffusion::FluenceSolver& solver,
                                   const std::function<void(double)>& done,
                                   std::stop_token stop) {
  if (!(material.block == responses.block)) {
    return invalid_argument("the material and the stored light transport have different grids");
  }
  const Image<float> cosines =
      view_of_face(responses.block, responses.seen_face, responses.camera_centre).cosine;
  ChannelErrors errors;
  for (int row = 0; row < responses.patches_y; ++row) {  // a row of patches at a time
    std::vector<render::Light> lights;
    lights.reserve(static_cast<std::size_t>(responses.patches_x));
    for (int column = 0; column < responses.patches_x; ++column) {
      lights.push_back(light_on_patch(responses, column, row));
    }
    const auto fields = render::illuminate(material, lights, options, solver, stop);
    if (!fields) return fields.error().in(fmt::format("patches of row {}", row));
    for (int column = 0; column < responses.patches_x; ++column) {
      const Image<float> predicted =
          surface_radiance((*fields)[column], responses.seen_face, cosines);
      errors.add(compare(predicted, responses.patch(column, row)));
    }
    done((row + 1.0) / responses.patches_y);
  }
  return errors;
}

}  // namespace opaline::daemon
