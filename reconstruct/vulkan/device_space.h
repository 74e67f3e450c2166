#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "reconstruct/lbfgs.h"
#include "reconstruct/vulkan/device_objective.h"

namespace opaline::reconstruct::vulkan {

/// Where the coefficients may lie, as logarithms.
struct LogBounds {
  float scattering_from = 0.0F;
  float scattering_to = 0.0F;
  float absorption_from = 0.0F;
  float absorption_to = 0.0F;
};

/// L-BFGS's vectors on the device, in float32. One attempt is an evaluation of the objective, and then one submission for
/// the gradient, the curvature pair and all products, whose block of sums is all that is read.
class DeviceSpace final : public LbfgsSpace {
 public:
  /// `memory`: curvature pairs kept.
  static Result<std::unique_ptr<DeviceSpace>> create(Recorder& recorder,
                                                     const ModelKernels& kernels,
                                                     std::size_t cells,
                                                     const LogBounds& bounds,
                                                     int memory);

  /// Starts at a state, with this objective, which outlives what follows; fills `products` where the state has none.
  Result<void> load(const LbfgsState& state,
                    DeviceObjective& objective,
                    std::deque<PairProducts>& products);
  /// Reads everything back but the products.
  Result<LbfgsState> state();
  /// Value, chi-squared and regularisation where it stands.
  const Evaluation& at() const { return here_.at; }

  Result<FreeGradient> free_gradient() override { return here_.free; }
  void set_direction(const LbfgsDirection& direction) override;
  Result<Attempt> attempt(double alpha, std::stop_token stop) override;
  void keep() override;
  PairProducts accept() override;
  void remember(std::size_t most) override;
  void forget_all() override;

 private:
  struct Point {
    gpu::Buffer x;
    gpu::Buffer g;
    Evaluation at;  // no gradient
    FreeGradient free;
    PairProducts products;
    double own_s = 0.0;  // g~ . s and g~ . y of the step that led here
    double own_y = 0.0;
    std::size_t slot = 0;  // of that step's pair
  };
  DeviceSpace(Recorder& recorder,
              const ModelKernels& kernels,
              std::size_t cells,
              const LogBounds& bounds,
              Point here,
              Point best,
              Point last)
      : recorder_(recorder),
        kernels_(kernels),
        cells_(cells),
        bounds_(bounds),
        here_(std::move(here)),
        best_(std::move(best)),
        last_(std::move(last)) {}

  VectorPush push() const;
  void run(ModelKernel kernel,
           std::initializer_list<const gpu::Buffer*> buffers,
           const VectorPush& push,
           std::uint32_t groups);
  void combine();
  void multiply(const Point& point, std::size_t pair, std::size_t other, std::int32_t slot);
  void multiply_all();
  void understand(const std::vector<double>& block, Point& point) const;
  PairProducts products_from(const std::vector<double>& block,
                             std::size_t first,
                             std::size_t count) const;
  Result<void> upload(const std::vector<double>& values, double factor, gpu::Buffer& to);
  Result<std::vector<double>> download(const gpu::Buffer& from, double factor);
  Result<void> fill_products(std::deque<PairProducts>& products);

  Recorder& recorder_;
  const ModelKernels& kernels_;
  std::size_t cells_;
  LogBounds bounds_;
  DeviceObjective* objective_ = nullptr;
  Point here_;
  Point best_;
  Point last_;
  std::vector<gpu::Buffer> s_;  // one a slot
  std::vector<gpu::Buffer> y_;
  std::vector<gpu::Buffer> d_;      // one
  std::vector<Sums> sums_;          // one
  std::deque<std::size_t> pairs_;   // slots of the remembered pairs, oldest first
  std::vector<std::size_t> spare_;  // slots nobody uses
  LbfgsDirection direction_;
  bool combined_ = false;
};

}  // namespace opaline::reconstruct::vulkan
