#pragma once

#include <memory>

#include "render/edit/edit_history.h"
#include "render/edit/edit_weight.h"

namespace opaline::render {

/// Paints into a block of material (EditOptions), takes strokes back and does them again.
///
/// The block begins at `origin` in the object's frame and is `scale` times as large as it says.
/// Threads: one call at a time; who reads the block must not do so meanwhile.
class MaterialEditor {
 public:
  static constexpr std::size_t kHistoryBytes = std::size_t{256} << 20;

  MaterialEditor(std::shared_ptr<Material> block,
                 Vec3 origin,
                 double scale,
                 EditWeight::DistanceAt distance,
                 std::size_t history_bytes = kHistoryBytes);

  /// One stroke; answers how many cells it changed. Errors: see validate(EditOptions) and Mask::read(); nothing has changed
  /// then.
  Result<std::size_t> apply(const EditOptions& edit);
  bool undo() { return history_.undo(*block_); }
  bool redo() { return history_.redo(*block_); }

  const EditHistory& history() const { return history_; }
  const Material& material() const { return *block_; }

 private:
  Box box() const;
  Vec3 centre_of(int i, int j, int k) const;

  std::shared_ptr<Material> block_;
  Vec3 origin_;
  double scale_;
  EditWeight::DistanceAt distance_;
  EditHistory history_;
};

}  // namespace opaline::render
