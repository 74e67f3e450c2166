#include "render/trace/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace opaline::render {
namespace {

constexpr int kLeaf = 4;
constexpr int kLookUp = 4096;  // fewer triangles are sorted without a look at the stop token
constexpr double kRim = 1e-12;

double along(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Vec3 lower(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3 upper(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

int longest_axis(Vec3 size) {
  if (size.x >= size.y && size.x >= size.z) return 0;
  return size.y >= size.z ? 1 : 2;
}

bool meets(const Box& box, const Ray& ray, double enter, double leave) {
  for (int axis = 0; axis < 3; ++axis) {
    const double o = along(ray.origin, axis);
    const double d = along(ray.direction, axis);
    const double low = along(box.low, axis);
    const double high = along(box.high, axis);
    if (d == 0.0) {
      if (o < low || o > high) return false;
      continue;
    }
    const double first = (low - o) / d;
    const double second = (high - o) / d;
    const double near = std::min(first, second);
    const double far = std::max(first, second);
    enter = std::max(enter, near - kRim * std::abs(near));
    leave = std::min(leave, far + kRim * std::abs(far));
  }
  return enter <= leave;
}

}  // namespace

Result<TriangleTree> TriangleTree::create(const TriangleMesh& mesh, const std::stop_token& stop) {
  if (auto valid = validate(mesh); !valid) return valid.error();
  TriangleTree tree(mesh, stop);
  if (stop.stop_requested()) return cancelled("sorting triangles for rays");
  return tree;
}

TriangleTree::TriangleTree(const TriangleMesh& mesh, const std::stop_token& stop)
    : mesh_(&mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  build(0, static_cast<int>(order_.size()), stop);
}

Vec3 TriangleTree::corner(std::size_t triangle, int k) const {
  return mesh_->vertices[mesh_->triangles[triangle][k]];
}

Vec3 TriangleTree::centre(std::size_t triangle) const {
  return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) * (1.0 / 3.0);
}

Box TriangleTree::box_of(int first, int last) const {
  Box box{corner(order_[first], 0), corner(order_[first], 0)};
  for (int i = first; i < last; ++i) {
    for (int k = 0; k < 3; ++k) {
      box.low = lower(box.low, corner(order_[i], k));
      box.high = upper(box.high, corner(order_[i], k));
    }
  }
  return box;
}

void TriangleTree::refit() {
  for (int n = static_cast<int>(nodes_.size()) - 1; n >= 0;
       --n) {  // children come after their parent
    Node& node = nodes_[n];
    if (node.count > 0) {
      node.box = box_of(node.first, node.first + node.count);
    } else {
      const Box& left = nodes_[n + 1].box;
      const Box& right = nodes_[node.right].box;
      node.box = {lower(left.low, right.low), upper(left.high, right.high)};
    }
  }
}

int TriangleTree::build(int first, int last, const std::stop_token& stop) {
  const int own = static_cast<int>(nodes_.size());
  const Box box = box_of(first, last);
  nodes_.push_back({box, first, last - first, 0});
  if (last - first <= kLeaf || (last - first > kLookUp && stop.stop_requested())) return own;
  const int axis = longest_axis(box.size());
  const int middle = first + (last - first) / 2;
  std::nth_element(order_.begin() + first,
                   order_.begin() + middle,
                   order_.begin() + last,
                   [&](std::size_t a, std::size_t b) {
                     return along(centre(a), axis) < along(centre(b), axis);
                   });
  nodes_[own].count = 0;
  build(first, middle, stop);
  const int right = build(middle, last, stop);
  nodes_[own].right = right;
  return own;
}

std::optional<RayHit> TriangleTree::meet(const Ray& ray, std::size_t triangle) const {
  const Vec3 a = corner(triangle, 0);
  const Vec3 ab = corner(triangle, 1) - a;
  const Vec3 ac = corner(triangle, 2) - a;
  const Vec3 p = cross(ray.direction, ac);
  const double volume = dot(ab, p);
  if (volume == 0.0) return std::nullopt;
  const Vec3 from = ray.origin - a;
  const double u = dot(from, p) / volume;
  const Vec3 q = cross(from, ab);
  const double v = dot(ray.direction, q) / volume;
  if (u < -kRim || v < -kRim || u + v > 1.0 + kRim) return std::nullopt;
  return RayHit{triangle, {1.0 - u - v, u, v}, dot(ac, q) / volume};
}

template <class Visit>
void TriangleTree::walk(const Ray& ray,
                        double beyond,
                        const double& before,
                        const Visit& visit) const {
  std::array<int, 64> waiting{};
  int depth = 0;
  waiting[depth++] = 0;
  while (depth > 0) {
    const int own = waiting[--depth];
    const Node& node = nodes_[own];
    if (!meets(node.box, ray, beyond, before)) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const auto hit = meet(ray, order_[i]);
      if (hit && hit->distance > beyond && hit->distance < before && visit(*hit)) return;
    }
    if (node.count > 0) continue;
    waiting[depth++] = node.right;
    waiting[depth++] = own + 1;
  }
}

std::optional<RayHit> TriangleTree::nearest(const Ray& ray, double beyond) const {
  std::optional<RayHit> found;
  double before = std::numeric_limits<double>::infinity();
  walk(ray, beyond, before, [&](const RayHit& hit) {
    found = hit;
    before = hit.distance;
    return false;
  });
  return found;
}

bool TriangleTree::blocked(const Ray& ray, double beyond, double before) const {
  bool found = false;
  walk(ray, beyond, before, [&](const RayHit&) { return found = true; });
  return found;
}

}  // namespace opaline::render
