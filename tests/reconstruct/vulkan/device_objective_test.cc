#include "reconstruct/vulkan/device_objective.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <latch>
#include <random>
#include <thread>

#include "reconstruct/diffusion/medium.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/lbfgs_host_space.h"
#include "reconstruct/objective.h"
#include "reconstruct/vulkan/device_space.h"
#include "tests/support/vulkan.h"

namespace opaline::reconstruct::vulkan {
namespace {

struct Case {
  const char* name;
  Block block;
  diffusion::SourceModel source;
  diffusion::Deposit deposit;
  Face lit;
  Face seen;
  int illuminations;
  double brightness;  // of the light: any unit will do
  Smoothness prior = Smoothness::kH1;
  bool along_rays = false;
};
std::string case_name(const testing::TestParamInfo<Case>& info) { return info.param.name; }

constexpr auto kCollimatedLight = diffusion::SourceModel::kCollimated;
constexpr auto kSurfaceLight = diffusion::SourceModel::kSurface;
constexpr auto kCentre = diffusion::Deposit::kCell;
constexpr auto kCentroidDeposit = diffusion::Deposit::kCentroid;

const Case kCases[] = {{"OneCell",
                        {1, 1, 1, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        1,
                        1.0},
                       {"BackLit",
                        {17, 33, 5, 0.5, 0.4, 0.3},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        5,
                        1.0},
                       {"BackLitCell",
                        {6, 5, 4, 0.5, 0.6, 0.4},
                        kCollimatedLight,
                        kCentre,
                        Face::kZMin,
                        Face::kZMax,
                        2,
                        1e-9},
                       {"FrontLit",
                        {9, 12, 8, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMax,
                        Face::kZMax,
                        4,
                        1.0},
                       {"FrontLitSurface",
                        {6, 5, 4, 0.5, 0.6, 0.4},
                        kSurfaceLight,
                        kCentre,
                        Face::kZMax,
                        Face::kZMax,
                        3,
                        1e9},
                       {"BackLitSurface",
                        {16, 8, 6, 0.5, 0.5, 1.0},
                        kSurfaceLight,
                        kCentre,
                        Face::kZMin,
                        Face::kZMax,
                        1,
                        1.0},
                       {"FromTheSide",
                        {7, 6, 5, 0.5, 0.6, 0.4},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kXMax,
                        Face::kYMin,
                        9,
                        1.0},
                       {"TotalVariation",
                        {17, 33, 5, 0.5, 0.4, 0.3},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        2,
                        1.0,
                        Smoothness::kTotalVariation},
                       {"Rows",
                        {1, 130, 3, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        2,
                        1.0},
                       {"OneCellAlongRays",
                        {1, 1, 1, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        1,
                        1.0,
                        Smoothness::kH1,
                        true},
                       {"BackLitAlongRays",
                        {17, 33, 5, 0.5, 0.4, 0.3},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        5,
                        1.0,
                        Smoothness::kH1,
                        true},
                       {"FrontLitAlongRays",
                        {9, 12, 8, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMax,
                        Face::kZMax,
                        4,
                        1.0,
                        Smoothness::kH1,
                        true},
                       {"FrontLitSurfaceAlongRays",
                        {6, 5, 14, 0.5, 0.6, 0.9},
                        kSurfaceLight,
                        kCentre,
                        Face::kZMax,
                        Face::kZMax,
                        3,
                        1e9,
                        Smoothness::kH1,
                        true},
                       {"FromTheSideAlongRays",
                        {7, 6, 5, 0.5, 0.6, 0.4},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kXMax,
                        Face::kYMin,
                        9,
                        1.0,
                        Smoothness::kH1,
                        true},
                       {"RowsAlongRays",
                        {1, 130, 3, 0.5, 0.5, 0.5},
                        kCollimatedLight,
                        kCentroidDeposit,
                        Face::kZMin,
                        Face::kZMax,
                        2,
                        1.0,
                        Smoothness::kH1,
                        true}};

ChannelCoefficients random_coefficients(std::size_t cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> scattering(0.5, 4.0);
  std::uniform_real_distribution<double> absorption(0.005, 0.2);
  ChannelCoefficients c;
  for (std::size_t i = 0; i < cells; ++i) {
    c.reduced_scattering.push_back(scattering(random));
    c.absorption.push_back(absorption(random));
  }
  return c;
}

/// Pictures of another medium with 1 % of noise, some cells masked, weights of that noise.
ChannelProblem random_problem(const Case& c) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.2, 1.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  ChannelProblem problem{
      .block = c.block,
      .lit_face = c.lit,
      .seen_face = c.seen,
      .boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3),
      .source = {c.source, c.deposit},
      .camera = {},
      .rays = {},
      .illuminations = std::vector<ChannelIllumination>(static_cast<std::size_t>(c.illuminations)),
      .data_count = 1};
  for (std::size_t x = 0; x < c.block.face_cell_count(c.seen); ++x)
    problem.camera.push_back(diffusion::camera_equation(1.3, problem.boundary, uniform(random)));
  for (std::size_t x = 0; c.along_rays && x < problem.camera.size(); ++x)
    problem.rays.push_back(
        diffusion::camera_ray(1.3, uniform(random) - 0.6, uniform(random) - 0.6));
  for (ChannelIllumination& i : problem.illuminations) {
    for (std::size_t x = 0; x < c.block.face_cell_count(c.lit); ++x)
      i.irradiance.push_back(uniform(random) > 0.5 || x == 0 ? c.brightness * uniform(random)
                                                             : 0.0);
    i.radiance.assign(problem.camera.size(), 0.0);
    i.weight.assign(problem.camera.size(), 0.0);
  }
  const auto solver = host::make_host_solver({.threads = 1});
  Objective objective(problem, *solver, {.tolerance = 1e-10});
  const auto seen =
      *objective.predict(random_coefficients(c.block.cell_count(), 11), std::stop_token());
  for (std::size_t m = 0; m < seen.size(); ++m)
    for (std::size_t x = 0; x < seen[m].size(); ++x) {
      ChannelIllumination& i = problem.illuminations[m];
      i.radiance[x] = seen[m][x] * (1.0 + noise(random));
      i.weight[x] = uniform(random) > 0.3 ? 1.0 / std::pow(0.01 * seen[m][x], 2) : 0.0;
    }
  return problem;
}

/// A device with its kernels.
struct Device {
  std::unique_ptr<gpu::Context> context;
  std::vector<gpu::Commands> commands;
  std::vector<Kernels> kernels;
  std::vector<ModelKernels> model;

  explicit Device(const gpu::Rehearsal& rehearsal = {}) {
    gpu::ContextOptions options = tests::validated();
    options.rehearsal = rehearsal;
    context = *gpu::Context::create(options);
    commands.push_back(*gpu::Commands::create(*context));
    kernels.push_back(*Kernels::create(*context));
    model.push_back(*ModelKernels::create(*context));
  }
  Recorder recorder() { return {*context, commands[0]}; }
};

gpu::Buffer send(gpu::Context& context, const std::vector<double>& values) {
  const std::vector<float> floats(values.begin(), values.end());
  auto buffer = gpu::Buffer::create(context, floats.size() * sizeof(float), gpu::Memory::kDevice);
  EXPECT_TRUE(buffer && gpu::upload(context, std::as_bytes(std::span(floats)), *buffer));
  return *std::move(buffer);
}

std::vector<double> fetch(gpu::Context& context, const gpu::Buffer& buffer) {
  std::vector<float> floats(buffer.bytes() / sizeof(float));
  EXPECT_TRUE(gpu::download(context, buffer, std::as_writable_bytes(std::span(floats))));
  return {floats.begin(), floats.end()};
}

Result<Evaluation> evaluate(Device& device,
                            DeviceObjective& objective,
                            Recorder& recorder,
                            const std::vector<double>& p) {
  const gpu::Buffer x = send(*device.context, p);
  const gpu::Buffer g = send(*device.context, std::vector<double>(p.size(), 0.0));
  auto sums = Sums::create(*device.context, device.model[0], kOwn);
  EXPECT_TRUE(sums);
  sums->clear(recorder);
  recorder.barrier();
  if (auto done = objective.evaluate(x, g, *sums, {}); !done) return done.error();
  const std::vector<double> block = sums->read(recorder);
  if (recorder.error()) return *recorder.error();
  Evaluation at;
  at.chi_squared = block[kChiSquared] * objective.scale();
  at.regularization = (block[kSmoothDiffusion] + block[kSmoothAbsorption]) * objective.scale();
  at.value = 0.5 * at.chi_squared + at.regularization;
  at.gradient = fetch(*device.context, g);
  for (double& v : at.gradient) v *= objective.scale();
  return at;
}

double norm(const std::vector<double>& a) {
  double sum = 0.0;
  for (const double v : a) sum += v * v;
  return std::sqrt(sum);
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> d = a;
  for (std::size_t i = 0; i < d.size(); ++i) d[i] -= b[i];
  return norm(d) / norm(b);
}

class DeviceObjectiveTest : public testing::TestWithParam<Case> {};

/// How much larger radiances are than what is left of them when the pictures are subtracted.
double amplification(const ChannelProblem& problem, double chi_squared) {
  double sum = 0.0;
  for (const ChannelIllumination& i : problem.illuminations)
    for (std::size_t x = 0; x < i.weight.size(); ++x)
      sum += i.weight[x] * i.radiance[x] * i.radiance[x];
  return std::sqrt(sum / chi_squared);
}

// A radiance is good to 1e-6: the solves stop at 1e-7 of their right-hand sides, and float32 rounds each coefficient, path
// and product by 6e-8, a few times each. The misfit is off by the amplification times that, chi^2 by twice as much; the
// gradient, a sum of terms of either sign, by a few times as much more.
TEST_P(DeviceObjectiveTest, AgreesWithTheHostsValueAndGradient) {
  const ChannelProblem problem = random_problem(GetParam());
  const std::vector<double> p = to_parameters(random_coefficients(problem.block.cell_count(), 3));
  const auto solver = host::make_host_solver({.threads = 1});
  const Smoothness prior = GetParam().prior;
  Objective host(
      problem, *solver, {.tolerance = 1e-10, .regularization = 30.0, .regularizer = prior});
  const Evaluation truth = *host.evaluate(p, {});
  Device device;
  Recorder recorder = device.recorder();
  auto objective = DeviceObjective::create(
      recorder, device.kernels[0], device.model[0], problem, {1e-7, 30.0, prior});
  ASSERT_TRUE(objective) << objective.error().message;
  for (int again = 0; again < 2; ++again) {  // from darkness, and from the last fields
    const auto at = evaluate(device, **objective, recorder, p);
    ASSERT_TRUE(at) << at.error().message;
    const double misfit_off = 1e-6 * (1.0 + amplification(problem, truth.chi_squared));
    EXPECT_NEAR(at->chi_squared / truth.chi_squared, 1.0, 2.0 * misfit_off);
    if (problem.block.cell_count() > 1) {
      EXPECT_NEAR(at->regularization / truth.regularization, 1.0, 1e-6);
    }
    const double off = difference(at->gradient, truth.gradient);
    std::printf("%s: misfit known to %.1e, chi^2 %.1e off, gradient %.1e\n",
                GetParam().name,
                misfit_off,
                std::abs(at->chi_squared / truth.chi_squared - 1.0),
                off);
    EXPECT_LE(off, 3.0 * misfit_off);
  }
}

/// What the device has left when its memory holds one group of four illuminations and little more.
gpu::Rehearsal tiny(const Block& block, bool along_rays) {
  return {.max_binding_bytes =
              std::max<std::uint64_t>(16 * block.cell_count(), std::uint64_t{2048} * kOwn),
          .memory_bytes = (along_rays ? 594 : 480) * block.cell_count() + (1 << 20)};
}

// The same sums in another order: chi^2 and gradient of the groups are added up one group after another.
class DeviceObjectiveSplitTest : public testing::TestWithParam<bool> {};

TEST_P(DeviceObjectiveSplitTest, IsTheSameInManySmallBuffersAsInOne) {
  const Case c{"Split",
               {24, 24, 24, 0.5, 0.5, 0.5},
               kCollimatedLight,
               kCentroidDeposit,
               Face::kZMin,
               Face::kZMax,
               18,
               1.0,
               Smoothness::kH1,
               GetParam()};
  const ChannelProblem problem = random_problem(c);
  const std::vector<double> p = to_parameters(random_coefficients(problem.block.cell_count(), 3));
  std::vector<Evaluation> found;
  const std::uint64_t one_group = 16 * problem.block.cell_count();
  const gpu::Rehearsal binding{.max_binding_bytes = 2 * one_group};
  for (const gpu::Rehearsal& rehearsal : {gpu::Rehearsal{}, binding, tiny(c.block, GetParam())}) {
    Device device(rehearsal);
    Recorder recorder = device.recorder();
    auto objective = DeviceObjective::create(
        recorder, device.kernels[0], device.model[0], problem, {1e-7, 30.0});
    ASSERT_TRUE(objective) << objective.error().message;
    const std::size_t turns = found.empty() ? 1 : found.size() == 1 ? 3 : 5;
    EXPECT_EQ((*objective)->turns(), turns);
    EXPECT_EQ((*objective)->keeps_fields(), found.size() < 2);
    for (int again = 0; again < 2; ++again) {
      const auto at = evaluate(device, **objective, recorder, p);
      ASSERT_TRUE(at) << at.error().message;
      if (again == 0) found.push_back(*at);
    }
  }
  for (const Evaluation& at : found) {
    EXPECT_NEAR(at.chi_squared / found[0].chi_squared, 1.0, 1e-6);
    EXPECT_LE(difference(at.gradient, found[0].gradient), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(AtTheSurfaceAndAlongRays, DeviceObjectiveSplitTest, testing::Bool());

TEST(DeviceObjective, SaysWhenTheDeviceIsTooSmall) {
  const ChannelProblem problem = random_problem(kCases[1]);
  Device device({.memory_bytes = 1 << 19});
  Recorder recorder = device.recorder();
  const auto objective =
      DeviceObjective::create(recorder, device.kernels[0], device.model[0], problem, {1e-7, 30.0});
  ASSERT_FALSE(objective);
  EXPECT_EQ(objective.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(objective.error().message, testing::HasSubstr("2805 cells"));
}

INSTANTIATE_TEST_SUITE_P(Cases, DeviceObjectiveTest, testing::ValuesIn(kCases), case_name);

/// The grids made on the device against those made on the host, in float64.
class DeviceMediumTest : public testing::TestWithParam<Block> {};

TEST_P(DeviceMediumTest, HasTheHostsGrids) {
  const Block block = GetParam();
  const ChannelCoefficients c = random_coefficients(block.cell_count(), 3);
  const auto boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3);
  const auto levels = diffusion::build_levels(diffusion::make_medium(block, c, boundary));
  Device device;
  Recorder recorder = device.recorder();
  auto medium = DeviceMedium::create(*device.context, block);
  ASSERT_TRUE(medium);
  const gpu::Buffer p = send(*device.context, to_parameters(c));
  ModelPush push;
  for (std::size_t axis = 0; axis < 3; ++axis)
    push.size[axis] = static_cast<float>(block.spacing()[axis]);
  push.size[3] = static_cast<float>(block.cell_volume());
  push.surface[0] = static_cast<float>(2.0 * boundary.a);
  medium->build(recorder, device.model[0], p, push);
  recorder.finish();
  ASSERT_FALSE(recorder.error());
  for (std::size_t l = 0; l < levels.size(); ++l) {
    auto truth = DeviceLevel::create(*device.context, levels[l]);
    ASSERT_TRUE(truth);
    const DeviceLevel& made = medium->levels()[l];
    const auto same = [&](const gpu::Buffer& a, const gpu::Buffer& b, const char* name) {
      // Up to eight cells go into one of the next grid, each sum rounded to 6e-8, over up to eight grids.
      EXPECT_LE(difference(fetch(*device.context, a), fetch(*device.context, b)), 2e-6)
          << name << " of level " << l;
    };
    same(made.low, truth->low, "low");
    same(made.high, truth->high, "high");
    if (l + 1 < levels.size()) same(made.transfer, truth->transfer, "transfer");
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes,
                         DeviceMediumTest,
                         testing::Values(Block{1, 1, 1, 0.5, 0.5, 0.5},
                                         Block{17, 33, 5, 0.5, 0.4, 0.3},
                                         Block{16, 8, 12, 0.5, 0.5, 2.0},
                                         Block{1, 130, 3, 0.5, 0.5, 0.5},
                                         Block{2, 3, 2, 0.5, 0.05, 0.5}));

/// Both spaces on the device's own objective, so that what differs is the algebra of L-BFGS alone.
class DeviceSpaceTest : public testing::Test {
 protected:
  static constexpr int kMemory = 3;  // pairs, so that they are dropped within a few steps
  void SetUp() override {
    problem_ = random_problem(kCases[3]);
    cells_ = problem_.block.cell_count();
    auto space = DeviceSpace::create(recorder_, device_.model[0], cells_, bounds_, kMemory);
    ASSERT_TRUE(space) << space.error().message;
    space_ = *std::move(space);
    auto objective = DeviceObjective::create(
        recorder_, device_.kernels[0], device_.model[0], problem_, {1e-7, 30.0});
    ASSERT_TRUE(objective) << objective.error().message;
    objective_ = *std::move(objective);
    start_.x = to_parameters({std::vector<double>(cells_, 1.0), std::vector<double>(cells_, 0.02)});
    for (double& v : start_.x) v = static_cast<float>(v);
    start_.at = *objective_at(start_.x, {});
    box_.lower.assign(cells_, bounds_.scattering_from);
    box_.lower.resize(2 * cells_, bounds_.absorption_from);
    box_.upper.assign(cells_, bounds_.scattering_to);
    box_.upper.resize(2 * cells_, bounds_.absorption_to);
  }
  Result<Evaluation> objective_at(std::span<const double> x, std::stop_token /*stop*/) {
    return evaluate(device_, *objective_, recorder_, {x.begin(), x.end()});
  }

  Device device_;
  Recorder recorder_ = device_.recorder();
  LogBounds bounds_{-0.3F, 1.5F, -4.5F, -3.0F};  // narrow: some parameters end up held
  ChannelProblem problem_;
  std::size_t cells_ = 0;
  std::unique_ptr<DeviceSpace> space_;
  std::unique_ptr<DeviceObjective> objective_;
  LbfgsState start_;
  Bounds box_;
};

// Both take the same steps, rounded to float32 on one side: 6e-8 of parameters of size 4, which the curvature pairs
// amplify from step to step: after eight steps they still agree to 1e-5 of the way gone.
TEST_F(DeviceSpaceTest, TakesTheStepsOfTheHostsVectors) {
  const LbfgsOptions options{.memory = kMemory};
  LbfgsState host = start_;
  std::deque<PairProducts> products;
  ASSERT_TRUE(space_->load(start_, *objective_, products));
  const ObjectiveFunction objective = [this](std::span<const double> x, std::stop_token stop) {
    return objective_at(x, std::move(stop));
  };
  for (int step = 0; step < 8; ++step) {
    ASSERT_EQ(*lbfgs_step(host, box_, options, objective, {}), StepOutcome::kMoved);
    const auto moved = lbfgs_step(*space_, products, options, {});
    ASSERT_TRUE(moved) << moved.error().message;
    ASSERT_EQ(*moved, StepOutcome::kMoved);
    EXPECT_NEAR(space_->at().value / host.at.value, 1.0, 1e-4) << step;
  }
  const LbfgsState device = *space_->state();
  std::vector<double> way = host.x;
  std::vector<double> apart = host.x;
  int held = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    way[i] -= start_.x[i];
    apart[i] -= device.x[i];
    held += host.x[i] == box_.lower[i] || host.x[i] == box_.upper[i] ? 1 : 0;
  }
  std::printf("apart %.1e of the way, %d of %zu held\n", norm(apart) / norm(way), held, way.size());
  EXPECT_LE(norm(apart), 1e-5 * norm(way));
  EXPECT_GT(held, 0);
  EXPECT_EQ(device.pairs.size(), static_cast<std::size_t>(kMemory));
  EXPECT_EQ(products.size(), device.pairs.size());
}

// Vectors and fields move neither way; what is read, one block of scalars a submission, lies where the host sees it.
TEST_F(DeviceSpaceTest, SendsAndFetchesNoVectorsDuringItsSteps) {
  std::deque<PairProducts> products;
  ASSERT_TRUE(space_->load(start_, *objective_, products));
  const gpu::Traffic before = device_.context->traffic();
  EXPECT_GT(before.uploaded_bytes, 0U);
  const long solves = objective_->solves();
  for (int step = 0; step < 3; ++step)
    ASSERT_EQ(*lbfgs_step(*space_, products, {.memory = kMemory}, {}), StepOutcome::kMoved);
  const gpu::Traffic& after = device_.context->traffic();
  EXPECT_EQ(after.uploaded_bytes, before.uploaded_bytes);
  EXPECT_EQ(after.downloaded_bytes, before.downloaded_bytes);
  EXPECT_GE(objective_->solves(), solves + 6L * kCases[3].illuminations);
  EXPECT_GT(after.submissions, before.submissions);
}

// What is read back is all that matters: a minimisation that went on from it takes the same steps to the last bit.
TEST_F(DeviceSpaceTest, GoesOnTheSameFromWhatWasReadBack) {
  const LbfgsOptions options{.memory = kMemory};
  std::deque<PairProducts> products;
  ASSERT_TRUE(space_->load(start_, *objective_, products));
  for (int step = 0; step < 5; ++step)
    ASSERT_EQ(*lbfgs_step(*space_, products, options, {}), StepOutcome::kMoved);
  const LbfgsState read = *space_->state();
  const auto three_more = [&] {
    objective_->start_afresh();
    for (int step = 0; step < 3; ++step)
      EXPECT_EQ(*lbfgs_step(*space_, products, options, {}), StepOutcome::kMoved);
    return space_->state()->x;
  };
  const std::vector<double> straight_on = three_more();
  ASSERT_TRUE(space_->load(read, *objective_, products));
  EXPECT_EQ(three_more(), straight_on);
}

// Work that was submitted is one outer iteration of a solve; the token is looked at between two.
TEST_F(DeviceSpaceTest, StopsWhenAskedAndStaysWhereItWas) {
  std::deque<PairProducts> products;
  ASSERT_TRUE(space_->load(start_, *objective_, products));
  std::stop_source stop;
  std::chrono::steady_clock::time_point asked;
  std::latch begun(1);
  std::jthread asking([&] {
    begun.wait();
    asked = std::chrono::steady_clock::now();
    stop.request_stop();
  });
  Result<StepOutcome> outcome = StepOutcome::kMoved;
  begun.count_down();
  while (outcome && *outcome == StepOutcome::kMoved)
    outcome = lbfgs_step(*space_, products, {.memory = kMemory}, stop.get_token());
  asking.join();
  const auto took = std::chrono::steady_clock::now() - asked;
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kCancelled);
  EXPECT_LE(took, std::chrono::seconds(1));
  EXPECT_TRUE(space_->state());
}

}  // namespace
}  // namespace opaline::reconstruct::vulkan
