#include "render/solver/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "render/solver/large_pages.h"

namespace opaline::render {
namespace {

constexpr int kParallelRows = 4000;  // fewer are not worth waking anybody

template <class Work>
void over_rows(int rows, ThreadTeam& team, const Work& work) {
  if (rows < kParallelRows) {
    work(RowRange{0, rows});
    return;
  }
  team.run([&](int thread) { work(share_of(rows, thread, team.size())); });
}

}  // namespace

template <class T>
struct Hierarchy<T>::Level {
  std::unique_ptr<SweepMatrix<T>> matrix;  // none at the finest, which belongs to the caller
  Interpolation<T> prolongation;           // from the next level; empty at the coarsest
  Interpolation<T> restriction;
  Field b;  // empty at the finest, like x
  Field x;
  Field rest;
  Field heard;  // zero between two cycles

  explicit Level(int rows) {
    for (Field* field : {&rest, &heard}) *field = large_vector<Lanes<T>>(rows, Lanes<T>::zero());
  }
  void make_coarse(const LaneMatrix<T>& a, int blocks) {
    matrix = std::make_unique<SweepMatrix<T>>(a, blocks, false);
    for (Field* field : {&b, &x}) *field = large_vector<Lanes<T>>(a.rows(), Lanes<T>::zero());
  }

  void restrict_to(Level& coarse, ThreadTeam& team) const {
    over_rows(restriction.rows(), team, [&](RowRange range) {
      for (int c = range.first; c < range.last; ++c) {
        Lanes<T> sum = Lanes<T>::zero();
        for (int e = restriction.starts[c]; e < restriction.starts[c + 1]; ++e) {
          sum += rest[restriction.columns[e]] * restriction.weights[e];
        }
        coarse.b[c] = sum;
      }
    });
  }

  void add_from(const Level& coarse, Field& field, ThreadTeam& team) const {
    over_rows(prolongation.rows(), team, [&](RowRange range) {
      for (int i = range.first; i < range.last; ++i) {
        Lanes<T> sum = Lanes<T>::zero();
        for (int e = prolongation.starts[i]; e < prolongation.starts[i + 1]; ++e) {
          sum += coarse.x[prolongation.columns[e]] * prolongation.weights[e];
        }
        field[i] += sum;
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
Hierarchy<T>::Hierarchy(const LaneMatrix<T>& finest, const HierarchyOptions& options, int threads) {
  LaneMatrix<T> here;
  const LaneMatrix<T>* a = &finest;
  double strength = options.strength;
  levels_.emplace_back(a->rows());
  while (a->rows() > options.coarsest_rows &&
         static_cast<int>(levels_.size()) < options.most_levels) {
    const Groups groups = aggregate(*a, strength, levels_.size() == 1 ? options.first_rings : 1);
    if (groups.count * 10 > a->rows() * 9) break;  // nothing couples any more
    Level& fine = levels_.back();
    fine.prolongation = smooth_interpolation(*a, groups, strength);
    fine.restriction = transpose(fine.prolongation);
    here = coarsen(*a, fine.prolongation, fine.restriction);
    a = &here;
    levels_.emplace_back(here.rows());
    levels_.back().make_coarse(here, threads);
    entries_ += static_cast<double>(here.columns.size() + here.sinks.size());
    strength *= 0.5;
  }
  entries_ /= static_cast<double>(finest.columns.size() + finest.sinks.size());
  if (a->rows() <= 4 * options.coarsest_rows) coarsest_ = std::make_unique<Coarsest>(*a);
}

template <class T>
Hierarchy<T>::~Hierarchy() = default;
template <class T>
Hierarchy<T>::Hierarchy(Hierarchy&&) noexcept = default;
template <class T>
Hierarchy<T>& Hierarchy<T>::operator=(Hierarchy&&) noexcept = default;

template <class T>
Lanes<T> Hierarchy<T>::cycle(
    std::size_t level, const SweepMatrix<T>& a, const Field& r, Field& x, ThreadTeam& team) {
  Level& here = levels_[level];
  a.over_blocks(team, [&](int block) { a.sweep_up(block, r, x, here.rest); });
  if (level + 1 < levels_.size()) {
    if (a.has_seams())
      a.over_blocks(team, [&](int block) { a.add_seams_to_rest(block, x, here.rest); });
    here.restrict_to(levels_[level + 1], team);
    descend(level + 1, team);
    here.add_from(levels_[level + 1], x, team);
  }
  if (a.has_seams()) a.over_blocks(team, [&](int block) { a.hear_seams(block, x, here.heard); });
  return a.sum_over_blocks(team, [&](int block) { return a.sweep_down(block, r, here.heard, x); });
}

template <class T>
void Hierarchy<T>::descend(std::size_t level, ThreadTeam& team) {
  Level& here = levels_[level];
  if (level + 1 == levels_.size() && coarsest_ != nullptr) {
    coarsest_->apply(here.b, here.x);
    return;
  }
  cycle(level, *here.matrix, here.b, here.x, team);
}

template <class T>
Lanes<T> Hierarchy<T>::precondition(const SweepMatrix<T>& finest,
                                    const Field& r,
                                    Field& z,
                                    ThreadTeam& team) {
  if (levels_.size() > 1 || coarsest_ == nullptr) return cycle(0, finest, r, z, team);
  coarsest_->apply(r, z);
  Lanes<T> product = Lanes<T>::zero();
  for (std::size_t i = 0; i < r.size(); ++i) product += r[i] * z[i];
  return product;
}

template <class T>
int Hierarchy<T>::levels() const {
  return static_cast<int>(levels_.size());
}

template class Hierarchy<float>;
template class Hierarchy<double>;

}  // namespace opaline::render
