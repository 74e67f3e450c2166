#include "render/solver/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "render/solver/large_pages.h"
#include "render/solver/past_caches.h"

namespace opaline::render {
namespace {

constexpr int kParallelRows = 4000;  // fewer are not worth waking anybody
constexpr double kSmoothedShare = 0.25;

template <class Work>
void over_rows(int rows, ThreadTeam& team, const Work& work) {
  if (rows < kParallelRows) {
    work(RowRange{0, rows});
    return;
  }
  team.run([&](int thread) {
    work(share_of(rows, thread, team.size()));
    finish_writing();
  });
}

template <class T>
std::vector<Lanes<T>> inverse_diagonal(const LaneMatrix<T>& a) {
  auto inverse = large_vector<Lanes<T>>(a.rows(), Lanes<T>::zero());
  for (int i = 0; i < a.rows(); ++i) inverse[i] = divide(Lanes<T>::all(1), a.diagonal(i));
  return inverse;
}

/// The largest eigenvalue of D^-1 A of any channel, a little above: power
/// iterations.
template <class T>
double largest_eigenvalue(const LaneMatrix<T>& a, const std::vector<Lanes<T>>& inverse) {
  std::vector<Lanes<T>> x(a.rows());
  std::vector<Lanes<T>> y(a.rows());
  for (int i = 0; i < a.rows(); ++i)
    x[i] = Lanes<T>::all(
        static_cast<T>(static_cast<double>(std::int64_t{i} * 7919 % 101) / 50.0 - 1.0));
  double largest = 0.0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    Lanes<T> size = Lanes<T>::zero();
    Lanes<T> before = Lanes<T>::zero();
    for (int i = 0; i < a.rows(); ++i) {
      y[i] = inverse[i] * apply_row(a, x.data(), i);
      size += y[i] * y[i];
      before += x[i] * x[i];
    }
    const Lanes<T> ratio = divide(size, before);
    largest =
        std::sqrt(std::max({static_cast<double>(ratio[0]), double(ratio[1]), double(ratio[2])}));
    Lanes<T> scale{};
    for (int lane = 0; lane < kLanes; ++lane)
      scale.set(lane, size[lane] > 0 ? 1 / std::sqrt(size[lane]) : T{0});
    for (int i = 0; i < a.rows(); ++i) x[i] = y[i] * scale;
  }
  return std::clamp(1.1 * largest, 0.5, 2.0);
}

/// The factors of Chebyshev iteration over [share * largest, largest]: step k
/// adds d = keep[k] d + take[k] D^-1 r.
struct Chebyshev {
  std::vector<double> keep;
  std::vector<double> take;
};

Chebyshev chebyshev(int steps, double largest) {
  const double theta = 0.5 * largest * (1.0 + kSmoothedShare);
  const double delta = 0.5 * largest * (1.0 - kSmoothedShare);
  Chebyshev factors{{0.0}, {1.0 / theta}};
  double rho = delta / theta;
  for (int k = 1; k < steps; ++k) {
    const double next = 1.0 / (2.0 * theta / delta - rho);
    factors.keep.push_back(next * rho);
    factors.take.push_back(2.0 * next / delta);
    rho = next;
  }
  return factors;
}

}  // namespace

template <class T>
struct Hierarchy<T>::Level {
  LaneMatrix<T> matrix;  // empty at the finest, which belongs to the caller
  std::vector<Lanes<T>> inverse;
  Chebyshev factors;
  Interpolation<T> prolongation;  // from the next level; empty at the coarsest
  Interpolation<T> restriction;
  std::vector<Lanes<T>> b;
  std::vector<Lanes<T>> x;
  std::vector<Lanes<T>> next;
  std::vector<Lanes<T>> d;  // empty where there is one step
  std::size_t finest_entries = 0;

  Level(const LaneMatrix<T>& a, int steps)
      : inverse(inverse_diagonal(a)), factors(chebyshev(steps, largest_eigenvalue(a, inverse))) {
    for (auto* field : {&b, &x, &next}) *field = large_vector<Lanes<T>>(a.rows(), Lanes<T>::zero());
    if (steps > 1) d = large_vector<Lanes<T>>(a.rows(), Lanes<T>::zero());
    finest_entries = a.columns.size() + a.sinks.size();
  }

  /// x from zero.
  void first_step(const std::vector<Lanes<T>>& right, ThreadTeam& team) {
    const auto take = static_cast<T>(factors.take[0]);
    over_rows(static_cast<int>(x.size()), team, [&](RowRange range) {
      const FieldWriter<T> first(x.data(), x.size());
      for (int i = range.first; i < range.last; ++i) first.put(i, inverse[i] * right[i] * take);
      if (d.empty()) return;
      for (int i = range.first; i < range.last; ++i) d[i] = x[i];
    });
  }

