#include "render/solver/aggregation.h"

#include <algorithm>
#include <cmath>

#include "render/solver/large_pages.h"

namespace opaline::render {
namespace {

constexpr std::size_t kLikelyGroups = 3;  // that a node follows; to reserve memory by

template <class T>
std::vector<Lanes<T>> diagonals(const LaneMatrix<T>& a) {
  std::vector<Lanes<T>> diagonal(a.rows());
  for (int i = 0; i < a.rows(); ++i) diagonal[i] = a.diagonal(i);
  return diagonal;
}

/// Which entries couple strongly.
template <class T>
std::vector<char> strong_entries(const LaneMatrix<T>& a, double strength) {
  const std::vector<Lanes<T>> diagonal = diagonals(a);
  std::vector<char> strong(a.columns.size(), 0);
  for (int i = 0; i < a.rows(); ++i) {
    for (int e = a.starts[i]; e < a.starts[i + 1]; ++e) {
      const Lanes<T> squared = a.entries[e] * a.entries[e];
      const Lanes<T> limit =
          diagonal[i] * diagonal[a.columns[e]] * static_cast<T>(strength * strength);
      for (int lane = 0; lane < 3; ++lane)
        strong[e] |= static_cast<char>(squared[lane] > limit[lane]);
    }
  }
  return strong;
}

/// Collects groups over the graph of strong couplings.
template <class T>
class Grouping {
 public:
  Grouping(const LaneMatrix<T>& a, double strength, int rings)
      : a_(a), strong_(strong_entries(a, strength)), rings_(rings) {
    groups_.group_of.assign(a.rows(), -1);
  }

  Groups run() {
    for (int i = 0; i < a_.rows(); ++i) start_group(i);
    const std::vector<int> first = groups_.group_of;
    for (int i = 0; i < a_.rows(); ++i) {
      if (groups_.group_of[i] < 0) join_neighbour(i, first);
    }
    for (int i = 0; i < a_.rows(); ++i) {
      if (groups_.group_of[i] < 0) start_group_of_rest(i);
    }
    return std::move(groups_);
  }

 private:
  /// A new group around a node none of whose reach is taken, but for the
  /// outermost ring.
  void start_group(int node) {
    if (groups_.group_of[node] >= 0) return;
    members_.assign(1, node);
    std::size_t begin = 0;
    for (int ring = 0; ring < rings_; ++ring) {
      const std::size_t end = members_.size();
      for (; begin < end; ++begin) {
        if (!add_neighbours(members_[begin], ring == 0)) return;
      }
    }
    for (const int member : members_) groups_.group_of[member] = groups_.count;
    ++groups_.count;
  }

  bool add_neighbours(int node, bool must_be_free) {
    for (int e = a_.starts[node]; e < a_.starts[node + 1]; ++e) {
      const int k = a_.columns[e];
      if (!strong_[e]) continue;
      if (groups_.group_of[k] >= 0) {
        if (must_be_free) return false;
        continue;
      }
      if (std::ranges::find(members_, k) == members_.end()) members_.push_back(k);
    }
    return true;
  }

  void join_neighbour(int node, const std::vector<int>& first) {
    T best = 0;
    for (int e = a_.starts[node]; e < a_.starts[node + 1]; ++e) {
      const int group = first[a_.columns[e]];
      const T coupling =
          std::abs(a_.entries[e][0]) + std::abs(a_.entries[e][1]) + std::abs(a_.entries[e][2]);
      if (!strong_[e] || group < 0 || coupling <= best) continue;
      best = coupling;
      groups_.group_of[node] = group;
    }
  }

  void start_group_of_rest(int node) {
    groups_.group_of[node] = groups_.count;
    for (int e = a_.starts[node]; e < a_.starts[node + 1]; ++e) {
      int& group = groups_.group_of[a_.columns[e]];
      if (strong_[e] && group < 0) group = groups_.count;
    }
    ++groups_.count;
  }

  const LaneMatrix<T>& a_;
  std::vector<char> strong_;
  int rings_;
  Groups groups_;
  std::vector<int> members_;
};

/// Sums up one sparse row at a time.
template <class Value>
class RowSum {
 public:
  explicit RowSum(int column_count) : slot_(column_count, -1) {}
  template <class Term>
  void add(int column, const Term& value) {
    int& slot = slot_[column];
    if (slot < 0) {
      slot = static_cast<int>(columns.size());
      columns.push_back(column);
      values.push_back(value);
    } else {
      values[slot] += value;
    }
  }
  void clear() {
    for (const int column : columns) slot_[column] = -1;
    columns.clear();
    values.clear();
  }
  std::vector<int> columns;
  std::vector<Value> values;

