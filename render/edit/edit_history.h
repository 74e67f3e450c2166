#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "base/material.h"
#include "render/edit/edit_options.h"

namespace opaline::render {

/// The cells that a stroke changed, with the values they do not have now: taking it back and doing it again are both an
/// exchange.
struct Stroke {
  EditOptions::Quantity quantity = EditOptions::Quantity::kAbsorption;
  std::vector<std::uint32_t> cells;
  std::vector<std::array<double, 3>> values;
  std::size_t bytes() const {
    return cells.size() * (sizeof(std::uint32_t) + sizeof(std::array<double, 3>));
  }
};

/// Undo and redo within a bound of memory: the oldest strokes are forgotten first.
class EditHistory {
 public:
  explicit EditHistory(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// A new stroke, done: what was undone before it cannot be redone. A stroke that is larger than the bound is forgotten at
  /// once, and all before it.
  void add(Stroke stroke);
  /// Exchanges values; answers whether there was a stroke.
  bool undo(Material& material);
  bool redo(Material& material);

  std::size_t undoable() const { return done_; }
  std::size_t redoable() const { return strokes_.size() - done_; }
  std::size_t bytes() const { return bytes_; }

 private:
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Stroke> strokes_;
  std::size_t done_ = 0;  // of them, from the oldest on
};

/// The coefficient of one channel that a stroke is about.
std::vector<double>& values_of(Material& material, int channel, EditOptions::Quantity quantity);

}  // namespace opaline::render