  /// `row(x, i)` is row i of A x; `out` gets the step's result.
  template <class Row>
  void step(const std::vector<Lanes<T>>& right,
            const Row& row,
            std::size_t k,
            std::vector<Lanes<T>>& out,
            ThreadTeam& team) {
    const auto keep = static_cast<T>(factors.keep[k]);
    const auto take = static_cast<T>(factors.take[k]);
    over_rows(static_cast<int>(x.size()), team, [&](RowRange range) {
      const FieldWriter<T> after(out.data(), out.size());
      for (int i = range.first; i < range.last; ++i) {
        Lanes<T> move = inverse[i] * (right[i] - row(x.data(), i)) * take;
        if (!d.empty()) move = d[i] = k > 0 ? d[i] * keep + move : move;
        after.put(i, x[i] + move);
      }
    });
  }

  template <class Row>
  void residual(const std::vector<Lanes<T>>& right, const Row& row, ThreadTeam& team) {
    over_rows(static_cast<int>(x.size()), team, [&](RowRange range) {
      const FieldWriter<T> left(next.data(), next.size());
      for (int i = range.first; i < range.last; ++i) left.put(i, right[i] - row(x.data(), i));
    });
  }

  void restrict_to(Level& coarse, ThreadTeam& team) const {
    over_rows(restriction.rows(), team, [&](RowRange range) {
      for (int c = range.first; c < range.last; ++c) {
        Lanes<T> sum = Lanes<T>::zero();
        for (int e = restriction.starts[c]; e < restriction.starts[c + 1]; ++e) {
          sum += next[restriction.columns[e]] * restriction.weights[e];
        }
        coarse.b[c] = sum;
      }
    });
  }

  void add_from(const Level& coarse, ThreadTeam& team) {
    over_rows(prolongation.rows(), team, [&](RowRange range) {
      for (int i = range.first; i < range.last; ++i) {
        Lanes<T> sum = Lanes<T>::zero();
        for (int e = prolongation.starts[i]; e < prolongation.starts[i + 1]; ++e) {
          sum += coarse.x[prolongation.columns[e]] * prolongation.weights[e];
        }
        x[i] += sum;
      }
    });
  }
};

/// The inverse of the coarsest matrix, channel by channel, by Cholesky; in
/// double.
template <class T>
struct Hierarchy<T>::Coarsest {
  int rows = 0;
  std::vector<Lanes<T>> inverse;

  explicit Coarsest(const LaneMatrix<T>& a)
      : rows(a.rows()), inverse(static_cast<std::size_t>(rows) * rows, Lanes<T>::zero()) {
    for (int lane = 0; lane < 3; ++lane) invert(a, lane);
  }

  void invert(const LaneMatrix<T>& a, int lane) {
    const int n = rows;
    std::vector<double> l(static_cast<std::size_t>(n) * n, 0.0);
    for (int i = 0; i < n; ++i) {
      l[static_cast<std::size_t>(i) * n + i] = a.diagonal(i)[lane];
      for (int e = a.starts[i]; e < a.starts[i + 1]; ++e)
        l[static_cast<std::size_t>(i) * n + a.columns[e]] = a.entries[e][lane];
    }
    factorise(l);
    std::vector<double> x(n);
    for (int c = 0; c < n; ++c) {
      std::ranges::fill(x, 0.0);
      x[c] = 1.0;
      solve(l, x);
      for (int i = 0; i < n; ++i)
        inverse[static_cast<std::size_t>(i) * n + c].set(lane, static_cast<T>(x[i]));
    }
  }

  void factorise(std::vector<double>& l) const {
    const std::size_t n = rows;
    for (std::size_t j = 0; j < n; ++j) {
      const double before = l[j * n + j];
      double pivot = before;
      for (std::size_t k = 0; k < j; ++k) pivot -= l[j * n + k] * l[j * n + k];
      l[j * n + j] =
          std::sqrt(std::max(pivot,
                             1e-7 * before + 1e-300));  // singular but for rounding: keep it small
      for (std::size_t i = j + 1; i < n; ++i) {
        double sum = l[i * n + j];
        for (std::size_t k = 0; k < j; ++k) sum -= l[i * n + k] * l[j * n + k];
        l[i * n + j] = sum / l[j * n + j];
      }
    }
  }