 private:
  std::vector<int> slot_;
};

template <class T>
T mean_of(const Lanes<T>& lanes) {
  return (lanes[0] + lanes[1] + lanes[2]) / 3;
}

}  // namespace

template <class T>
Groups aggregate(const LaneMatrix<T>& a, double strength, int rings) {
  return Grouping<T>(a, strength, rings).run();
}

template <class T>
Interpolation<T> smooth_interpolation(const LaneMatrix<T>& a,
                                      const Groups& groups,
                                      double strength) {
  constexpr T kDamping = T{4} / 5;
  const std::vector<char> strong = strong_entries(a, strength);
  Interpolation<T> p;
  p.coarse_rows = groups.count;
  reserve_large(p.columns, kLikelyGroups * static_cast<std::size_t>(a.rows()));
  reserve_large(p.weights, kLikelyGroups * static_cast<std::size_t>(a.rows()));
  RowSum<T> sum(groups.count);
  for (int i = 0; i < a.rows(); ++i) {
    T diagonal = mean_of(a.sinks[i]);
    for (int e = a.starts[i]; e < a.starts[i + 1]; ++e)
      diagonal -= strong[e] ? mean_of(a.entries[e]) : T{0};
    const T scale = diagonal > 0 ? kDamping / diagonal : T{0};
    sum.clear();
    sum.add(groups.group_of[i], 1 - scale * diagonal);
    for (int e = a.starts[i]; e < a.starts[i + 1]; ++e) {
      if (strong[e]) sum.add(groups.group_of[a.columns[e]], -scale * mean_of(a.entries[e]));
    }
    p.columns.insert(p.columns.end(), sum.columns.begin(), sum.columns.end());
    p.weights.insert(p.weights.end(), sum.values.begin(), sum.values.end());
    p.starts.push_back(static_cast<int>(p.columns.size()));
  }
  return p;
}

template <class T>
Interpolation<T> transpose(const Interpolation<T>& p) {
  Interpolation<T> r;
  r.coarse_rows = p.rows();
  std::vector<int> counts(p.coarse_rows + 1, 0);
  for (const int c : p.columns) ++counts[c + 1];
  for (int c = 0; c < p.coarse_rows; ++c) counts[c + 1] += counts[c];
  r.starts = counts;
  r.columns = large_vector(p.columns.size(), 0);
  r.weights = large_vector(p.columns.size(), T{0});
  for (int i = 0; i < p.rows(); ++i) {
    for (int e = p.starts[i]; e < p.starts[i + 1]; ++e) {
      const int at = counts[p.columns[e]]++;
      r.columns[at] = i;
      r.weights[at] = p.weights[e];
    }
  }
  return r;
}

template <class T>
LaneMatrix<T> coarsen(const LaneMatrix<T>& a,
                      const Interpolation<T>& p,
                      const Interpolation<T>& restriction) {
  LaneMatrix<T> coarse;
  reserve_large(coarse.columns, a.columns.size() / kLikelyGroups);
  reserve_large(coarse.entries, a.columns.size() / kLikelyGroups);
  RowSum<Lanes<T>> fine_row(a.rows());
  RowSum<Lanes<T>> row(p.coarse_rows);
  for (int c = 0; c < p.coarse_rows; ++c) {
    fine_row.clear();  // row c of P^T A, with the diagonal
    for (int e = restriction.starts[c]; e < restriction.starts[c + 1]; ++e) {
      const int i = restriction.columns[e];
      const T w = restriction.weights[e];
      fine_row.add(i, a.diagonal(i) * w);
      for (int k = a.starts[i]; k < a.starts[i + 1]; ++k)
        fine_row.add(a.columns[k], a.entries[k] * w);
    }
    row.clear();
    for (std::size_t k = 0; k < fine_row.columns.size(); ++k) {
      const int i = fine_row.columns[k];
      for (int e = p.starts[i]; e < p.starts[i + 1]; ++e)
        row.add(p.columns[e], fine_row.values[k] * p.weights[e]);
    }
    Lanes<T> sink = Lanes<T>::zero();
    for (std::size_t k = 0; k < row.columns.size(); ++k) {
      sink += row.values[k];
      if (row.columns[k] == c) continue;
      coarse.columns.push_back(row.columns[k]);
      coarse.entries.push_back(row.values[k]);
    }
    coarse.sinks.push_back(sink);
    coarse.starts.push_back(static_cast<int>(coarse.columns.size()));
  }
  return coarse;
}

template Groups aggregate(const LaneMatrix<float>&, double, int);
template Groups aggregate(const LaneMatrix<double>&, double, int);
template Interpolation<float> smooth_interpolation(const LaneMatrix<float>&, const Groups&, double);
template Interpolation<double> smooth_interpolation(const LaneMatrix<double>&,
                                                    const Groups&,
                                                    double);
template Interpolation<float> transpose(const Interpolation<float>&);
template Interpolation<double> transpose(const Interpolation<double>&);
template LaneMatrix<float> coarsen(const LaneMatrix<float>&,
                                   const Interpolation<float>&,
                                   const Interpolation<float>&);
template LaneMatrix<double> coarsen(const LaneMatrix<double>&,
                                    const Interpolation<double>&,
                                    const Interpolation<double>&);

}  // namespace opaline::render
