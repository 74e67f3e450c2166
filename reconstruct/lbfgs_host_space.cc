#include "reconstruct/lbfgs_host_space.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>

namespace opaline::reconstruct {
namespace {

double dot(std::span<const double> a, std::span<const double> b) {
  using Vector = Eigen::Map<const Eigen::VectorXd>;
  const auto size = static_cast<Eigen::Index>(a.size());
  return Vector(a.data(), size).dot(Vector(b.data(), size));
}

double largest(std::span<const double> a) {
  double m = 0.0;
  for (const double v : a) m = std::max(m, std::abs(v));
  return m;
}

void add(std::span<double> target, double factor, std::span<const double> source) {
  for (std::size_t i = 0; i < target.size(); ++i) target[i] += factor * source[i];
}

std::array<double, 4> products_of(const CurvaturePair& a, const CurvaturePair& b) {
  return {dot(a.s, b.s), dot(a.s, b.y), dot(a.y, b.s), dot(a.y, b.y)};
}

// Of a pair with itself and those of `pairs` before `count`.
PairProducts all_products(const CurvaturePair& pair,
                          const std::deque<CurvaturePair>& pairs,
                          std::size_t count) {
  PairProducts products{products_of(pair, pair)};
  while (count-- > 0) products.push_back(products_of(pair, pairs[count]));
  return products;
}

}  // namespace

HostSpace::HostSpace(LbfgsState& state, const Bounds& bounds, const ObjectiveFunction& objective)
    : state_(state), bounds_(bounds), objective_(objective) {
  if (state.products.size() == state.pairs.size()) return;
  state.products.clear();
  for (std::size_t k = 0; k < state.pairs.size(); ++k)
    state.products.push_back(all_products(state.pairs[k], state.pairs, k));
}

bool HostSpace::held(std::size_t i) const {
  return (state_.x[i] <= bounds_.lower[i] && state_.at.gradient[i] > 0.0) ||
         (state_.x[i] >= bounds_.upper[i] && state_.at.gradient[i] < 0.0);
}

Result<LbfgsSpace::FreeGradient> HostSpace::free_gradient() {
  free_ = state_.at.gradient;
  for (std::size_t i = 0; i < free_.size(); ++i)
    if (held(i)) free_[i] = 0.0;
  FreeGradient g{largest(free_), dot(free_, free_), {}, {}};
  for (const CurvaturePair& pair : state_.pairs) {
    g.s.push_back(dot(free_, pair.s));
    g.y.push_back(dot(free_, pair.y));
  }
  return g;
}

void HostSpace::set_direction(const LbfgsDirection& direction) {
  d_.assign(free_.size(), 0.0);
  add(d_, direction.gradient, free_);
  for (std::size_t k = 0; k < direction.s.size(); ++k) {
    add(d_, direction.y[k], state_.pairs[k].y);
    add(d_, direction.s[k], state_.pairs[k].s);
  }
  for (std::size_t i = 0; i < d_.size(); ++i)
    if (free_[i] == 0.0) d_[i] = 0.0;
  move_ = largest(d_);
  if (move_ > direction.largest_move) {
    for (double& v : d_) v *= direction.largest_move / move_;
    move_ = direction.largest_move;
  }
  slope_ = dot(state_.at.gradient, d_);
}

std::vector<double> HostSpace::projected(double alpha) const {
  std::vector<double> moved(d_.size());
  for (std::size_t i = 0; i < moved.size(); ++i)
    moved[i] = std::clamp(state_.x[i] + alpha * d_[i], bounds_.lower[i], bounds_.upper[i]);
  return moved;
}

Result<LbfgsSpace::Attempt> HostSpace::attempt(double alpha, std::stop_token stop) {
  last_.x = projected(alpha);
  auto at = objective_(last_.x, std::move(stop));
  if (!at) return at.error();
  last_.at = *std::move(at);
  double promised = 0.0;
  for (std::size_t i = 0; i < d_.size(); ++i)
    promised += state_.at.gradient[i] * (last_.x[i] - state_.x[i]);
  return Attempt{
      state_.at.value, last_.at.value, promised, slope_, dot(last_.at.gradient, d_), move_};
}

void HostSpace::keep() { best_ = std::move(last_); }

PairProducts HostSpace::accept() {
  newest_ = {best_.x, best_.at.gradient};
  add(newest_.s, -1.0, state_.x);
  add(newest_.y, -1.0, state_.at.gradient);
  state_.x = std::move(best_.x);
  state_.at = std::move(best_.at);
  return all_products(newest_, state_.pairs, state_.pairs.size());
}

void HostSpace::remember(std::size_t most) {
  state_.pairs.push_back(std::move(newest_));
  if (state_.pairs.size() > most) state_.pairs.pop_front();
}

void HostSpace::forget_all() { state_.pairs.clear(); }

}  // namespace opaline::reconstruct