  void solve(const std::vector<double>& l, std::vector<double>& x) const {
    const std::size_t n = rows;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < i; ++k) x[i] -= l[i * n + k] * x[k];
      x[i] /= l[i * n + i];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; ++k) x[i] -= l[k * n + i] * x[k];
      x[i] /= l[i * n + i];
    }
  }

  void apply(const std::vector<Lanes<T>>& b, std::vector<Lanes<T>>& x) const {
    for (int i = 0; i < rows; ++i) {
      Lanes<T> sum = Lanes<T>::zero();
      for (int k = 0; k < rows; ++k) sum += inverse[static_cast<std::size_t>(i) * rows + k] * b[k];
      x[i] = sum;
    }
  }
};

template <class T>
Hierarchy<T>::Hierarchy(const LaneMatrix<T>& finest, const HierarchyOptions& options)
    : options_(options), rough_(rough_entries(finest)) {
  const LaneMatrix<T>* a = &finest;
  double strength = options.strength;
  const auto most = static_cast<std::size_t>(options.most_levels);
  levels_.reserve(most);  // the next level's matrix is read from the one before
  levels_.emplace_back(*a, options.smoothing_steps);
  while (a->rows() > options.coarsest_rows && levels_.size() < most) {
    const Groups groups = aggregate(*a, strength, levels_.size() == 1 ? options.first_rings : 1);
    if (groups.count * 10 > a->rows() * 9) break;  // nothing couples any more
    Level& fine = levels_.back();
    fine.prolongation = smooth_interpolation(*a, groups, strength);
    fine.restriction = transpose(fine.prolongation);
    LaneMatrix<T> coarse = coarsen(*a, fine.prolongation, fine.restriction);
    levels_.emplace_back(coarse, options.smoothing_steps);
    levels_.back().matrix = std::move(coarse);
    a = &levels_.back().matrix;
    strength *= 0.5;
  }
  if (a->rows() <= 4 * options.coarsest_rows) coarsest_ = std::make_unique<Coarsest>(*a);
}

template <class T>
Hierarchy<T>::~Hierarchy() = default;
template <class T>
Hierarchy<T>::Hierarchy(Hierarchy&&) noexcept = default;
template <class T>
Hierarchy<T>& Hierarchy<T>::operator=(Hierarchy&&) noexcept = default;

/// From the level's own right-hand side into `out`.
template <class T>
template <class Row>
void Hierarchy<T>::cycle(std::size_t level,
                         const std::vector<Lanes<T>>& right,
                         const Row& row,
                         std::vector<Lanes<T>>& out,
                         ThreadTeam& team) {
  Level& here = levels_[level];
  const std::size_t steps = here.factors.take.size();
  here.first_step(right, team);
  for (std::size_t k = 1; k < steps; ++k) {
    here.step(right, row, k, here.next, team);
    std::swap(here.x, here.next);
  }
  if (level + 1 < levels_.size()) {
    here.residual(right, row, team);
    here.restrict_to(levels_[level + 1], team);
    descend(level + 1, team);
    here.add_from(levels_[level + 1], team);
  }
  for (std::size_t k = 0; k + 1 < steps; ++k) {
    here.step(right, row, k, here.next, team);
    std::swap(here.x, here.next);
  }
  here.step(right, row, steps - 1, out, team);
}

template <class T>
void Hierarchy<T>::descend(std::size_t level, ThreadTeam& team) {
  Level& here = levels_[level];
  if (level + 1 == levels_.size() && coarsest_ != nullptr) {
    coarsest_->apply(here.b, here.x);
    return;
  }
  const auto row = [&a = here.matrix](const Lanes<T>* x, int i) { return apply_row(a, x, i); };
  cycle(level, here.b, row, here.next, team);
  std::swap(here.x, here.next);
}

template <class T>
void Hierarchy<T>::precondition(const LaneMatrix<T>& finest,
                                const std::vector<Lanes<T>>& r,
                                std::vector<Lanes<T>>& z,
                                ThreadTeam& team) {
  if (levels_.size() == 1 && coarsest_ != nullptr) {
    coarsest_->apply(r, z);
    return;
  }
  const auto row = [&](const Lanes<T>* x, int i) { return apply_rough_row(finest, rough_, x, i); };
  cycle(0, r, row, z, team);
}

template <class T>
void Hierarchy<T>::matrix_changed(const LaneMatrix<T>& finest) {
  rough_ = rough_entries(finest);
}

template <class T>
int Hierarchy<T>::levels() const {
  return static_cast<int>(levels_.size());
}

template <class T>
double Hierarchy<T>::complexity() const {
  double entries = 0.0;
  for (const Level& level : levels_)
    entries += static_cast<double>(level.matrix.columns.size() + level.matrix.sinks.size());
  return 1.0 + entries / static_cast<double>(levels_[0].finest_entries);
}

template class Hierarchy<float>;
template class Hierarchy<double>;

}  // namespace opaline::render
