#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// Conductances between neighbours of an n x n x n grid, different in every
/// channel; all but its corner in the dark of a small sink. `contrast`: every
/// other slab of eight layers conducts so many times better.
template <class T>
LaneMatrix<T> grid(int n, double contrast = 1.0, double sink = 1e-3) {
  LaneMatrix<T> a;
  const auto conductance = [&](int k, int c) {
    return (1.0 + 0.5 * c) * (k / 8 % 2 == 0 ? 1.0 : contrast);
  };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const int steps[6][3]{{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
        for (const auto& step : steps) {
          const int x = i + step[0];
          const int y = j + step[1];
          const int z = k + step[2];
          if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= n) continue;
          a.columns.push_back((z * n + y) * n + x);
          Lanes<T> entry = Lanes<T>::zero();
          for (int c = 0; c < 3; ++c) {
            const double own = conductance(k, c);
            const double other = conductance(z, c);
            entry.set(c, static_cast<T>(-2.0 * own * other / (own + other)));
          }
          a.entries.push_back(entry);
        }
        a.starts.push_back(static_cast<int>(a.columns.size()));
        a.sinks.push_back(Lanes<T>::all(static_cast<T>(k == 0 ? 0.3 : sink)));
      }
    }
  }
  return a;
}

template <class T>
std::vector<Lanes<T>> random_field(int rows, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Lanes<T>> field(rows, Lanes<T>::zero());
  for (auto& value : field) {
    for (int c = 0; c < 3; ++c) value.set(c, static_cast<T>(uniform(generator)));
  }
  return field;
}

template <class T>
std::vector<Lanes<T>> dark(int rows) {
  return std::vector<Lanes<T>>(rows, Lanes<T>::zero());
}

}  // namespace opaline::render
