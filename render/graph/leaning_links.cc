#include "render/graph/leaning_links.h"

#include <utility>

#include "render/solver/lane_matrix.h"

namespace opaline::render {
namespace {

constexpr double kUpright = 1e-6;   // of a link's reach
constexpr double kMostDelta = 0.5;  // of phi

template <class T>
Lanes<T> lanes_of(const std::array<double, 3>& values) {
  Lanes<T> lanes = Lanes<T>::zero();
  for (int c = 0; c < 3; ++c) lanes.set(c, static_cast<T>(values[c]));
  return lanes;
}

template <class T>
Lanes<T> along(const std::array<Lanes<T>, 3>& gradient, Vec3 way) {
  return gradient[0] * static_cast<T>(way.x) + gradient[1] * static_cast<T>(way.y) +
         gradient[2] * static_cast<T>(way.z);
}

template <class T>
Lanes<T> within_half(const Lanes<T>& delta, const Lanes<T>& phi) {
  Lanes<T> result = Lanes<T>::zero();
  for (int c = 0; c < 3; ++c) {
    const T most = static_cast<T>(kMostDelta) * std::abs(phi[c]);
    result.set(c, std::clamp(delta[c], -most, most));
  }
  return result;
}

double reach_from(const QuadGraph& graph, int node, int to) {
  for (const auto& link : graph.links[node]) {
    if (link.inner == to) return link.reach;
  }
  return 1.0;
}

}  // namespace

template <class T>
LeaningLinks<T>::LeaningLinks(const TetMesh& mesh,
                              const QuadGraph& graph,
                              const reconstruct::diffusion::Boundary& boundary,
                              ThreadTeam& team)
    : mesh_(mesh),
      graph_(graph),
      boundary_(boundary),
      team_(team),
      surface_delta_(graph.surface.size(), Lanes<T>::zero()) {}

template <class T>
typename LeaningLinks<T>::Cell LeaningLinks<T>::cell_at(int node) const {
  Cell cell{};
  cell.node = node;
  for (int k = 0; k < 4; ++k) {
    const QuadGraph::Link& link = graph_.links[node][k];
    const auto face = face_of(mesh_.tets[node], k);
    const Vec3 a = mesh_.vertices[face[0]];
    const Vec3 b = mesh_.vertices[face[1]];
    const Vec3 c = mesh_.vertices[face[2]];
    const Vec3 area = cross(b - a, c - a) * 0.5;
    const Vec3 n = normalized(area);
    const auto sideways = [n](Vec3 way) { return way - n * dot(way, n); };
    cell.across[k] = area * (1.0 / graph_.volumes[node]);
    cell.middle[k] = sideways((a + b + c) * (1.0 / 3.0) - graph_.inner[node]);
    cell.lean[k] = cell.middle[k];
    if (link.inner >= 0) {
      const double back = reach_from(graph_, link.inner, node);
      const Vec3 way = sideways(graph_.inner[link.inner] - graph_.inner[node]);
      cell.lean[k] = way * (link.reach / (link.reach + back));
      cell.beyond[k] = cell.middle[k] - way;
    }
  }
  return cell;
}

template <class T>
void LeaningLinks<T>::weigh(Cell& cell) const {
  for (int k = 0; k < 4; ++k) {
    const QuadGraph::Link& link = graph_.links[cell.node][k];
    const Lanes<T> here = kappa_[cell.node] * static_cast<T>(1.0 / link.reach);
    Lanes<T> there = Lanes<T>::all(static_cast<T>(1.0 / (2.0 * boundary_.a)));
    if (link.inner >= 0) {
      there = kappa_[link.inner] * static_cast<T>(1.0 / reach_from(graph_, link.inner, cell.node));
    }
    cell.share[k] = divide(here, here + there);
    cell.conductance[k] = cell.share[k] * there * static_cast<T>(link.area);
  }
}

template <class T>
void LeaningLinks<T>::update(std::span<const Optics> optics) {
  const std::vector<Gradient> gradients = std::move(gradients_);
  const std::vector<int> cells = std::move(cell_of_);
  cells_.clear();
  gradients_.clear();
  cell_of_.assign(graph_.inner.size(), -1);
  kappa_.resize(optics.size());
  for (std::size_t i = 0; i < graph_.inner.size(); ++i) {
    kappa_[i] = lanes_of<T>(optics[i].diffusion);
    const Cell cell = cell_at(static_cast<int>(i));
    bool leans = false;
    for (int k = 0; k < 4; ++k) {
      leans = leans || length(cell.lean[k]) > kUpright * graph_.links[i][k].reach;
    }
    if (!leans) continue;
    cell_of_[i] = static_cast<int>(cells_.size());
    cells_.push_back(cell);
    Gradient& gradient = gradients_.emplace_back();
    gradient.fill(Lanes<T>::zero());
    if (i < cells.size() && cells[i] >= 0) gradient = gradients[cells[i]];
  }
  for (Cell& cell : cells_) weigh(cell);
  sum_up(nullptr);
}

template <class T>
void LeaningLinks<T>::clear() {
  for (Gradient& g : gradients_) g.fill(Lanes<T>::zero());
  sum_up(nullptr);
}

/// phi at the middle of a face, less phi_i.
template <class T>
Lanes<T> LeaningLinks<T>::face_value(const Cell& cell,
                                     int k,
                                     const Gradient& own,
                                     const Sight& sight) const {
  const QuadGraph::Link& link = graph_.links[cell.node][k];
  const Lanes<T>& phi = sight.phi[cell.node];
  Lanes<T> other = Lanes<T>::zero();
  if (link.inner >= 0) {
    const int beyond = cell_of_[link.inner];
    other =
        sight.phi[link.inner] + along<T>(beyond >= 0 ? gradients_[beyond] : own, cell.beyond[k]);
  } else {
    for (int c = 0; c < 3; ++c) {
      other.set(c, static_cast<T>(boundary_.source_scale * sight.q[link.surface][c]));
    }
  }
  const Lanes<T> foot = phi + along<T>(own, cell.middle[k]);
  return other + (foot - other) * cell.share[k] - phi;
}

template <class T>
typename LeaningLinks<T>::Gradient LeaningLinks<T>::gradient_of(const Cell& cell,
                                                                const Gradient& now,
                                                                const Sight& sight) const {
  Gradient gradient;
  gradient.fill(Lanes<T>::zero());
  for (int k = 0; k < 4; ++k) {
    const Lanes<T> value = face_value(cell, k, now, sight);
    gradient[0] += value * static_cast<T>(cell.across[k].x);
    gradient[1] += value * static_cast<T>(cell.across[k].y);
    gradient[2] += value * static_cast<T>(cell.across[k].z);
  }
  return gradient;
}

/// Takes `share` of the step to the gradients of this field; answers how much the right-hand side changes by it.
template <class T>
double LeaningLinks<T>::follow(const Sight& sight, double share) {
  const auto step = static_cast<T>(share);
  found_.resize(cells_.size());
  team_.run([&](int thread) {
    const RowRange range = share_of(static_cast<int>(cells_.size()), thread, team_.size());
    for (int c = range.first; c < range.last; ++c) {
      const Gradient& now = gradients_[c];
      found_[c] = gradient_of(cells_[c], now, sight);
      for (int axis = 0; axis < 3; ++axis) {
        found_[c][axis] = now[axis] + (found_[c][axis] - now[axis]) * step;
      }
    }
  });
  std::swap(gradients_, found_);
  std::vector<Lanes<T>> change;
  std::swap(change, sum_);
  sum_up(&sight.phi);
  for (std::size_t i = 0; i < sum_.size(); ++i) change[i] -= sum_[i];
  return norm_of(change);
}

template <class T>
void LeaningLinks<T>::sum_up(const std::vector<Lanes<T>>* phi) {
  sum_.assign(graph_.inner.size(), Lanes<T>::zero());
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    for (int k = 0; k < 4; ++k) {
      const QuadGraph::Link& link = graph_.links[cell.node][k];
      Lanes<T> delta = along<T>(gradients_[c], cell.lean[k]);
      if (phi != nullptr) delta = within_half(delta, (*phi)[cell.node]);
      const Lanes<T> flux = cell.conductance[k] * delta;
      sum_[cell.node] -= flux;
      if (link.inner >= 0) sum_[link.inner] += flux;
      if (link.inner < 0) surface_delta_[link.surface] = delta;
    }
  }
}

template class LeaningLinks<float>;
template class LeaningLinks<double>;

}  // namespace opaline::render
