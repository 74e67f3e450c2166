#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/thread_team.h"
#include "render/scene/drawn_surface.h"
#include "render/scene/painter.h"
#include "render/scene/scene.h"
#include "render/scene/translucent_body.h"

namespace opaline::render {

/// What drawing a scene took, and what it left out.
struct SceneStatistics {
  struct Object {
    std::string name;
    bool translucent = true;
    std::size_t triangles = 0;  ///< as drawn
    Subsurface::Report body;    ///< of a translucent one
    int iterations = 0;         ///< of the last solution
    double relative_residual = 0.0;
    DiffuseEntry environment = DiffuseEntry::kDark;  ///< how its light went in, last lighting
    DiffuseEntry lamps = DiffuseEntry::kDark;        ///< where they are diffuse
  };
  std::vector<Object> objects;
  double load_seconds = 0.0;          ///< reading shapes and materials
  double mesh_seconds = 0.0;          ///< cutting into tetrahedra
  double setup_seconds = 0.0;         ///< graph, coefficients, matrix, hierarchy
  double light_seconds = 0.0;         ///< lights and their shadows, last lighting
  double solve_seconds = 0.0;         ///< last lighting
  double draw_seconds = 0.0;          ///< last picture
  std::vector<std::string> left_out;  ///< what the scene cannot show, and why
  std::vector<std::string> notes;     ///< what a user should know
};

/// A scene made ready once, then lit and drawn as often as wanted: translucent objects by diffusion (subsurface.h), all
/// objects seen by rays (painter.h). Into a translucent one enters, where nothing hides it,
///
///   of the environment   q = int (1 - R(mu)) L_env mu dw, diffuse
///   of each light        q = (1 - R(n.l)) E (n.l), as a beam from the middle of each face along the refracted ray
///                        (beam_deposit.h), or diffuse as well (Entry)
///
/// Left out: light between objects beyond shadows; light through a translucent object that never scattered.
/// Threads: one call at a time; the team does the work.
/// Errors:  kInvalidArgument, naming object or light, for what validate() and the files refuse; kNotFound; kCancelled;
///          kInternal where a solution is not found.
class SceneRenderer {
 public:
  using Step = std::function<void(std::string_view what, double fraction)>;

  /// The team must outlive it. `step` hears what is done next.
  static Result<std::unique_ptr<SceneRenderer>> create(const Scene& scene,
                                                       ThreadTeam& team,
                                                       const Step& step,
                                                       std::stop_token stop);

  /// Lights the objects; the scene's own lights, or the same moved. Starts from the last lighting. While things move, diffuse
  /// light may go in as Subsurface::light() says.
  Result<void> light(const std::vector<LightOptions>& lights, Pace pace, std::stop_token stop);
  Result<void> light(const std::vector<LightOptions>& lights, std::stop_token stop) {
    return light(lights, Pace::kAtRest, std::move(stop));
  }
  /// Whether lighting at rest would give another picture than the last lighting has.
  bool is_provisional() const;
  /// The translucent object of that number, to be painted into, or none. Call light() afterwards.
  TranslucentBody* body(std::size_t object);
  /// Bends an object from its rest, translucent or opaque; answers how many tetrahedra are turned inside out (see
  /// TranslucentBody::bend()). Shadows and the environment's visibility follow. Call light() afterwards.
  Result<std::size_t> bend(std::size_t object, const DeformOptions& options, std::stop_token stop);
  /// The nearest surface on a ray.
  std::optional<Surfaces::Hit> pick(const Ray& ray) const { return surfaces_.nearest(ray); }
  /// Of the relative residual, from the next lighting on.
  void set_tolerance(double tolerance);
  /// Linear radiance and coverage, as Painter says. Call light() first.
  Result<Image<float>> draw(const CameraModel& camera, std::stop_token stop);

  /// An object's surface as it is drawn; valid until the scene changes.
  struct DrawnObject {
    const DrawnSurface* surface = nullptr;
    const Look* look = nullptr;
    bool is_plane = false;
  };
  std::vector<DrawnObject> drawn() const;
  /// Another number, of all scenes in this process, whenever the drawn surfaces or what they see of the sky have changed; never 0.
  std::uint64_t shape() const { return shape_; }
  const std::vector<LightOptions>& lights() const { return lights_; }
  const EnvironmentOptions& environment() const { return scene_.environment; }
  /// For somebody else who draws the scene: what was scattered once is left to diffusion, which the statistics say. Call before light().
  void leave_out_single_scattering();
  /// For somebody else who draws the scene: what that leaves out, and how long it took.
  void leave_out(std::string what);
  void took(double draw_seconds) { statistics_.draw_seconds = draw_seconds; }

  const SceneStatistics& statistics() const { return statistics_; }

 private:
  struct Body {
    std::unique_ptr<TranslucentBody> body;
    std::unique_ptr<SingleScattering> once;
    int object = 0;
  };
  struct Opaque {
    std::unique_ptr<DrawnSurface> drawn;  // none for a translucent object
    Box rest;                             // in its own frame
  };

  SceneRenderer(const Scene& scene, ThreadTeam& team) : scene_(scene), team_(team) {}
  Result<void> add(const ObjectOptions& object, const Saying& say, std::stop_token stop);
  Result<void> add_translucent(const ObjectOptions& object,
                               const Saying& say,
                               std::stop_token stop);
  Result<void> add_opaque(const ObjectOptions& object, const Saying& say, std::stop_token stop);
  void note_resolution(const ObjectOptions& object, const Subsurface::Report& report);
  Result<void> look_at_sky(std::stop_token stop);
  struct Entering {
    std::vector<std::array<float, 3>> environment;  ///< of each of the body's places
    std::vector<std::array<float, 3>> lamps;        ///< the same, where they are diffuse
    std::vector<Beam> beams;
  };
  Entering entering(const Body& body, std::stop_token stop);
  Colour passed(const LightOptions& light,
                const LightSample& from,
                const SurfacePlace& place,
                double ior) const;
  void let_in(const Body& body, Entering& light, std::stop_token stop);
  void send_beams(const Body& body, Entering& light, std::stop_token stop);
  void leave_out_dark();

  Scene scene_;
  ThreadTeam& team_;
  std::vector<LightOptions> lights_;
  std::vector<LightOptions> sources_;  // of all lights their parts
  std::vector<Body> bodies_;
  std::vector<Opaque> opaque_;  // by object
  std::vector<std::vector<float>>
      body_sky_;  // of each body's places: int (1 - R) mu dw, not hidden
  Surfaces surfaces_;
  std::vector<Look> looks_;
  std::vector<bool> light_reaches_;  // by source
  std::uint64_t shape_ = 0;
  SceneStatistics statistics_;
};

/// A pinhole camera for a picture, the field of view that of its height.
CameraModel camera_of(const CameraOptions& camera, const PictureOptions& picture);

}  // namespace opaline::render
