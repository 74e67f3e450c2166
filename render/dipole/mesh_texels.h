#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/pose.h"
#include "base/result.h"
#include "render/dipole/texture_diffusion.h"

namespace opaline::render {

/// A surface with texture coordinates: u to the right, v up, 0 to 1.
struct TexturedMesh {
  struct Corner {
    Vec3 position;  ///< mm
    Vec3 normal;    ///< unit
    double u = 0.0;
    double v = 0.0;
  };
  std::vector<Corner> corners;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// From Wavefront's OBJ text: v, vt and f as "7/3" or "7/3/1"; normals are the triangles' around a vertex, weighed by area. `millimetres` is the
/// length of the file's unit. Errors: kInvalidArgument with the line, for damage and for corners without coordinates.
Result<TexturedMesh> decode_textured_obj(std::string_view text, double millimetres = 1.0);

/// One channel of maps over a texture, its first row at v = 1.
struct DipoleTexture {
  int width = 0;
  int height = 0;
  std::vector<float> reduced_albedo;
  std::vector<float> diffusion;  ///< mm
};

/// A parallel projection: `view_from_mesh`, then x to the right, y up, z towards the eye; the picture's middle sees x = y = 0.
struct ParallelView {
  Pose view_from_mesh;
  int width = 64;
  int height = 64;
  double pixel_mm = 0.5;
};

/// Texels that lie on the mesh's surface where the texture puts them: for texture-space diffusion (d'Eon et al. 2007). Where triangles overlap in it the last one counts.
/// Errors: kInvalidArgument where sizes do not fit.
Result<TexelSurface> texels_of_texture(const TexturedMesh& mesh,
                                       const DipoleTexture& texture,
                                       int width,
                                       int height);
/// What a view sees of the mesh, nearest first, in the view's frame: for screen-space diffusion (Jimenez et al. 2009), where light that enters what is not seen is
/// missing. Pixels that see the surface at a cosine below 0.2 count as if at 0.2.
Result<TexelSurface> texels_of_view(const TexturedMesh& mesh,
                                    const DipoleTexture& texture,
                                    const ParallelView& view);

}  // namespace opaline::render
