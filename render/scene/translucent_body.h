#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/files.h"
#include "render/edit/material_editor.h"
#include "render/scene/drawn_surface.h"
#include "render/scene/material_source.h"
#include "render/scene/solid.h"
#include "render/scene/subsurface.h"

namespace opaline::render {

/// A translucent object: its solid, its material, the light in it and its surface as drawn; painted into and bent while it
/// lives.
///
/// Strokes go into a block of the material. A file's own block serves where the object lies within it; else the object gets
/// a block of its own, as fine as the file's or as `edit_cells` says, sampled from what it is made of.
///
/// Threads: one call at a time.
class TranslucentBody {
 public:
  /// With the object's own edits and bending. The team must outlive it. Errors: those of load_shape(), MaterialSource,
  /// Subsurface, edit() and bend().
  static Result<std::unique_ptr<TranslucentBody>> create(const ObjectOptions& object,
                                                         const DiffusionOptions& diffusion,
                                                         int refinement,
                                                         ThreadTeam& team,
                                                         std::stop_token stop,
                                                         const Saying& say = {});

  Subsurface& subsurface() { return *subsurface_; }
  const Subsurface& subsurface() const { return *subsurface_; }
  const DrawnSurface& drawn() const { return *drawn_; }
  double ior() const { return material_->ior(); }
  const std::vector<std::string>& notes() const { return notes_; }
  double load_seconds() const { return load_seconds_; }

  /// Of a drawn vertex, in the object's own frame, at rest: what EditOptions are told in.
  Vec3 own_place(int vertex) const;
  Vec3 own_normal(int vertex) const;

  /// One stroke, several, or none; the next lighting has it. Answers how many cells changed. Errors: those of MaterialEditor
  /// and Subsurface::set_material().
  Result<std::size_t> edit(const std::vector<EditOptions>& strokes);
  Result<bool> undo();  ///< false: there was nothing to take back
  Result<bool> redo();
  /// None before the first stroke.
  const EditHistory* history() const { return editor_ ? &editor_->history() : nullptr; }
  /// The material as it is now, and where its block begins in the object's frame. Errors: those of write_material().
  Result<Vec3> save(FileOperations& files,
                    const std::filesystem::path& file,
                    std::string_view generator);

  /// Bends the object from its rest. Answers how many tetrahedra were turned inside out: the light then stays as it was; the
  /// drawn surface moves all the same where the options say so, and marks() show where.
  /// Errors: those of make_deformation(); kInvalidArgument for inverted tetrahedra where the options refuse them, with how
  /// many and where.
  Result<std::size_t> bend(const DeformOptions& options);
  /// Of each drawn vertex: above 1/2 where the object is turned inside out. Empty: nowhere.
  const std::vector<float>& marks() const { return marks_; }
  /// Of each drawn vertex pi rho_s where the options name a measured surface (measured_finish.h); else empty.
  const std::vector<Colour>& finish() const { return finish_; }

 private:
  TranslucentBody() = default;
  Result<void> take_finish();
  Result<void> begin_editing();
  Result<void> take_material();
  Box own_box(double margin) const;
  void note_lost(const TriangleMesh& shape, const std::stop_token& stop);
  double distance(Vec3 own_place) const { return solid_->at(scene_from_own_.apply(own_place)); }
  Result<std::size_t> turned_inside_out(std::size_t inverted, const DeformOptions& options);

  TranslucentOptions options_;
  Pose scene_from_own_;
  std::unique_ptr<SignedDistance> solid_;
  std::optional<MaterialSource> material_;
  std::unique_ptr<Subsurface> subsurface_;
  std::unique_ptr<DrawnSurface> drawn_;
  std::optional<MaterialEditor> editor_;
  Vec3 block_origin_;
  Box rest_box_;
  std::vector<float> marks_;
  std::vector<Colour> finish_;
  std::vector<std::string> notes_;
  double load_seconds_ = 0.0;
};

}  // namespace opaline::render
