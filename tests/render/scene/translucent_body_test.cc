#include "render/scene/translucent_body.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "render/graph/nearest.h"
#include "render/mesh/mesh_distance.h"
#include "render/mesh/shapes.h"
#include "render/tetrahedra/stuffing.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;
using Values = std::vector<std::array<float, 3>>;

ObjectOptions torus() {
  ObjectOptions object;
  object.name = "ring";
  object.shape.name = "torus";
  object.shape.size_mm = 20.0;
  object.material.absorption = {0.01, 0.03, 0.1};
  object.material.edit_cells = 40;
  return object;
}

DeformOptions bow(double move) {
  DeformOptions deform;
  deform.kind = DeformOptions::Kind::kCage;
  deform.handles = {{.point = {0, -1, -1}, .move = {0.0, 0.0, move}},
                    {.point = {2, -1, -1}, .move = {0.0, 0.0, move}}};
  return deform;
}

std::string box_obj(Vec3 low, Vec3 high, int before) {
  std::string text;
  for (int k = 0; k < 8; ++k) {
    text += fmt::format("v {} {} {}\n",
                        (k & 1) != 0 ? high.x : low.x,
                        (k & 2) != 0 ? high.y : low.y,
                        (k & 4) != 0 ? high.z : low.z);
  }
  for (const auto& f : {std::array{1, 3, 4, 2},
                        std::array{5, 6, 8, 7},
                        std::array{1, 2, 6, 5},
                        std::array{3, 7, 8, 4},
                        std::array{1, 5, 7, 3},
                        std::array{2, 4, 8, 6}}) {
    text +=
        fmt::format("f {} {} {} {}\n", f[0] + before, f[1] + before, f[2] + before, f[3] + before);
  }
  return text;
}

Values light_from_above(const Subsurface& body) {
  Values q;
  for (const auto& place : body.places()) {
    q.emplace_back().fill(static_cast<float>(std::max(0.0, place.normal.z)));
  }
  return q;
}

double difference(const Values& a, const Values& b) {
  double error = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      error += std::pow(a[i][c] - b[i][c], 2);
      size += std::pow(b[i][c], 2);
    }
  }
  return std::sqrt(error / size);
}

class Body : public ::testing::Test {
 protected:
  std::unique_ptr<TranslucentBody> made(const ObjectOptions& object,
                                        const DiffusionOptions& diffusion) {
    auto body = TranslucentBody::create(object, diffusion, 0, team_, {});
    EXPECT_TRUE(body) << body.error().message;
    return *std::move(body);
  }
  int solve(TranslucentBody& body) {
    Subsurface& light = body.subsurface();
    const auto solved = light.light(light_from_above(light), {}, {});
    EXPECT_TRUE(solved) << solved.error().message;
    return solved->iterations;
  }
  /// Of the fluence: the bent surface as triangles, its signed distance, other tetrahedra.
  double error_against_a_mesh_of_the_bent_shape(double tetrahedra, Discretisation method);

  ThreadTeam team_{2};
  testing::TemporaryDirectory directory_;
};

double Body::error_against_a_mesh_of_the_bent_shape(double tetrahedra, Discretisation method) {
  const DiffusionOptions diffusion{.method = method, .directions = 0, .tetrahedra = tetrahedra};
  const auto body = made(torus(), diffusion);
  EXPECT_TRUE(body->bend(bow(5.0)));
  solve(*body);
  const auto solid = make_shape("torus", 20.0);
  TriangleMesh surface =
      surface_mesh(*stuff(**solid, {.spacing_mm = 0.45, .interior_growth = 1.0}, {}));
  const auto deformation = make_deformation(bow(5.0), bounds(surface), {});
  for (Vec3& p : surface.vertices) p = (*deformation)->at(p);
  const auto bent = MeshDistance::create(surface);
  Optics optics;
  for (int c = 0; c < 3; ++c) {
    optics.absorption[c] = torus().material.absorption[c];
    optics.diffusion[c] = 1.0 / (3.0 * (optics.absorption[c] + 1.0));
  }
  const auto other =
      Subsurface::create(**bent, [&](Vec3) { return optics; }, 1.3, diffusion, team_, {});
  EXPECT_TRUE(other && (*other)->light(light_from_above(**other), {}, {}));
  const auto from =
      nearest_interpolation((*other)->surface().vertices, body->subsurface().surface().vertices, 4);
  Values expected(body->subsurface().surface().vertices.size());
  for (int v = 0; v < from.rows(); ++v) {
    for (int e = from.starts[v]; e < from.starts[v + 1]; ++e) {
      for (int c = 0; c < 3; ++c) {
        expected[v][c] += from.weights[e] * (*other)->lit().fluence[from.columns[e]][c];
      }
    }
  }
  return difference(body->subsurface().lit().fluence, expected);
}

