#include "render/solver/sweep_matrix.h"

#include <algorithm>
#include <cmath>

#include "render/solver/large_pages.h"

namespace opaline::render {
namespace {

template <class T>
Lanes<T> magnitude(const Lanes<T>& a) {
  Lanes<T> result{};
  for (int lane = 0; lane < kLanes; ++lane) result.set(lane, std::abs(a[lane]));
  return result;
}

}  // namespace

template <class T>
SweepMatrix<T>::SweepMatrix(const LaneMatrix<T>& a, int blocks, bool keeps_exact)
    : keeps_exact_(keeps_exact) {
  const int count = std::clamp(blocks, 1, std::max(1, a.rows() / kFewestRows));
  for (int b = 0; b < count; ++b) blocks_.push_back(share_of(a.rows(), b, count));
  find_couplings(a);
  take_entries(a);
}

template <class T>
void SweepMatrix<T>::find_couplings(const LaneMatrix<T>& a) {
  reserve_large(starts_, a.rows() + 1);
  reserve_large(columns_, a.columns.size() / 2 + 1);
  seams_.of_blocks.push_back(0);
  for (const RowRange& range : blocks_) {
    for (int i = range.first; i < range.last; ++i) {
      for (int e = a.starts[i]; e < a.starts[i + 1]; ++e) {
        const int k = a.columns[e];
        const bool inside = k >= range.first && k < range.last;
        if (inside && k > i) continue;
        (inside ? columns_ : seams_.columns).push_back(k);
        (inside ? entries_ : seams_.entries).push_back(e);
      }
      starts_.push_back(static_cast<int>(columns_.size()));
      if (static_cast<int>(seams_.columns.size()) == seams_.starts.back()) continue;
      seams_.rows.push_back(i);
      seams_.starts.push_back(static_cast<int>(seams_.columns.size()));
    }
    seams_.of_blocks.push_back(static_cast<int>(seams_.rows.size()));
  }
}

template <class T>
template <class Visit>
void SweepMatrix<T>::over_seams(int block, const Visit& visit) const {
  for (int s = seams_.of_blocks[block]; s < seams_.of_blocks[block + 1]; ++s) {
    for (int e = seams_.starts[s]; e < seams_.starts[s + 1]; ++e)
      visit(seams_.rows[s], seams_.columns[e], seams_.couplings[e]);
  }
}

template <class T>
void SweepMatrix<T>::take_entries(const LaneMatrix<T>& a) {
  const std::size_t count = entries_.size();
  const std::size_t rows = a.rows();
  reserve_large(exact_, keeps_exact_ ? count : 0);
  reserve_large(rough_, count);
  reserve_large(rough_sinks_, rows);
  exact_.clear();
  rough_.clear();
  rough_sinks_.clear();
  seams_.couplings.clear();
  for (const int e : entries_) {
    const Lanes<T> coupling = Lanes<T>::zero() - a.entries[e];
    if (keeps_exact_) exact_.push_back(coupling);
    rough_.push_back(RoughEntry<T>::of(coupling));
  }
  for (const int e : seams_.entries) seams_.couplings.push_back(Lanes<T>::zero() - a.entries[e]);
  if (keeps_exact_) sinks_ = a.sinks;
  for (const Lanes<T>& sink : a.sinks) rough_sinks_.push_back(RoughEntry<T>::of(sink));
  invert_diagonal();
}

/// Made of the rough entries, so that a matrix of conductances stays one.
template <class T>
void SweepMatrix<T>::invert_diagonal() {
  const auto rows = static_cast<int>(rough_sinks_.size());
  reserve_large(inverse_, rows);
  inverse_.assign(rows, Lanes<T>::zero());
  for (int i = 0; i < rows; ++i) {
    inverse_[i] += rough_sinks_[i].value();
    for (int e = starts_[i]; e < starts_[i + 1]; ++e) {
      inverse_[i] += rough_[e].value();
      inverse_[columns_[e]] += rough_[e].value();
    }
  }
  for (int block = 0; block < blocks(); ++block)
    over_seams(block, [&](int i, int, const Lanes<T>& g) { inverse_[i] += g + magnitude(g); });
  for (Lanes<T>& value : inverse_) value = divide(Lanes<T>::all(1), value);
}

template <class T>
void SweepMatrix<T>::sweep_up(int block, const Field& r, Field& x, Field& rest) const {
  const RowRange range = blocks_[block];
  Lanes<T>* const values = x.data();
  Lanes<T>* const left = rest.data();
  for (int k = range.first; k < range.last; ++k) {
    Lanes<T> sum = r[k];
    for (int e = starts_[k]; e < starts_[k + 1]; ++e)
      sum += rough_[e].value() * values[columns_[e]];
    const Lanes<T> own = inverse_[k] * sum;
    for (int e = starts_[k]; e < starts_[k + 1]; ++e) left[columns_[e]] += rough_[e].value() * own;
    values[k] = own;
    left[k] = Lanes<T>::zero();
  }
}

template <class T>
void SweepMatrix<T>::add_seams_to_rest(int block, const Field& x, Field& rest) const {
  over_seams(block,
             [&](int i, int k, const Lanes<T>& g) { rest[i] += g * x[k] + magnitude(g) * x[i]; });
}

template <class T>
void SweepMatrix<T>::hear_seams(int block, const Field& x, Field& heard) const {
  over_seams(block, [&](int i, int k, const Lanes<T>& g) { heard[i] += g * (x[k] - x[i]); });
}

template <class T>
auto SweepMatrix<T>::sweep_down(int block, const Field& r, Field& heard, Field& x) const -> Sum {
  const RowRange range = blocks_[block];
  Lanes<T>* const values = x.data();
  Lanes<T>* const above = heard.data();
  RowTotal<T> product;
  for (int k = range.last; k-- > range.first;) {
    const Lanes<T> before = values[k];
    Lanes<T> sum = r[k] + above[k] - rough_sinks_[k].value() * before;
    above[k] = Lanes<T>::zero();
    for (int e = starts_[k]; e < starts_[k + 1]; ++e)
      sum += rough_[e].value() * (values[columns_[e]] - before);
    const Lanes<T> own = before + inverse_[k] * sum;
    for (int e = starts_[k]; e < starts_[k + 1]; ++e)
      above[columns_[e]] += rough_[e].value() * (own - values[columns_[e]]);
    values[k] = own;
    product.add(r[k] * own);
  }
  return product.value();
}

template <class T>
auto SweepMatrix<T>::multiply_seams(int block, const Field& x, Field& product) const -> Sum {
  RowTotal<T> energy;
  over_seams(block, [&](int i, int k, const Lanes<T>& g) {
    const Lanes<T> step = x[i] - x[k];
    const Lanes<T> flow = g * step;
    product[i] += flow;
    energy.add(flow * step * T{0.5});  // the other end counts the rest
  });
  return energy.value();
}

template class SweepMatrix<float>;
template class SweepMatrix<double>;

}  // namespace opaline::render
