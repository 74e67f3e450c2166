#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "render/raster/raster_renderer.h"
#include "render/scene/scene_renderer.h"
#include "render/view/background_light.h"

namespace opaline::render {

/// What a viewer of a scene does, without a window: camera and lights that move, strokes and bends, and the picture as it is
/// now. Whatever changed is lit again before the next picture, from the light there was.
///
/// Light is found on a thread of its own while picture_now() shows the light before; everything else that touches the scene
/// stops that first. A lost device is replaced once a picture: device_losses() counts them.
///
/// Threads: one call at a time.
class ViewModel {
 public:
  /// The team must outlive it. Errors: those of SceneRenderer and RasterRenderer.
  static Result<std::unique_ptr<ViewModel>> create(const Scene& scene,
                                                   const RasterOptions& raster,
                                                   ThreadTeam& team,
                                                   const SceneRenderer::Step& step,
                                                   std::stop_token stop);

  // The camera turns about its target; angles in degrees, to the right and up.
  void orbit(double right, double up);
  void zoom(double factor);           ///< of the distance; kept above a thousandth of the first
  void pan(double right, double up);  ///< in shares of the picture's height
  void look_from_start();

  // Lights turn about the camera's target as the camera sees it.
  void turn_light(std::size_t light, double right, double up);
  void scale_light(std::size_t light, double factor);

  /// What a pixel of the next picture shows: the object and its nearest vertex.
  struct Place {
    std::size_t object = 0;
    int vertex = 0;
  };
  std::optional<Place> at(double x, double y, int width, int height) const;

  /// A dab of the brush at a pixel, along the surface's normal there; 0 where there is nothing translucent. Answers how many
  /// cells changed. One that goes on belongs to the stroke of the dab before: both are taken back together.
  Result<std::size_t> paint(
      double x, double y, int width, int height, EditOptions brush, bool goes_on = false);
  /// The same all through an object, whatever the brush's place and reach.
  Result<std::size_t> paint_all(std::size_t object, EditOptions brush);
  Result<bool> undo();  ///< the last stroke that was not taken back, of any object
  Result<bool> redo();
  bool can_undo() const { return !done_.empty(); }
  bool can_redo() const { return !undone_.empty(); }

  /// Bends an object that the scene bends, by this share. What would be turned inside out is marked.
  Result<std::size_t> bend(std::size_t object, double amount);

  /// The dial between speed and accuracy: the relative residual of each picture's light, 1e-5 to 0.1.
  void set_tolerance(double tolerance);

  /// The picture as a screen shows it, its light found first. `stops` of exposure above the scene's own.
  Result<Image<std::uint8_t>> picture(int width, int height, double stops, std::stop_token stop);
  /// The picture by the light there is, at once; whatever changed is lit behind it, and version() rises when that is done; once more
  /// where diffuse light is to be followed when nothing changes any more. The very first picture waits for its light.
  Result<Image<std::uint8_t>> picture_now(int width,
                                          int height,
                                          double stops,
                                          std::stop_token stop);
  /// Whether light is being found; look again for another version then.
  bool is_lighting() const { return background_.busy(); }
  /// Takes light that has been found since. Errors: those of SceneRenderer::light().
  Result<void> catch_up();
  /// The next picture's device is lost: a rehearsal.
  void lose_device() {
    lose_next_ = true;
    ++version_;
  }
  /// Another one: the next picture differs from the last.
  std::uint64_t version() const { return version_; }

  /// Stops lighting, which picture_now() begins again.
  SceneRenderer& renderer() {
    hold();
    return *renderer_;
  }
  /// As of the last light.
  const SceneStatistics& statistics() const { return statistics_; }
  const Scene& scene() const { return scene_; }
  const std::vector<LightOptions>& lights() const { return lights_; }
  double white() const { return white_; }
  int device_losses() const { return device_losses_; }
  std::string device() const { return raster_ ? raster_->description() : "none"; }
  const std::vector<std::string>& left_out() const { return raster_->left_out(); }

 private:
  ViewModel(const Scene& scene, const RasterOptions& raster)
      : scene_(scene), start_(scene.camera), options_(raster) {}
  CameraModel camera(int width, int height) const;
  void changed() {
    dark_ = true;
    ++version_;
  }
  Result<std::size_t> dab(std::size_t object, const EditOptions& brush);
  Result<void> light(std::stop_token stop);
  void hold();
  void has_light();
  Result<void> lose_if_asked();
  Result<Image<std::uint8_t>> draw_or_reopen(int width,
                                             int height,
                                             double stops,
                                             std::stop_token stop);
  Result<void> make_raster();
  Result<Image<std::uint8_t>> draw(int width, int height, double stops, std::stop_token stop);

  Scene scene_;
  CameraOptions start_;
  RasterOptions options_;
  std::vector<LightOptions> lights_;
  std::unique_ptr<SceneRenderer> renderer_;
  std::unique_ptr<RasterRenderer> raster_;
  struct Dab {
    std::size_t object = 0;
    std::size_t stroke = 0;
  };
  std::vector<Dab> done_;
  std::vector<Dab> undone_;
  std::size_t stroke_ = 0;  // of the last dab
  double white_ = 0.0;
  std::uint64_t version_ = 0;
  bool dark_ = true;    // to be lit anew
  bool taken_ = false;  // the raster has what is lit
  bool lose_next_ = false;
  int device_losses_ = 0;
  bool was_lit_ = false;
  SceneStatistics statistics_;
  BackgroundLight background_;  // last: it stops before the scene goes
};

}  // namespace opaline::render
