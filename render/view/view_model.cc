#include "render/view/view_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

constexpr double kWhiteQuantile = 0.995;  // as pictures on disk have it
constexpr double kNearestPole = 2.0;      // degrees between view and `up`
constexpr double kEverywhere = 1e7;       // mm

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// Rodrigues' rotation about an axis of length 1.
Vec3 turned_about(Vec3 v, Vec3 axis, double angle) {
  const double c = std::cos(angle);
  return v * c + cross(axis, v) * std::sin(angle) + axis * (dot(axis, v) * (1.0 - c));
}

struct ViewAxes {
  Vec3 right;
  Vec3 up;
};

ViewAxes axes_of(const CameraOptions& camera) {
  const Vec3 forward = normalized(camera.target - camera.position);
  const Vec3 right = normalized(cross(forward, camera.up));
  return {right, cross(right, forward)};
}

double white_in(const Image<float>& picture) {
  std::vector<float> values;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        if (picture.at(x, y, c) > 0.0F) values.push_back(picture.at(x, y, c));
      }
    }
  }
  if (values.empty()) return 1.0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                          kWhiteQuantile * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

Result<std::unique_ptr<ViewModel>> ViewModel::create(const Scene& scene,
                                                     const RasterOptions& raster,
                                                     ThreadTeam& team,
                                                     const SceneRenderer::Step& step,
                                                     std::stop_token stop) {
  auto model = std::unique_ptr<ViewModel>(new ViewModel(scene, raster));
  auto renderer = SceneRenderer::create(scene, team, step, stop);
  if (!renderer) return renderer.error();
  model->renderer_ = *std::move(renderer);
  model->renderer_->leave_out_single_scattering();
  model->lights_ = scene.lights;
  if (auto made = model->make_raster(); !made) return made.error();
  return model;
}

Result<void> ViewModel::make_raster() {
  taken_ = false;
  raster_.reset();
  auto made = RasterRenderer::create(options_);
  if (!made) return made.error();
  raster_ = *std::move(made);
  return ok();
}

CameraModel ViewModel::camera(int width, int height) const {
  PictureOptions picture = scene_.picture;
  picture.width = width;
  picture.height = height;
  return camera_of(scene_.camera, picture);
}

void ViewModel::orbit(double right, double up) {
  ++version_;
  CameraOptions& c = scene_.camera;
  const Vec3 axis = normalized(c.up);
  Vec3 from = turned_about(c.position - c.target, axis, radians(-right));
  const double height = std::acos(std::clamp(dot(normalized(from), axis), -1.0, 1.0));
  const double pole = radians(kNearestPole);
  const double wanted = std::clamp(height - radians(up), pole, std::numbers::pi - pole);
  const Vec3 across = normalized(cross(axis, from));
  c.position = c.target + turned_about(from, across, wanted - height);
}

void ViewModel::zoom(double factor) {
  ++version_;
  CameraOptions& c = scene_.camera;
  const double least = 1e-3 * length(start_.position - start_.target);
  const Vec3 from = c.position - c.target;
  c.position = c.target + normalized(from) * std::max(least, length(from) * factor);
}

void ViewModel::pan(double right, double up) {
  ++version_;
  CameraOptions& c = scene_.camera;
  const ViewAxes axes = axes_of(c);
  const double height =
      2.0 * length(c.position - c.target) * std::tan(0.5 * radians(c.field_of_view_degrees));
  const Vec3 move = (axes.right * right + axes.up * up) * height;
  c.position = c.position - move;
  c.target = c.target - move;
}

void ViewModel::look_from_start() {
  ++version_;
  scene_.camera = start_;
}

void ViewModel::turn_light(std::size_t light, double right, double up) {
  if (light >= lights_.size()) return;
  LightOptions& l = lights_[light];
  const ViewAxes axes = axes_of(scene_.camera);
  const auto turn = [&](Vec3 v) {
    return turned_about(turned_about(v, axes.up, radians(right)), axes.right, radians(-up));
  };
  l.direction = turn(l.direction);
  l.position = scene_.camera.target + turn(l.position - scene_.camera.target);
  changed();
}

void ViewModel::scale_light(std::size_t light, double factor) {
  if (light >= lights_.size() || !(factor > 0.0)) return;
  for (double& value : lights_[light].irradiance) value *= factor;
  for (double& value : lights_[light].intensity) value *= factor;
  for (double& value : lights_[light].radiance) value *= factor;
  changed();
}

std::optional<ViewModel::Place> ViewModel::at(double x, double y, int width, int height) const {
  const CameraModel model = camera(width, height);
  const auto hit = renderer_->pick({model.centre(), normalized(model.ray_direction({x, y}))});
  if (!hit) return std::nullopt;
  const auto nearest = std::ranges::max_element(hit->weights) - hit->weights.begin();
  return Place{static_cast<std::size_t>(hit->object), hit->vertices[nearest]};
}

Result<std::size_t> ViewModel::paint(
    double x, double y, int width, int height, EditOptions brush, bool goes_on) {
  hold();
  const auto place = at(x, y, width, height);
  if (!goes_on) ++stroke_;
  TranslucentBody* const body = place ? renderer_->body(place->object) : nullptr;
  if (body == nullptr) return std::size_t{0};
  brush.centre = body->own_place(place->vertex);
  brush.direction = body->own_normal(place->vertex);
  return dab(place->object, brush);
}

Result<std::size_t> ViewModel::paint_all(std::size_t object, EditOptions brush) {
  hold();
  ++stroke_;
  if (renderer_->body(object) == nullptr) return std::size_t{0};
  brush.reach = EditOptions::Reach::kBall;
  brush.radius_mm = kEverywhere;
  brush.softness = 0.0;
  brush.mask.clear();
  return dab(object, brush);
}

