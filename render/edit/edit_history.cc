#include "render/edit/edit_history.h"

#include <utility>

namespace opaline::render {
namespace {

void exchange(Material& material, Stroke& stroke) {
  for (int c = 0; c < kColorChannels; ++c) {
    auto& values = values_of(material, c, stroke.quantity);
    for (std::size_t i = 0; i < stroke.cells.size(); ++i) {
      std::swap(values[stroke.cells[i]], stroke.values[i][c]);
    }
  }
}

}  // namespace

std::vector<double>& values_of(Material& material, int channel, EditOptions::Quantity quantity) {
  auto& coefficients = material.channels[channel];
  return quantity == EditOptions::Quantity::kAbsorption ? coefficients.absorption
                                                        : coefficients.reduced_scattering;
}

void EditHistory::add(Stroke stroke) {
  while (strokes_.size() > done_) {
    bytes_ -= strokes_.back().bytes();
    strokes_.pop_back();
  }
  bytes_ += stroke.bytes();
  strokes_.push_back(std::move(stroke));
  ++done_;
  while (bytes_ > most_bytes_) {
    bytes_ -= strokes_.front().bytes();
    strokes_.pop_front();
    --done_;
  }
}

bool EditHistory::undo(Material& material) {
  if (done_ == 0) return false;
  exchange(material, strokes_[--done_]);
  return true;
}

bool EditHistory::redo(Material& material) {
  if (done_ == strokes_.size()) return false;
  exchange(material, strokes_[done_++]);
  return true;
}

}  // namespace opaline::render
