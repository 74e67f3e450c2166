#include "bench/paper/timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stop_token>

#include "base/clock.h"
#include "base/dataset.h"
#include "base/events.h"
#include "bench/figure.h"
#include "reconstruct/back_end.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/prediction.h"
#include "sim/scene.h"

namespace opaline::bench {
namespace {

using reconstruct::InverseOptions;
using reconstruct::Method;

constexpr int kRegions = 4;
constexpr double kNoise = 0.01;
constexpr int kTimed = 4;              // iterations that a time is taken over
constexpr int kPublishedLimit = 1500;  // after which the published method is given up

/// Looks at the clock at every iteration of the first channel, and ends after some or with it.
class IterationClock : public EventSink {
 public:
  explicit IterationClock(int most) : most_(most) {}
  void progress(const Progress& progress) override {
    const auto iteration = progress.detail.find("iteration");
    if (iteration == progress.detail.end()) return;
    times_.push_back(now());
    if (static_cast<int>(times_.size()) > most_) stop_.request_stop();
  }
  Result<void> fact(std::string_view type, const nlohmann::json& /*data*/) override {
    if (type != "channel.reconstructed") return ok();
    if (channel_seconds_ == 0.0) channel_seconds_ = now() - begun_;
    stop_.request_stop();
    return ok();
  }
  std::stop_token token() const { return stop_.get_token(); }
  Timing timing() const {
    std::vector<double> steps;
    for (std::size_t i = 1; i < times_.size(); ++i) steps.push_back(times_[i] - times_[i - 1]);
    if (steps.empty()) return {0.0, 0, channel_seconds_};
    const int count = static_cast<int>(steps.size());
    return {median(std::move(steps)), count, channel_seconds_};
  }

 private:
  double now() const { return std::chrono::duration<double>(clock_.now()).count(); }

  int most_;
  const SystemClock clock_;
  std::stop_source stop_;
  std::vector<double> times_;
  double begun_ = now();
  double channel_seconds_ = 0.0;
};

/// n x n regions of the lit face; pictures are still to come.
Dataset unseen(const Material& material) {
  const Block& b = material.block;
  Dataset dataset;
  dataset.block = b;
  dataset.ior = material.ior;
  dataset.view_cosine = Image<float>(b.nx, b.ny, 1, 1.0F);
  for (int r = 0; r < kRegions * kRegions; ++r) {
    Image<float> light(b.nx, b.ny, kColorChannels);
    for (int y = 0; y < b.ny; ++y)
      for (int x = 0; x < b.nx; ++x)
        if (x * kRegions / b.nx == r % kRegions && y * kRegions / b.ny == r / kRegions)
          for (int c = 0; c < kColorChannels; ++c) light.at(x, y, c) = 1.0F;
    dataset.illuminations.push_back(
        {.name = fmt::format("region_{}", r),
         .held_out = false,
         .irradiance = std::move(light),
         .radiance = Image<float>(b.nx, b.ny, kColorChannels),
         .radiance_variance = Image<float>(b.nx, b.ny, kColorChannels, 1.0F),
         .mask = Image<std::uint8_t>(b.nx, b.ny, 1, 1)});
  }
  return dataset;
}

Result<Dataset> pictures_of(const Material& material) {
  Dataset dataset = unseen(material);
  const auto solver = reconstruct::make_solver({});
  if (!solver) return solver.error();
  auto seen = reconstruct::predict(dataset, material, {}, **solver, {});
  if (!seen) return seen.error();
  std::mt19937 random(1);
  for (std::size_t m = 0; m < seen->size(); ++m) {
    Illumination& i = dataset.illuminations[m];
    i.radiance = std::move((*seen)[m]);
    const float brightest = *std::ranges::max_element(i.radiance.samples());
    for (std::size_t s = 0; s < i.radiance.samples().size(); ++s) {
      const double sigma = kNoise * i.radiance.samples()[s] + 1e-3 * kNoise * brightest;
      i.radiance_variance.samples()[s] = static_cast<float>(sigma * sigma);
      i.radiance.samples()[s] +=
          static_cast<float>(std::normal_distribution<double>(0.0, sigma)(random));
    }
  }
  return dataset;
}

Result<Timing> time(const Dataset& dataset, const InverseOptions& options, int most) {
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  IterationClock events(most);
  const SystemClock clock;
  const auto done = reconstruct::reconstruct_material(
      dataset, options, {**solver, events, clock}, events.token());
  if (!done && done.error().code != ErrorCode::kCancelled) return done.error();
  return events.timing();
}

InverseOptions ours() {
  InverseOptions options;
  options.model = reconstruct::Model::kHeterogeneous;
  return options;
}

InverseOptions published() {
  InverseOptions options = ours();
  options.method = Method::kAsPublished;
  options.max_iterations = kPublishedLimit;
  options.stalled = 0.0;
  return options;
}

Result<TimedSample> time_sample(const std::string& name,
                                const Block& block,
                                double paper_hours,
                                int published_iterations) {
  fmt::print(stderr, "{}: {} x {} x {}\n", name, block.nx, block.ny, block.nz);
  const auto material = sim::make_material({.block = block});
  if (!material) return material.error();
  const auto dataset = pictures_of(*material);
  if (!dataset) return dataset.error();
  TimedSample sample{
      .name = name, .block = block, .paper_hours = paper_hours, .ours = {}, .published = {}};
  const auto timed = time(*dataset, ours(), 1 << 20);
  if (!timed) return timed.error();
  sample.ours = *timed;
  sample.published_converged = published_iterations == 0;
  const auto theirs =
      time(*dataset, published(), sample.published_converged ? kPublishedLimit : kTimed);
  if (!theirs) return theirs.error();
  sample.published = *theirs;
  if (!sample.published_converged) sample.published.iterations = published_iterations;
  return sample;
}

}  // namespace

Result<std::vector<TimedSample>> time_table(bool quick) {
  struct Row {
    const char* name;
    Block block;
    double hours;
  };
  std::vector<Row> rows{{"48x48x12", {48, 48, 12, 0.5, 0.5, 0.5}, 0.0},
                        {"Wax I", {130, 53, 37, 0.5, 0.5, 0.5}, 2.0},
                        {"Wax II", {140, 75, 48, 0.5, 0.5, 0.5}, 4.0},
                        {"Marble", {256, 256, 20, 0.5, 0.5, 0.5}, 11.0},
                        {"Artificial stone", {128, 128, 41, 0.5, 0.5, 0.5}, 3.0}};
  if (quick) rows = {rows.front(), {"24x24x6", {24, 24, 6, 1.0, 1.0, 1.0}, 0.0}};
  std::vector<TimedSample> table;
  for (const Row& row : rows) {
    const int iterations = table.empty() ? 0 : table.front().published.iterations;
    auto sample = time_sample(row.name, row.block, row.hours, iterations);
    if (!sample) return sample.error().in(row.name);
    table.push_back(*std::move(sample));
  }
  return table;
}

}  // namespace opaline::bench