Result<std::size_t> ViewModel::dab(std::size_t object, const EditOptions& brush) {
  auto cells = renderer_->body(object)->edit({brush});
  if (!cells || *cells == 0) return cells;
  done_.push_back({object, stroke_});
  undone_.clear();
  changed();
  return cells;
}

Result<bool> ViewModel::undo() {
  hold();
  std::optional<std::size_t> stroke;
  while (!done_.empty() && (!stroke || done_.back().stroke == *stroke)) {
    const Dab last = done_.back();
    done_.pop_back();
    const auto back = renderer_->body(last.object)->undo();
    if (!back) return back.error();
    if (!*back) continue;  // forgotten
    stroke = last.stroke;
    undone_.push_back(last);
    changed();
  }
  return stroke.has_value();
}

Result<bool> ViewModel::redo() {
  hold();
  if (undone_.empty()) return false;
  const std::size_t stroke = undone_.back().stroke;
  bool all = true;
  while (!undone_.empty() && undone_.back().stroke == stroke) {
    const Dab next = undone_.back();
    undone_.pop_back();
    const auto again = renderer_->body(next.object)->redo();
    if (!again) return again.error();
    done_.push_back(next);
    changed();
    all = all && *again;
  }
  return all;
}

Result<std::size_t> ViewModel::bend(std::size_t object, double amount) {
  hold();
  if (object >= scene_.objects.size()) return std::size_t{0};
  DeformOptions deform = scene_.objects[object].deform;
  if (deform.kind == DeformOptions::Kind::kNone) return std::size_t{0};
  deform.amount = amount;
  deform.inverted = DeformOptions::Inverted::kMark;
  auto inverted = renderer_->bend(object, deform, {});
  if (inverted) {
    scene_.objects[object].deform.amount = amount;
    changed();
  }
  return inverted;
}

void ViewModel::set_tolerance(double tolerance) {
  const double allowed = std::clamp(tolerance, 1e-5, 0.1);
  if (allowed == scene_.diffusion.tolerance) return;
  if (allowed < scene_.diffusion.tolerance) changed();
  hold();
  scene_.diffusion.tolerance = allowed;
  renderer_->set_tolerance(allowed);
}

/// The scene is about to be touched.
void ViewModel::hold() {
  if (!background_.stop()) return;
  dark_ = true;
  ++version_;
}

void ViewModel::has_light() {
  taken_ = false;
  was_lit_ = true;
  statistics_ = renderer_->statistics();
  ++version_;
}

Result<void> ViewModel::light(std::stop_token stop) {
  hold();
  if (!dark_ && !renderer_->is_provisional()) return ok();
  if (auto lit = renderer_->light(lights_, std::move(stop)); !lit) return lit;
  dark_ = false;
  has_light();
  return ok();
}

Result<void> ViewModel::catch_up() {
  if (!background_.ready()) return ok();
  if (auto lit = background_.take(); !lit) return lit;
  has_light();
  return ok();
}

Result<Image<std::uint8_t>> ViewModel::draw(int width,
                                            int height,
                                            double stops,
                                            std::stop_token stop) {
  if (!taken_) {
    if (auto taken = raster_->take(*renderer_); !taken) return taken.error();
    taken_ = true;
  }
  if (!(white_ > 0.0)) {
    const auto first = raster_->draw(camera(width, height), 1, std::move(stop));
    if (!first) return first.error();
    white_ = scene_.picture.white > 0.0 ? scene_.picture.white : white_in(*first);
  }
  const double gain = std::exp2(scene_.picture.exposure + stops) / white_;
  return raster_->display(camera(width, height),
                          {.background = scene_.picture.background, .gain = gain});
}

Result<void> ViewModel::lose_if_asked() {
  if (!lose_next_) return ok();
  lose_next_ = false;
  const RasterOptions whole = options_;
  options_.gpu.rehearsal.lost_at_submission = 1;
  auto made = make_raster();
  options_ = whole;
  return made;
}

Result<Image<std::uint8_t>> ViewModel::draw_or_reopen(int width,
                                                      int height,
                                                      double stops,
                                                      std::stop_token stop) {
  if (auto lost = lose_if_asked(); !lost) return lost.error();
  auto drawn = draw(width, height, stops, stop);
  if (drawn || drawn.error().code != ErrorCode::kUnavailable) return drawn;
  hold();
  ++device_losses_;
  if (auto made = make_raster(); !made) return made.error();
  return draw(width, height, stops, stop);
}

Result<Image<std::uint8_t>> ViewModel::picture(int width,
                                               int height,
                                               double stops,
                                               std::stop_token stop) {
  if (auto lit = light(stop); !lit) return lit.error();
  return draw_or_reopen(width, height, stops, stop);
}

Result<Image<std::uint8_t>> ViewModel::picture_now(int width,
                                                   int height,
                                                   double stops,
                                                   std::stop_token stop) {
  if (!was_lit_) return picture(width, height, stops, std::move(stop));
  if (auto caught = catch_up(); !caught) return caught.error();
  if (lose_next_ || !raster_) hold();
  auto drawn = draw_or_reopen(width, height, stops, std::move(stop));
  if (drawn && !background_.busy() && (dark_ || renderer_->is_provisional())) {
    background_.start(*renderer_, lights_, dark_ ? Pace::kMoving : Pace::kAtRest);
    dark_ = false;
  }
  return drawn;
}

}  // namespace opaline::render
