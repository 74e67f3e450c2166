#include "drivers/stage_picture.h"

#include <fmt/format.h>

namespace opaline::drivers {
namespace {

constexpr std::uint8_t kParallelCode = 255;

}  // namespace

Pattern stage_picture(const StagePattern& pattern) {
  const auto lights = static_cast<int>(pattern.codes.size());
  Pattern picture{pattern.id, Image<std::uint8_t>(lights + 1, 1, 3), pattern.name};
  for (int c = 0; c < 3; ++c) {
    for (int n = 0; n < lights; ++n)
      picture.codes.at(n, 0, c) = pattern.codes[static_cast<std::size_t>(n)];
    picture.codes.at(lights, 0, c) =
        pattern.polarization == Polarization::kParallel ? kParallelCode : 0;
  }
  return picture;
}

Result<StagePattern> stage_pattern(const Pattern& picture) {
  const Image<std::uint8_t>& codes = picture.codes;
  if (codes.width() < 2 || codes.height() != 1 || codes.channels() != 3)
    return invalid_argument(
        fmt::format("pattern {}: {} x {} x {}; expected a stage's: lights + 1 x 1 x 3",
                    picture.id,
                    codes.width(),
                    codes.height(),
                    codes.channels()));
  const int lights = codes.width() - 1;
  StagePattern pattern{picture.id, {}, Polarization::kCross, picture.name};
  for (int n = 0; n < lights; ++n) pattern.codes.push_back(codes.at(n, 0));
  if (codes.at(lights, 0) == kParallelCode) pattern.polarization = Polarization::kParallel;
  return pattern;
}

}  // namespace opaline::drivers
