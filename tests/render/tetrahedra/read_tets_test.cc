#include "render/tetrahedra/read_tets.h"

#include <gmock/gmock.h>

namespace opaline::render {
namespace {

using ::testing::HasSubstr;

/// Two tetrahedra at the face (b, c, d), the second told the other way round.
const TetMesh kPair{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}},
                    {{0, 1, 2, 3}, {1, 2, 3, 4}}};

TEST(ReadTets, FindsTheSameInEveryFormat) {
  const std::string medit =
      "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n1 1 1 "
      "7\n"
      "Triangles\n1\n1 2 3 5\nTetrahedra\n2\n1 2 3 4 0\n2 3 5 4 0\nEnd\n";
  const std::string gmsh2 =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n10 0 0 0\n11 1 0 0\n12 0 1 0\n13 0 0 1\n20 "
      "1 1 1\n$EndNodes\n"
      "$Elements\n3\n1 2 2 0 1 10 11 12\n2 4 2 0 1 10 11 12 13\n3 4 0 11 12 20 13\n$EndElements\n";
  const std::string gmsh4 =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 5 1 5\n0 1 0 1\n1\n0 0 0\n3 1 0 "
      "4\n2\n3\n4\n5\n1 0 0\n0 1 0\n0 0 1\n"
      "1 1 1\n$EndNodes\n$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 2\n2 1 2 3 4\n3 2 3 5 "
      "4\n$EndElements\n";
  const std::string vtk =
      "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0 1 "
      "0 0 0 1 0\n0 0 1 1 1 1\n"
      "CELLS 3 14\n4 0 1 2 3\n3 0 1 2\n4 1 2 4 3\nCELL_TYPES 3\n10\n5\n10\nPOINT_DATA 5\n";
  for (const auto& [format, text] : {std::pair{"mesh", medit},
                                     std::pair{"msh", gmsh2},
                                     std::pair{"msh", gmsh4},
                                     std::pair{"vtk", vtk}}) {
    const auto mesh = decode_tets(format, text);
    ASSERT_TRUE(mesh) << format << ": " << mesh.error().message;
    EXPECT_EQ(mesh->vertices, kPair.vertices) << format;
    ASSERT_EQ(mesh->tets.size(), 2U) << format;
    EXPECT_NEAR(volume_of(*mesh, 0), 1.0 / 6.0, 1e-12);
    EXPECT_NEAR(volume_of(*mesh, 1), 1.0 / 3.0, 1e-12);
    EXPECT_EQ(surface_of(*mesh).size(), 6U) << format;
  }
}

TEST(ReadTets, NamesTheLineOfWhatItDoesNotUnderstand) {
  EXPECT_THAT(decode_tets("mesh", "Vertices\n2\n0 0 0 0\n1 x 0 0\n").error().message,
              HasSubstr("line 4: expected a coordinate"));
  EXPECT_THAT(decode_tets("mesh", "Vertices\n99999999999\n").error().message,
              HasSubstr("do not fit"));
  EXPECT_THAT(decode_tets("msh", "$MeshFormat\n2.2 1 8\n").error().message,
              HasSubstr("binary file"));
  EXPECT_THAT(decode_tets("msh", "$Elements\n1\n1 4 0 1 2 3 4\n").error().message,
              HasSubstr("no node 1"));
  EXPECT_THAT(decode_tets("vtk", "# vtk\nBINARY\n").error().message,
              HasSubstr("write it as ASCII"));
  EXPECT_THAT(decode_tets("vtk", "CELLS 2 8\nOFFSETS vtktypeint64\n").error().message,
              HasSubstr("version 4.2"));
  EXPECT_THAT(decode_tets("mesh", "").error().message, HasSubstr("no tetrahedra"));
  EXPECT_THAT(decode_tets("mesh", "Vertices 1 0 0 0 0\nTetrahedra 1\n1 2 3 4 0\n").error().message,
              HasSubstr("line 3: names vertex 4 of 1"));
  EXPECT_THAT(decode_tets("mesh", "Tetrahedra 2\n1 2 3 4 0\n1 2 0 4 0\n").error().message,
              HasSubstr("line 3: a vertex number below 1"));
  EXPECT_THAT(decode_tets("obj", "").error().message, HasSubstr("there are mesh, msh, vtk"));
}

}  // namespace
}  // namespace opaline::render
