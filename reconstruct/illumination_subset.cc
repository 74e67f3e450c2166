#include "reconstruct/illumination_subset.h"

#include <algorithm>

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kEvery = 4;
constexpr std::size_t kFewest = 3;

std::size_t data_of(const ChannelIllumination& illumination) {
  return static_cast<std::size_t>(
      std::ranges::count_if(illumination.weight, [](double w) { return w > 0.0; }));
}

std::vector<std::size_t> with_data(const ChannelProblem& problem) {
  std::vector<std::size_t> usable;
  for (std::size_t m = 0; m < problem.illuminations.size(); ++m) {
    if (data_of(problem.illuminations[m]) > 0) usable.push_back(m);
  }
  return usable;
}

}  // namespace

ChannelProblem with_illuminations(const ChannelProblem& problem,
                                  const std::vector<std::size_t>& chosen) {
  ChannelProblem some{.block = problem.block,
                      .lit_face = problem.lit_face,
                      .seen_face = problem.seen_face,
                      .boundary = problem.boundary,
                      .source = problem.source,
                      .camera = problem.camera,
                      .rays = problem.rays,
                      .illuminations = {},
                      .data_count = 0,
                      .noise = 0.0,
                      .start = problem.start};
  for (const std::size_t m : chosen) {
    some.illuminations.push_back(problem.illuminations[m]);
    some.data_count += data_of(some.illuminations.back());
    some.noise += some.illuminations.back().noise;
  }
  return some;
}

std::vector<std::size_t> few_illuminations(const ChannelProblem& problem, std::size_t count) {
  std::vector<std::size_t> usable = with_data(problem);
  if (usable.size() <= count) return usable;
  std::vector<std::size_t> few;
  for (std::size_t n = 0; n < count; ++n)
    few.push_back(usable[n * (usable.size() - 1) / (count - 1)]);
  return few;
}

ValidationSplit split_for_validation(const ChannelProblem& problem) {
  const std::vector<std::size_t> usable = with_data(problem);
  std::vector<std::size_t> kept;
  std::vector<std::size_t> held_out;
  for (std::size_t n = 0; n < usable.size(); ++n) {
    const bool out = usable.size() >= kFewest && n % kEvery == std::min(kEvery, usable.size()) / 2;
    (out ? held_out : kept).push_back(usable[n]);
  }
  return {with_illuminations(problem, kept), with_illuminations(problem, held_out)};
}

}  // namespace opaline::reconstruct
