#include "render/scene/translucent_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numbers>

#include "base/io/volume_io.h"
#include "render/edit/material_block.h"
#include "render/graph/quad_graph.h"
#include "render/scene/lost_parts.h"
#include "render/scene/measured_finish.h"

namespace opaline::render {
namespace {

constexpr double kWorthTelling = 1e-3;  // of a surface

double longest_side(Vec3 size) { return std::max({size.x, size.y, size.z}); }

bool within(const Box& inner, const Box& outer) {
  return inner.low.x >= outer.low.x && inner.low.y >= outer.low.y && inner.low.z >= outer.low.z &&
         inner.high.x <= outer.high.x && inner.high.y <= outer.high.y &&
         inner.high.z <= outer.high.z;
}

}  // namespace

Result<std::unique_ptr<TranslucentBody>> TranslucentBody::create(const ObjectOptions& object,
                                                                 const DiffusionOptions& diffusion,
                                                                 int refinement,
                                                                 ThreadTeam& team,
                                                                 std::stop_token stop,
                                                                 const Saying& say) {
  auto body = std::unique_ptr<TranslucentBody>(new TranslucentBody);
  const auto start = std::chrono::steady_clock::now();
  auto shape = load_shape(object.shape, stop, say);
  if (!shape) return shape.error();
  body->options_ = object.material;
  body->scene_from_own_ = scene_from_shape(object.shape);
  auto material = MaterialSource::create(object.material, body->scene_from_own_);
  if (!material) return material.error();
  body->material_ = *std::move(material);
  body->solid_ = std::move(shape->solid);
  if (auto wrapped = body->material_->wrap(*body->solid_, stop); !wrapped) return wrapped.error();
  body->notes_ = std::move(shape->notes);
  body->load_seconds_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (say) say("cutting it into tetrahedra");
  const Subsurface::MaterialAt at = [&](Vec3 place) { return body->material_->at(place); };
  auto light = shape->tets
                   ? Subsurface::create(
                         pack(*shape->tets), *body->solid_, at, body->ior(), diffusion, team, stop)
                   : Subsurface::create(*body->solid_, at, body->ior(), diffusion, team, stop);
  if (!light) return light.error();
  body->subsurface_ = *std::move(light);
  body->rest_box_ = body->own_box(0.0);
  body->drawn_ =
      std::make_unique<DrawnSurface>(body->subsurface_->surface(), *body->solid_, refinement);
  if (shape->surface) body->note_lost(*shape->surface, stop);
  if (auto taken = body->take_finish(); !taken) return taken.error();
  if (!object.edits.empty()) {
    if (auto edited = body->edit(object.edits); !edited) return edited.error();
  }
  if (object.deform.kind != DeformOptions::Kind::kNone) {
    if (auto bent = body->bend(object.deform); !bent) return bent.error();
  }
  return body;
}

void TranslucentBody::note_lost(const TriangleMesh& shape, const std::stop_token& stop) {
  const double size = subsurface_->report().spacing_mm;
  const double lost = lost_share(shape, subsurface_->surface(), size, stop);
  if (lost < kWorthTelling) return;
  notes_.push_back(
      fmt::format("{:.2g} % of its surface is not there: parts thinner than elements of {:.3g} mm "
                  "are lost, and sheets that enclose nothing; a smaller `spacing` shows the former",
                  100.0 * lost,
                  size));
}

Box TranslucentBody::own_box(double margin) const {
  TriangleMesh own;
  const Pose own_from_scene = scene_from_own_.inverse();
  for (const Vec3& p : subsurface_->surface().vertices) {
    own.vertices.push_back(own_from_scene.apply(p));
  }
  const Box box = bounds(own);
  const Vec3 more{margin, margin, margin};
  return {box.low - more, box.high + more};
}

Vec3 TranslucentBody::own_place(int vertex) const {
  return scene_from_own_.inverse().apply(drawn_->rest_place(vertex));
}

Vec3 TranslucentBody::own_normal(int vertex) const {
  return scene_from_own_.inverse().rotate(drawn_->rest_normal(vertex));
}

Result<void> TranslucentBody::take_finish() {
  if (options_.surface_reflectance.empty()) return ok();
  const auto finish = MeasuredFinish::create(options_);
  if (!finish) return finish.error();
  finish_.reserve(drawn_->mesh().vertices.size());
  for (int v = 0; v < static_cast<int>(drawn_->mesh().vertices.size()); ++v) {
    Colour& matte = finish_.emplace_back(finish->at(own_place(v), own_normal(v)));
    for (double& value : matte) value *= std::numbers::pi;
  }
  return ok();
}

Result<void> TranslucentBody::begin_editing() {
  if (editor_) return ok();
  std::shared_ptr<Material> block = material_->block();
  double scale = options_.scale;
  block_origin_ = options_.origin;
  if (!block || material_->shell() != nullptr ||
      !within(rest_box_, {block_origin_, block_origin_ + block->block.size() * scale})) {
    const double cell = block
                            ? scale * std::min({block->block.hx, block->block.hy, block->block.hz})
                            : longest_side(rest_box_.size()) / options_.edit_cells;
    const Vec3 more{cell, cell, cell};
    const Box box{rest_box_.low - more, rest_box_.high + more};
    auto sampled = sampled_block(
        box, cell, ior(), [&](Vec3 own) { return material_->at(scene_from_own_.apply(own)); });
    if (!sampled) return sampled.error();
    block = std::make_shared<Material>(*std::move(sampled));
    block_origin_ = box.low;
    scale = 1.0;
    material_->take_block(block, block_origin_);
  }
  editor_.emplace(
      std::move(block), block_origin_, scale, [this](Vec3 own) { return distance(own); });
  return ok();
}

Result<void> TranslucentBody::take_material() {
  return subsurface_->set_material([&](Vec3 place) { return material_->at(place); });
}

Result<std::size_t> TranslucentBody::edit(const std::vector<EditOptions>& strokes) {
  if (auto begun = begin_editing(); !begun) return begun.error();
  std::size_t cells = 0;
  for (std::size_t s = 0; s < strokes.size(); ++s) {
    const auto changed = editor_->apply(strokes[s]);
    if (!changed) return changed.error().in(fmt::format("edit {}", s + 1));
    cells += *changed;
    if (*changed == 0) notes_.push_back(fmt::format("edit {} changes nothing", s + 1));
  }
  if (auto taken = take_material(); !taken) return taken.error();
  return cells;
}

Result<bool> TranslucentBody::undo() {
  if (!editor_ || !editor_->undo()) return false;
  if (auto taken = take_material(); !taken) return taken.error();
  return true;
}

Result<bool> TranslucentBody::redo() {
  if (!editor_ || !editor_->redo()) return false;
  if (auto taken = take_material(); !taken) return taken.error();
  return true;
}

Result<Vec3> TranslucentBody::save(FileOperations& files,
                                   const std::filesystem::path& file,
                                   std::string_view generator) {
  if (auto begun = begin_editing(); !begun) return begun.error();
  auto written = write_material(files, file, editor_->material(), generator);
  if (!written) return written.error();
  return block_origin_;
}

Result<std::size_t> TranslucentBody::bend(const DeformOptions& options) {
  const auto deformation = make_deformation(options, rest_box_, scene_from_own_);
  if (!deformation) return deformation.error().in("deform");
  const auto inverted = subsurface_->bend(**deformation);
  if (!inverted) return inverted.error().in("deform");
  marks_.clear();
  if (*inverted > 0) {
    if (auto refused = turned_inside_out(*inverted, options); !refused) return refused;
  }
  drawn_->bend(**deformation);
  return *inverted;
}

Result<std::size_t> TranslucentBody::turned_inside_out(std::size_t inverted,
                                                       const DeformOptions& options) {
  const auto& corners = subsurface_->inverted_corners();
  const std::string what = fmt::format(
      "{} of {} tetrahedra are turned inside out", inverted, subsurface_->report().tetrahedra);
  if (options.inverted == DeformOptions::Inverted::kRefuse) {
    return invalid_argument(
        fmt::format("deform: {}: bend less, or see where with inverted = \"mark\"", what));
  }
  notes_.push_back(what + ": the light is that of the shape before");
  marks_ = drawn_->spread_marks(corners);
  return inverted;
}

}  // namespace opaline::render