// Two meshes of one shape differ by their own errors and by what interpolation between them adds. Those of elements fall with
// the square of their size (3.5 % at 8 k, 2.0 % at 20 k: docs/rendering.md), and so do those of the graph since its links that
// lean are corrected (3.8 % and 2.2 %; before, they stayed at 4 to 5 %). The bend itself changes the light by 8 %.
TEST_F(Body, BentShinesAsAMeshMadeOfTheBentShape) {
  EXPECT_LT(error_against_a_mesh_of_the_bent_shape(8e3, Discretisation::kElements), 0.045);
  EXPECT_LT(error_against_a_mesh_of_the_bent_shape(8e3, Discretisation::kGraph), 0.045);
}

TEST_F(Body, BentAndStraightenedShinesAsBefore) {
  const auto body = made(torus(), {.tetrahedra = 5e3, .tolerance = 1e-8});
  solve(*body);
  const Values before = body->subsurface().lit().fluence;
  ASSERT_TRUE(body->bend(bow(5.0)));
  solve(*body);
  EXPECT_GT(difference(body->subsurface().lit().fluence, before), 0.07);
  DeformOptions none = bow(5.0);
  none.amount = 0.0;
  ASSERT_TRUE(body->bend(none));
  solve(*body);
  EXPECT_LT(difference(body->subsurface().lit().fluence, before), 1e-6);
}

TEST_F(Body, TurnedInsideOutIsRefusedWithHowManyAndKeepsItsShape) {
  const auto body = made(torus(), {.tetrahedra = 5e3});
  DeformOptions folded;
  folded.kind = DeformOptions::Kind::kCage;
  folded.points = {2, 2, 2};
  folded.handles = {{.point = {0, -1, -1}, .move = {30.0, 0.0, 0.0}}};  // through the other side
  const auto mesh = body->subsurface().surface();
  const auto refused = body->bend(folded);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("tetrahedra are turned inside out"));
  EXPECT_EQ(body->subsurface().surface(), mesh);
  EXPECT_TRUE(body->marks().empty());
}

TEST_F(Body, TurnedInsideOutIsMarkedWhereAskedFor) {
  const auto body = made(torus(), {.tetrahedra = 5e3});
  DeformOptions dented;
  dented.kind = DeformOptions::Kind::kCage;
  dented.inverted = DeformOptions::Inverted::kMark;
  dented.handles = {{.point = {2, 1, 1}, .move = {-120.0, 0.0, 0.0}}};
  const auto inverted = body->bend(dented);
  ASSERT_TRUE(inverted) << inverted.error().message;
  EXPECT_GT(*inverted, 0U);
  ASSERT_EQ(body->marks().size(), body->drawn().mesh().vertices.size());
  EXPECT_EQ(std::ranges::max(body->marks()), 1.0F);
  EXPECT_EQ(std::ranges::min(body->marks()), 0.0F);
  ASSERT_TRUE(body->bend(bow(1.0)));
  EXPECT_TRUE(body->marks().empty());
}

TEST_F(Body, SaysWhereElementsAreTooLargeForAThinLimb) {
  const opaline::testing::TemporaryDirectory directory;
  const auto file = directory.path() / "limb.obj";
  std::ofstream(file) << box_obj({-5, -5, -5}, {5, 5, 5}, 0)
                      << box_obj({4, -0.05, -0.05}, {30, 0.05, 0.05}, 8);
  ObjectOptions object = torus();
  object.shape.name.clear();
  object.shape.size_mm = 0.0;
  object.shape.file = file;
  EXPECT_THAT(made(object, {.tetrahedra = 3000})->notes(),
              ::testing::Contains(HasSubstr("of its surface is not there")));
  std::ofstream(file) << box_obj({-5, -5, -5}, {5, 5, 5}, 0);
  EXPECT_THAT(made(object, {.tetrahedra = 3000})->notes(), ::testing::IsEmpty());
}

TEST_F(Body, OnALatticeIsNotBent) {
  const auto body = made(torus(), {.method = Discretisation::kPolygrid, .tetrahedra = 5e3});
  EXPECT_THAT(body->bend(bow(1.0)).error().message, HasSubstr("a lattice cannot bend"));
}

