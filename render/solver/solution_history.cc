#include "render/solver/solution_history.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/flush_denormals.h"

namespace opaline::render {
namespace {

constexpr int kMost = 4;
constexpr int kChunk = 256;

/// The products of b and the kept A x with one another, one channel: the normal
/// equations.
struct Normal {
  std::array<std::array<double, kMost>, kMost> matrix{};
  std::array<double, kMost> right{};
};

/// Solves the normal equations by Cholesky, passing over what depends on those
/// before it.
std::array<double, kMost> solve(const Normal& normal, int n, double smallest) {
  std::array<std::array<double, kMost>, kMost> l{};
  std::array<double, kMost> y{};
  std::array<bool, kMost> used{};
  for (int i = 0; i < n; ++i) {
    double pivot = normal.matrix[i][i];
    double right = normal.right[i];
    for (int k = 0; k < i; ++k) {
      if (!used[k]) continue;
      double sum = normal.matrix[i][k];
      for (int m = 0; m < k; ++m) sum -= used[m] ? l[i][m] * l[k][m] : 0.0;
      l[i][k] = sum / l[k][k];
      pivot -= l[i][k] * l[i][k];
      right -= l[i][k] * y[k];
    }
    used[i] = pivot > smallest * normal.matrix[i][i];
    if (!used[i]) continue;
    l[i][i] = std::sqrt(pivot);
    y[i] = right / l[i][i];
  }
  std::array<double, kMost> c{};
  for (int i = n; i-- > 0;) {
    if (!used[i]) continue;
    double sum = y[i];
    for (int k = i + 1; k < n; ++k) sum -= used[k] ? l[k][i] * c[k] : 0.0;
    c[i] = sum / l[i][i];
  }
  return c;
}

using Normals = std::array<Normal, 3>;

}  // namespace

template <class T>
void SolutionHistory<T>::add(const std::vector<Lanes<T>>& x, const std::vector<Lanes<T>>& ax) {
  const int most = std::min(most_, kMost);
  if (most <= 0) return;
  Solution solution;
  if (static_cast<int>(kept_.size()) >= most) {  // its memory is used again
    solution = std::move(kept_.back());
    kept_.pop_back();
  }
  solution.x = x;
  solution.ax = ax;
  kept_.push_front(std::move(solution));
}

template <class T>
void SolutionHistory<T>::refresh(const LaneMatrix<T>& matrix, ThreadTeam& team) {
  for (Solution& solution : kept_)
    team.run([&](int thread) {
      const FlushDenormals flush;
      const RowRange range = share_of(matrix.rows(), thread, team.size());
      for (int i = range.first; i < range.last; ++i)
        solution.ax[i] = apply_row(matrix, solution.x.data(), i);
    });
}

template <class T>
std::vector<Lanes<T>> SolutionHistory<T>::best_combination(const std::vector<Lanes<T>>& b,
                                                           ThreadTeam& team) const {
  const auto n = static_cast<int>(kept_.size());
  const auto rows = static_cast<int>(b.size());
  std::vector<Normals> parts(team.size());
  team.run([&](int thread) {
    const FlushDenormals flush;
    const RowRange range = share_of(rows, thread, team.size());
    for (int first = range.first; first < range.last; first += kChunk) {
      const int last = std::min(first + kChunk, range.last);
      for (int j = 0; j < n; ++j) {
        const Lanes<T>* aj = kept_[j].ax.data();
        for (int k = 0; k <= j + 1; ++k) {  // k = j + 1 stands for b
          const Lanes<T>* other = k <= j ? kept_[k].ax.data() : b.data();
          Lanes<T> sum = Lanes<T>::zero();
          for (int i = first; i < last; ++i) sum += aj[i] * other[i];
          for (int lane = 0; lane < 3; ++lane) {
            Normal& normal = parts[thread][lane];
            (k <= j ? normal.matrix[j][k] : normal.right[j]) += static_cast<double>(sum[lane]);
          }
        }
      }
    }
  });
  std::vector<Lanes<T>> combination(n, Lanes<T>::zero());
  for (int lane = 0; lane < 3; ++lane) {
    Normal total;
    for (const Normals& part : parts) {
      for (int j = 0; j < n; ++j) {
        total.right[j] += part[lane].right[j];
        for (int k = 0; k <= j; ++k) total.matrix[j][k] += part[lane].matrix[j][k];
      }
    }
    const auto c = solve(total, n, sizeof(T) == 4 ? 1e-5 : 1e-10);
    for (int j = 0; j < n; ++j) combination[j].set(lane, static_cast<T>(c[j]));
  }
  return combination;
}

template <class T>
void SolutionHistory<T>::guess(const std::vector<Lanes<T>>& b,
                               std::vector<Lanes<T>>& x,
                               ThreadTeam& team) const {
  if (kept_.empty() || kept_.front().x.size() != b.size()) return;
  const std::vector<Lanes<T>> c = best_combination(b, team);
  team.run([&](int thread) {
    const FlushDenormals flush;
    const RowRange range = share_of(static_cast<int>(b.size()), thread, team.size());
    for (int i = range.first; i < range.last; ++i) {
      Lanes<T> sum = Lanes<T>::zero();
      for (std::size_t j = 0; j < kept_.size(); ++j) sum += c[j] * kept_[j].x[i];
      x[i] = sum;
    }
  });
}

template class SolutionHistory<float>;
template class SolutionHistory<double>;

}  // namespace opaline::render
