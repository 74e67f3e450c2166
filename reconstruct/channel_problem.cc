#include "reconstruct/channel_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

template <class T>
bool covers(const Image<T>& image, const Block& block, Face face, int channels) {
  return image.width() == block.face_width(face) && image.height() == block.face_height(face) &&
         image.channels() == channels;
}

Result<void> check_block(const Block& block) {
  const auto cells = block.cells();
  const auto spacing = block.spacing();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] < 1 || !(spacing[axis] > 0.0) || !std::isfinite(spacing[axis])) {
      return invalid_argument(
          fmt::format("block axis {}: {} cells of {} mm; expected at least one of a positive size",
                      axis,
                      cells[axis],
                      spacing[axis]));
    }
  }
  return ok();
}

Result<void> check_shapes(const Dataset& d, const Illumination& i) {
  if (covers(i.irradiance, d.block, d.lit_face, kColorChannels) &&
      covers(i.radiance, d.block, d.seen_face, kColorChannels) &&
      covers(i.radiance_variance, d.block, d.seen_face, kColorChannels) &&
      covers(i.mask, d.block, d.seen_face, 1)) {
    return ok();
  }
  return invalid_argument("pictures do not cover the cells of the block's faces");
}

Result<std::vector<double>> transmitted(const Dataset& d, const Illumination& i, int channel) {
  const double share = 1.0 - diffusion::normal_reflectance(d.ior);
  std::vector<double> q;
  for (std::size_t s = channel; s < i.irradiance.samples().size(); s += kColorChannels) {
    const double e = i.irradiance.samples()[s];
    if (!(e >= 0.0) || !std::isfinite(e)) {
      return invalid_argument(fmt::format("irradiance {}; expected >= 0", e));
    }
    q.push_back(share * e);
  }
  return q;
}

// Of the usable data of one channel.
double root_mean_square(const Illumination& i, int channel) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < i.mask.pixel_count(); ++p) {
    if (i.mask.samples()[p] == 0) continue;
    const double l = i.radiance.samples()[p * kColorChannels + channel];
    sum += l * l;
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
}

Result<void> add_data(const Illumination& i,
                      int channel,
                      double model_error,
                      ChannelIllumination& out) {
  const std::size_t pixels = i.mask.pixel_count();
  const double level = root_mean_square(i, channel);
  out.radiance.assign(pixels, 0.0);
  out.weight.assign(pixels, 0.0);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (i.mask.samples()[p] == 0) continue;
    const double l = i.radiance.samples()[p * kColorChannels + channel];
    const double variance = i.radiance_variance.samples()[p * kColorChannels + channel];
    if (!std::isfinite(l) || !(variance > 0.0) || !std::isfinite(variance)) {
      return invalid_argument(
          fmt::format("usable cell {} has radiance {} and variance {}; expected a finite one and a "
                      "positive one",
                      p,
                      l,
                      variance));
    }
    const double model = model_error * std::hypot(l, level);
    out.radiance[p] = l;
    out.weight[p] = 1.0 / (variance + model * model);
    out.noise += out.weight[p] * variance;
  }
  return ok();
}

Result<ChannelIllumination> make_illumination(const Dataset& dataset,
                                              const Illumination& illumination,
                                              int channel,
                                              double model_error) {
  if (auto fits = check_shapes(dataset, illumination); !fits) return fits.error();
  auto q = transmitted(dataset, illumination, channel);
  if (!q) return q.error();
  ChannelIllumination out{*std::move(q), {}, {}, 0.0};
  if (auto added = add_data(illumination, channel, model_error, out); !added) return added.error();
  return out;
}

Result<std::vector<diffusion::CameraEquation>> camera_gains(const Dataset& dataset,
                                                            const diffusion::Boundary& boundary) {
  if (!covers(dataset.view_cosine, dataset.block, dataset.seen_face, 1)) {
    return invalid_argument("the view cosine does not cover the cells of the seen face");
  }
  std::vector<diffusion::CameraEquation> camera;
  for (const float cosine : dataset.view_cosine.samples()) {
    if (!(cosine >= 0.0F && cosine <= 1.0F)) {
      return invalid_argument(fmt::format("view cosine {}; expected 0 to 1", cosine));
    }
    camera.push_back(diffusion::camera_equation(dataset.ior, boundary, cosine));
  }
  return camera;
}

Result<std::vector<diffusion::CameraRay>> camera_rays(const Dataset& dataset,
                                                      const InverseOptions& options) {
  std::vector<diffusion::CameraRay> rays;
  if (!along_rays(dataset, options)) return rays;
  if (!covers(dataset.view_direction, dataset.block, dataset.seen_face, 2))
    return invalid_argument("the view direction does not cover the cells of the seen face");
  for (int row = 0; row < dataset.view_direction.height(); ++row) {
    for (int column = 0; column < dataset.view_direction.width(); ++column) {
      const double x = dataset.view_direction.at(column, row, 0);
      const double y = dataset.view_direction.at(column, row, 1);
      if (!(std::hypot(x, y) <= 1.0))
        return invalid_argument(
            fmt::format("view direction ({}, {}); expected a unit vector", x, y));
      rays.push_back(diffusion::camera_ray(dataset.ior, x, y));
    }
  }
  return rays;
}

bool selected(const Illumination& illumination, Selection selection) {
  return selection == Selection::kAll ||
         illumination.held_out == (selection == Selection::kHeldOut);
}

Result<void> check_enough(const ChannelProblem& problem) {
  double light = 0.0;
  for (const auto& i : problem.illuminations) {
    for (const double q : i.irradiance) light += q;
  }
  if (problem.data_count == 0) return invalid_argument("no usable datum: every cell is masked");
  if (!(light > 0.0)) return invalid_argument("no light: the irradiance is zero everywhere");
  return ok();
}

}  // namespace

Result<ChannelProblem> make_channel_problem(const Dataset& dataset,
                                            int channel,
                                            const InverseOptions& options,
                                            Selection selection) {
  ENSURE(channel >= 0 && channel < kColorChannels);
  if (auto good = check_block(dataset.block); !good) return good.error();
  const auto boundary = diffusion::make_boundary(options.boundary, dataset.ior);
  if (!boundary) return boundary.error();
  auto camera = camera_gains(dataset, *boundary);
  if (!camera) return camera.error();
  auto rays = camera_rays(dataset, options);
  if (!rays) return rays.error();
  ChannelProblem problem{.block = dataset.block,
                         .lit_face = dataset.lit_face,
                         .seen_face = dataset.seen_face,
                         .boundary = *boundary,
                         .source = {options.source, options.deposit},
                         .camera = *std::move(camera),
                         .rays = *std::move(rays),
                         .illuminations = {},
                         .data_count = 0,
                         .noise = 0.0};
  if (options.start) problem.start = (*options.start)[static_cast<std::size_t>(channel)];
  for (const Illumination& illumination : dataset.illuminations) {
    if (!selected(illumination, selection)) continue;
    auto data = make_illumination(dataset, illumination, channel, options.model_error);
    if (!data) return data.error().in(fmt::format("illumination {}", illumination.name));
    problem.data_count += static_cast<std::size_t>(
        std::count_if(data->weight.begin(), data->weight.end(), [](double w) { return w > 0.0; }));
    problem.noise += data->noise;
    problem.illuminations.push_back(*std::move(data));
  }
  if (selection == Selection::kFit) {
    if (auto enough = check_enough(problem); !enough) {
      return enough.error().in(
          fmt::format("{} channel", kChannelNames[static_cast<std::size_t>(channel)]));
    }
  }
  return problem;
}

}  // namespace opaline::reconstruct