TEST_F(Body, OfATetrahedralFileShinesAsTheSameShapeCutHere) {
  const auto cut = made(torus(), {.tetrahedra = 5e3, .tolerance = 1e-7});
  solve(*cut);
  const auto solid = make_shape("torus", 20.0);
  const TetMesh mesh = *stuff(
      **solid, {.spacing_mm = cut->subsurface().report().spacing_mm, .interior_growth = 0.1}, {});
  ObjectOptions from_file = torus();
  from_file.shape.name.clear();
  from_file.shape.file = directory_.path() / "torus.mesh";
  from_file.shape.unit_mm = 10.0;
  std::ofstream file(from_file.shape.file);
  file.precision(17);
  file << "MeshVersionFormatted 2 Dimension 3\nVertices " << mesh.vertices.size() << '\n';
  for (const Vec3& p : mesh.vertices)
    file << 0.1 * p.x << ' ' << 0.1 * p.y << ' ' << 0.1 * p.z << " 0\n";
  file << "Tetrahedra " << mesh.tets.size() << '\n';
  for (const auto& [a, b, c, d] : mesh.tets) {
    file << a + 1 << ' ' << b + 1 << ' ' << d + 1 << ' ' << c + 1 << " 0\n";  // turned
  }
  file << "End\n";
  file.close();
  const auto read = made(from_file, {.tolerance = 1e-7});
  EXPECT_EQ(read->subsurface().report().tetrahedra, mesh.tets.size());
  EXPECT_NEAR(
      read->subsurface().report().spacing_mm / cut->subsurface().report().spacing_mm, 1.0, 0.1);
  const Subsurface& theirs = read->subsurface();
  ASSERT_EQ(theirs.surface().vertices.size(), cut->subsurface().surface().vertices.size());
  Values q =
      light_from_above(cut->subsurface());  // of the true surface, as the other's facets are not
  ASSERT_TRUE(read->subsurface().light(q, {}, {}));
  EXPECT_LT(difference(theirs.lit().fluence, cut->subsurface().lit().fluence), 1e-5);
}

EditOptions dark_spot() {
  EditOptions edit;
  edit.operation = EditOptions::Operation::kScale;
  edit.value = {6.0, 4.0, 2.0};
  edit.centre = {7.5, 0.0, 1.5};
  edit.radius_mm = 3.0;
  return edit;
}

TEST_F(Body, PaintedShinesAsOneMadeOfTheSavedMaterial) {
  for (const Discretisation method :
       {Discretisation::kElements, Discretisation::kGraph, Discretisation::kPolygrid}) {
    const DiffusionOptions diffusion{
        .method = method, .tetrahedra = 5e3, .tolerance = 1e-7, .corrections = 100};
    const auto body = made(torus(), diffusion);
    solve(*body);
    const Values before = body->subsurface().lit().fluence;
    ASSERT_TRUE(body->edit({dark_spot()}));
    solve(*body);
    EXPECT_GT(difference(body->subsurface().lit().fluence, before), 0.01);
    ObjectOptions again = torus();
    again.material.file = directory_.path() / "painted.vdb";
    const auto origin = body->save(system_files(), again.material.file, "test");
    ASSERT_TRUE(origin) << origin.error().message;
    again.material.origin = *origin;
    const auto other = made(again, diffusion);
    solve(*other);
    EXPECT_LT(difference(body->subsurface().lit().fluence, other->subsurface().lit().fluence),
              1e-5);
    ASSERT_TRUE(*body->undo());
    solve(*body);
    EXPECT_LT(difference(body->subsurface().lit().fluence, before), 1e-5);
    ASSERT_TRUE(*body->redo());
    solve(*body);
    EXPECT_LT(difference(body->subsurface().lit().fluence, other->subsurface().lit().fluence),
              1e-5);
    EXPECT_FALSE(*body->redo());
  }
}

TEST_F(Body, PaintedStartsFromTheLightItHad) {
  const auto body = made(torus(), {.tetrahedra = 2e4, .tolerance = 1e-3});
  const int cold = solve(*body);
  EditOptions touch = dark_spot();
  touch.value = {1.1, 1.1, 1.1};
  int warm = 0;
  for (int k = 0; k < 8; ++k) {
    touch.centre = {7.5 * std::cos(0.1 * k), 7.5 * std::sin(0.1 * k), 1.5};
    ASSERT_TRUE(body->edit({touch}));
    warm += solve(*body);
  }
  EXPECT_LE(3 * warm, 8 * cold) << warm << " iterations in 8 strokes, " << cold << " from nothing";
}

}  // namespace
}  // namespace opaline::render
