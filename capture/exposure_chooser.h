#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>

#include "capture/hdr_merge.h"

namespace opaline::capture {

/// Chooses the exposures of one light, one after another, by the frames that it is shown. The same frames give the same choice.
class ExposureChooser {
 public:
  ExposureChooser() = default;
  ExposureChooser(const ExposureChooser&) = delete;
  ExposureChooser& operator=(const ExposureChooser&) = delete;
  virtual ~ExposureChooser() = default;
  /// Index into the ladder of the exposure to take next; none when there are enough.
  virtual std::optional<std::size_t> next() = 0;
  /// Adds what next() asked for, and what measure_light() says of it. The frames outlive us.
  virtual void add(std::size_t index, const ExposurePair& pair, const FrameLight& light) = 0;
};

/// ExposureMode::kBracket: see Bracket.
class BracketChooser : public ExposureChooser {
 public:
  BracketChooser(const ExposureOptions& options, std::size_t ladder_size)
      : bracket_(options, ladder_size) {}
  std::optional<std::size_t> next() override { return bracket_.next(); }
  void add(std::size_t index, const ExposurePair& /*pair*/, const FrameLight& light) override {
    bracket_.add(index, light.statistics);
  }

 private:
  Bracket bracket_;
};

/// ExposureMode::kFixed: the whole ladder, shortest first.
class WholeLadder : public ExposureChooser {
 public:
  explicit WholeLadder(std::size_t ladder_size) : size_(ladder_size) {}
  std::optional<std::size_t> next() override {
    return taken_ < size_ ? std::optional(taken_) : std::nullopt;
  }
  void add(std::size_t /*index*/,
           const ExposurePair& /*pair*/,
           const FrameLight& /*light*/) override {
    ++taken_;
  }

 private:
  std::size_t size_;
  std::size_t taken_ = 0;
};

/// One for each light, and for each time that it is taken.
using ChooseExposures = std::function<std::unique_ptr<ExposureChooser>()>;

}  // namespace opaline::capture
