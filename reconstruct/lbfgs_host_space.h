#pragma once

#include <vector>

#include "reconstruct/lbfgs.h"

namespace opaline::reconstruct {

/// L-BFGS's vectors in the processor's memory, in float64. What it is given outlives it; the state's products are made
/// afresh where there are not as many as pairs.
class HostSpace final : public LbfgsSpace {
 public:
  HostSpace(LbfgsState& state, const Bounds& bounds, const ObjectiveFunction& objective);

  Result<FreeGradient> free_gradient() override;
  void set_direction(const LbfgsDirection& direction) override;
  Result<Attempt> attempt(double alpha, std::stop_token stop) override;
  void keep() override;
  PairProducts accept() override;
  void remember(std::size_t most) override;
  void forget_all() override;

 private:
  struct Point {
    std::vector<double> x;
    Evaluation at;
  };
  bool held(std::size_t i) const;
  std::vector<double> projected(double alpha) const;

  LbfgsState& state_;
  const Bounds& bounds_;
  const ObjectiveFunction& objective_;
  std::vector<double> free_;  // g~
  std::vector<double> d_;
  double slope_ = 0.0;  // g . d
  double move_ = 0.0;   // max |d|
  Point last_;
  Point best_;
  CurvaturePair newest_;
};

}  // namespace opaline::reconstruct
