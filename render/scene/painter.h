#pragma once

#include <stop_token>
#include <vector>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/thread_team.h"
#include "render/graph/optics.h"
#include "render/scene/scene.h"
#include "render/scene/single_scattering.h"
#include "render/scene/surfaces.h"

namespace opaline::render {

/// How one object's surface looks.
struct Look {
  bool translucent = true;
  double ior = 1.3;
  SurfaceOptions surface{};
  Colour reflectance{};  ///< of an opaque one
  std::vector<Colour>
      finish{};  ///< of the vertices of a translucent one whose surface was measured: pi rho_s
  const SingleScattering* once = nullptr;  ///< of a translucent one where that is seen as itself
  SurfaceLight light{};                    ///< of a translucent one's vertices
  std::vector<float>
      marks{};  ///< of its vertices; above 1/2: shown in magenta, as wrong. Empty: none
  double mark_radiance = 0.0;  ///< of the magenta, W/(mm^2 sr)
  std::vector<float>
      sky{};  ///< of the vertices: the share of the environment that they see, cosine-weighted, of a translucent one as it enters
};

/// Pictures of lit surfaces, by rays. A point shows, towards the camera,
///
///   translucent   F_t(mu_o) / (4 pi ior^2) (phi + 3 mu_i J_n + Phi_1)          (docs/physics.md, "Radiance towards a camera";
///                 Phi_1, where the scene asks for it: single_scattering.h)
///   opaque        rho / pi (sum of lights E (n.l) + pi L_env share)                                      (Lambert)
///   measured      the same with rho = pi rho_s, on top of the translucent one's own               (measured_finish.h)
///   both          + sum of lights f_s E (n.l)  + R(mu_o) L_env where the mirrored ray meets nothing       (specular.h)
///
/// phi, J_n, the share and the normal interpolated between a triangle's corners; lights that something hides count nothing.
/// Light that one object sends to another is left out.
///
/// Sampling: one ray a pixel through its centre; pixels that differ from a neighbour in object or by more than kContrast of
/// radiance get samples x samples rays on a regular grid, averaged. Answers height x width x 4 in W/(mm^2 sr): red, green,
/// blue, averaged over the pixel, and the covered share.
class Painter {
 public:
  static constexpr double kContrast = 0.05;

  /// Everything must outlive it.
  Painter(const Surfaces& surfaces,
          const std::vector<Look>& looks,
          const std::vector<LightOptions>& lights,
          const EnvironmentOptions& environment)
      : surfaces_(surfaces), looks_(looks), lights_(lights), environment_(environment) {}

  /// Errors: kCancelled.
  Result<Image<float>> draw(const CameraModel& camera,
                            int samples_per_axis,
                            ThreadTeam& team,
                            std::stop_token stop) const;

  /// What a ray sees: radiance and the object, or -1.
  struct Seen {
    Colour radiance{};
    int object = -1;
  };
  Seen look(const Ray& ray) const;

 private:
  Colour emerging(const Look& look, const Surfaces::Hit& hit, Vec3 view) const;
  Colour scattered(const Look& look, const Surfaces::Hit& hit, const Colour& matte) const;
  void add_mirrored(const Look& look,
                    const Surfaces::Hit& hit,
                    const Colour& matte,
                    Vec3 view,
                    Colour& radiance) const;

  const Surfaces& surfaces_;
  const std::vector<Look>& looks_;
  const std::vector<LightOptions>& lights_;
  const EnvironmentOptions& environment_;
};

}  // namespace opaline::render
