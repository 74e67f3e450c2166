#include "reconstruct/minimiser.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/objective.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using testing::HasSubstr;

/// An engine whose device is the processor, and fails at the n-th step of every channel.
class FakeEngine final : public InversionEngine {
 public:
  explicit FakeEngine(int fails_at, ErrorCode code = ErrorCode::kUnavailable)
      : fails_at_(fails_at), code_(code) {}
  Result<std::unique_ptr<Minimiser>> begin(const ChannelProblem& problem,
                                           const InverseOptions& options,
                                           const LbfgsState& from) override;
  int steps = 0;
  int begun = 0;

 private:
  int fails_at_;
  ErrorCode code_;
  std::unique_ptr<diffusion::FluenceSolver> solver_ = host::make_host_solver({.threads = 1});
};

class FakeMinimiser final : public Minimiser {
 public:
  FakeMinimiser(const ChannelProblem& problem,
                diffusion::FluenceSolver& solver,
                const InverseOptions& options,
                const LbfgsState& from,
                std::function<Result<void>()> count)
      : objective_(problem,
                   solver,
                   {.tolerance = options.tolerance, .regularization = options.regularization}),
        state_(from),
        count_(std::move(count)) {
    box_.lower.assign(from.x.size(), -10.0);
    box_.upper.assign(from.x.size(), 5.0);
  }
  Result<StepOutcome> step(std::stop_token stop) override {
    if (auto good = count_(); !good) return good.error();
    const ObjectiveFunction evaluate = [this](std::span<const double> x, std::stop_token token) {
      return objective_.evaluate(x, std::move(token));
    };
    return lbfgs_step(state_, box_, {}, evaluate, std::move(stop));
  }
  Evaluation at() const override {
    return {state_.at.value, state_.at.chi_squared, state_.at.regularization, {}};
  }
  Result<LbfgsState> state() override { return state_; }
  void start_afresh() override { objective_.start_afresh(); }
  long solves() const override { return objective_.solves(); }

 private:
  Objective objective_;
  LbfgsState state_;
  Bounds box_;
  std::function<Result<void>()> count_;
};

Result<std::unique_ptr<Minimiser>> FakeEngine::begin(const ChannelProblem& problem,
                                                     const InverseOptions& options,
                                                     const LbfgsState& from) {
  ++begun;
  if (fails_at_ == 0) return Error{code_, "no room on the device"};
  return std::make_unique<FakeMinimiser>(
      problem, *solver_, options, from, [this, left = fails_at_]() mutable -> Result<void> {
        ++steps;
        if (--left == 0) return Error{code_, "the device fell off the bus"};
        return ok();
      });
}

Result<InverseResult> invert(const Dataset& dataset, InversionEngine* engine) {
  InverseOptions options;
  options.max_iterations = 8;
  options.model = Model::kHeterogeneous;
  options.checkpoint_every = 3;
  options.tolerance = 1e-8;
  options.discrepancy = 0.0;
  NullSink events;
  const SystemClock clock;
  const auto solver = host::make_host_solver({.threads = 1});
  return reconstruct_material(dataset, options, {*solver, events, clock, nullptr, engine}, {});
}

double worst_ratio(const InverseResult& a, const InverseResult& b) {
  double worst = 0.0;
  for (std::size_t c = 0; c < kColorChannels; ++c)
    for (std::size_t i = 0; i < a.material.channels[c].absorption.size(); ++i)
      worst = std::max(worst,
                       std::abs(std::log(a.material.channels[c].absorption[i] /
                                         b.material.channels[c].absorption[i])));
  return worst;
}

class OnAnEngine : public testing::Test {
 protected:
  const Dataset dataset_ = testing_support::make_synthetic_dataset({{6, 6, 4, 1.0, 1.0, 1.0}, 2});
  const InverseResult truth_ = *invert(dataset_, nullptr);
};

// Both minimise the same objective from the same point; the solves agree to 1e-8, which eight steps amplify.
TEST_F(OnAnEngine, EndsWhereTheSolverAloneEnds) {
  FakeEngine engine(1000);
  const auto result = invert(dataset_, &engine);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_GE(engine.steps, 3 * 3);
  EXPECT_LE(worst_ratio(*result, truth_), 1e-4);
  for (std::size_t c = 0; c < kColorChannels; ++c)
    EXPECT_EQ(result->channels[c].history.size(), truth_.channels[c].history.size());
}

// The fifth step fails: the solver goes on from the third, the last that was read back, and the history has each
// iteration once.
TEST_F(OnAnEngine, GoesOnFromTheLastCheckpointWhenTheDeviceFails) {
  for (const ErrorCode code : {ErrorCode::kUnavailable, ErrorCode::kTimeout}) {
    FakeEngine engine(5, code);
    const auto result = invert(dataset_, &engine);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_LE(worst_ratio(*result, truth_), 1e-4);
    for (const ChannelReport& channel : result->channels)
      for (std::size_t i = 0; i < channel.history.size(); ++i)
        ASSERT_EQ(channel.history[i].iteration, static_cast<int>(i));
  }
}

TEST_F(OnAnEngine, RunsOnTheSolverWhenTheDeviceHasNoRoom) {
  FakeEngine engine(0);
  const auto result = invert(dataset_, &engine);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(engine.begun, 3);
  EXPECT_EQ(worst_ratio(*result, truth_), 0.0);
}

TEST_F(OnAnEngine, EndsWithAnErrorThatIsNotTheDevices) {
  FakeEngine engine(5, ErrorCode::kInternal);
  const auto result = invert(dataset_, &engine);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInternal);
  EXPECT_THAT(result.error().message, HasSubstr("fell off the bus"));
}

}  // namespace
}  // namespace opaline::reconstruct
