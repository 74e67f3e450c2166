#include "render/mesh/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace opaline::render {
namespace {

constexpr int kLeaf = 4;
constexpr int kLookUp = 4096;  // fewer triangles are sorted without a look at the stop token
constexpr double kFar = 2.0;   // in radii of a group
// Of windings: a closed mesh's are that far from 0 and 1 where far groups stand for their triangles.
constexpr double kOutside = 0.1;
constexpr double kStepOfClear = 0.25;  // of the distance to the nearest triangle
constexpr double kStepOfSize = 0.01;   // of the mesh

double component(Vec3 p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

Vec3 low_of(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3 high_of(Vec3 a, Vec3 b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

double squared_distance(const Box& box, Vec3 p) {
  const Vec3 outside{std::max({box.low.x - p.x, 0.0, p.x - box.high.x}),
                     std::max({box.low.y - p.y, 0.0, p.y - box.high.y}),
                     std::max({box.low.z - p.z, 0.0, p.z - box.high.z})};
  return dot(outside, outside);
}

double squared_distance_to_edge(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 ab = b - a;
  const double size = dot(ab, ab);
  const double t = size > 0.0 ? std::clamp(dot(p - a, ab) / size, 0.0, 1.0) : 0.0;
  const Vec3 gap = p - (a + ab * t);
  return dot(gap, gap);
}

double squared_distance_to_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  const double size = dot(n, n);
  const bool over = size > 0.0 && dot(cross(b - a, n), p - a) <= 0.0 &&
                    dot(cross(c - b, n), p - b) <= 0.0 && dot(cross(a - c, n), p - c) <= 0.0;
  if (over) {
    const double height = dot(n, p - a);
    return height * height / size;
  }
  return std::min({squared_distance_to_edge(p, a, b),
                   squared_distance_to_edge(p, b, c),
                   squared_distance_to_edge(p, c, a)});
}

/// Van Oosterom & Strackee, The solid angle of a plane triangle, 1983.
double solid_angle(Vec3 a, Vec3 b, Vec3 c) {
  const double la = length(a);
  const double lb = length(b);
  const double lc = length(c);
  const double below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return 2.0 * std::atan2(dot(a, cross(b, c)), below);
}

}  // namespace

Result<std::unique_ptr<MeshDistance>> MeshDistance::create(const TriangleMesh& mesh,
                                                           const std::stop_token& stop) {
  if (auto valid = validate(mesh); !valid) return valid.error();
  auto distance = std::unique_ptr<MeshDistance>(new MeshDistance(mesh, stop));
  if (stop.stop_requested()) return cancelled("sorting the triangles of a mesh");
  if (distance->triangles_.empty()) return invalid_argument("no triangle of the mesh has an area");
  return distance;
}

MeshDistance::MeshDistance(const TriangleMesh& mesh, const std::stop_token& stop)
    : bounds_(opaline::render::bounds(mesh)) {
  triangles_.reserve(mesh.triangles.size());
  const Vec3 centre = bounds_.centre();
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const Triangle triangle{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const Vec3 n = cross(triangle.b - triangle.a, triangle.c - triangle.a);
    if (!(dot(n, n) > 0.0)) continue;
    volume += dot(triangle.a - centre, n);
    triangles_.push_back(triangle);
  }
  orientation_ = volume < 0.0 ? -1.0 : 1.0;
  nodes_.reserve(triangles_.size());
  if (!triangles_.empty()) build(0, static_cast<int>(triangles_.size()), stop);
}

void MeshDistance::summarise(Node& node, int first, int last) const {
  double area = 0.0;
  node.box = {triangles_[first].a, triangles_[first].a};
  for (int i = first; i < last; ++i) {
    const Triangle& t = triangles_[i];
    node.box.low = low_of(node.box.low, low_of(t.a, low_of(t.b, t.c)));
    node.box.high = high_of(node.box.high, high_of(t.a, high_of(t.b, t.c)));
    const Vec3 n = cross(t.b - t.a, t.c - t.a) * 0.5;
    node.dipole = node.dipole + n;
    node.centroid = node.centroid + (t.a + t.b + t.c) * (length(n) / 3.0);
    area += length(n);
  }
  node.centroid = node.centroid * (1.0 / area);
  const Vec3 reach = high_of(node.box.high - node.centroid, node.centroid - node.box.low);
  node.radius = length(reach);
}

int MeshDistance::build(int first, int last, const std::stop_token& stop) {
  const auto index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  summarise(node, first, last);
  node.first = first;
  if (last - first <= kLeaf || (last - first > kLookUp && stop.stop_requested())) {
    node.count = last - first;
  } else {
    const Vec3 size = node.box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int middle = (first + last) / 2;
    std::nth_element(triangles_.begin() + first,
                     triangles_.begin() + middle,
                     triangles_.begin() + last,
                     [axis](const Triangle& s, const Triangle& t) {
                       return component(s.a + s.b + s.c, axis) < component(t.a + t.b + t.c, axis);
                     });
    build(first, middle, stop);
    node.right = build(middle, last, stop);
  }
  nodes_[index] = node;
  return index;
}

double MeshDistance::unsigned_at(Vec3 point) const {
  double best = std::numeric_limits<double>::infinity();
  std::array<int, 64> stack{0};
  for (int top = 1; top > 0;) {
    const int index = stack[--top];
    const Node& node = nodes_[index];
    if (squared_distance(node.box, point) >= best) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[i];
      best = std::min(best, squared_distance_to_triangle(point, t.a, t.b, t.c));
    }
    if (node.count > 0) continue;
    const bool left_first = squared_distance(nodes_[index + 1].box, point) <
                            squared_distance(nodes_[node.right].box, point);
    stack[top++] = left_first ? node.right : index + 1;
    stack[top++] = left_first ? index + 1 : node.right;
  }
  return std::sqrt(best);
}

double MeshDistance::winding(Vec3 point) const {
  double angle = 0.0;
  std::array<int, 64> stack{0};
  for (int top = 1; top > 0;) {
    const int index = stack[--top];
    const Node& node = nodes_[index];
    const Vec3 to = node.centroid - point;
    const double far = length(to);
    if (far > kFar * node.radius) {
      angle += dot(node.dipole, to) / (far * far * far);
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[i];
      angle += solid_angle(t.a - point, t.b - point, t.c - point);
    }
    if (node.count > 0) continue;
    stack[top++] = node.right;
    stack[top++] = index + 1;
  }
  return orientation_ * angle / (4.0 * std::numbers::pi);
}

/// |w - 1/2| over how fast w changes, by central differences that stay clear of the triangles.
double MeshDistance::to_film(Vec3 point, double around, double clear) const {
  const double step = std::min(kStepOfClear * clear, kStepOfSize * length(bounds_.size()));
  if (!(step > 0.0)) return 0.0;
  const auto change = [&](Vec3 along) {
    return (winding(point + along * step) - winding(point - along * step)) / (2.0 * step);
  };
  const double slope =
      length({change({1.0, 0.0, 0.0}), change({0.0, 1.0, 0.0}), change({0.0, 0.0, 1.0})});
  return slope > 0.0 ? std::abs(around - 0.5) / slope : std::numeric_limits<double>::infinity();
}

double MeshDistance::at(Vec3 point) const {
  const double around = winding(point);
  double distance = unsigned_at(point);
  if (around > kOutside && around < 1.0 - kOutside) {
    distance = std::min(distance, to_film(point, around, distance));
  }
  return around > 0.5 ? -distance : distance;
}

}  // namespace opaline::render
