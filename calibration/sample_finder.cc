#include "calibration/sample_finder.h"

#include "calibration/board_finder.h"

namespace opaline::calibration {
namespace {

constexpr int kHolderFrames = 8;

Result<Image<float>> mean_under(StepContext& context, const Brightness& brightness) {
  const auto linear = linear_codes(linear_camera(context));
  const int width = context.taker.camera().width;
  const int height = context.taker.camera().height;
  Image<float> mean(width, height, 1);
  for (int frame = 0; frame < kHolderFrames; ++frame) {
    context.progress(static_cast<double>(frame) / kHolderFrames, "where does the sample lie?");
    const auto taken = context.taker.lit(brightness.light, brightness.turns, context.stop);
    if (!taken) return taken.error();
    const auto codes = taken->pixels.samples();
    for (std::size_t i = 0; i < codes.size(); ++i)
      mean.samples()[i / 3] += static_cast<float>(linear[codes[i]] / (3.0 * kHolderFrames));
  }
  return mean;
}

}  // namespace

Result<Placement> find_sample(StepContext& context,
                              const CameraModel& lens,
                              const HolderOptions& holder) {
  if (auto good = validate(holder); !good) return good.error();
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  if (brightness->dark)
    return invalid_argument(
        "the sample's holder: even the longest exposure shows next to nothing; does the "
        "projector's white reach "
        "it, and is the lens cap off?");
  const auto picture = mean_under(context, *brightness);
  if (!picture) return picture.error();
  const auto view = find_board(grey_of(*picture), holder.board, "holder");
  if (!view) return view.error();
  return place_sample(lens, holder, *view);
}

}  // namespace opaline::calibration
