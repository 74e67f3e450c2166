#include "render/mesh/read_mesh.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <bit>
#include <cstring>
#include <string>

#include "base/files.h"
#include "tests/render/mesh_samples.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

template <class T>
void put(std::string& bytes, T value, bool swap = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof raw);
  if (swap) std::reverse(raw, raw + sizeof raw);
  bytes.append(raw, sizeof raw);
}

std::string cube_as_obj() {
  std::string text = "# a cube\no cube\n";
  for (const Vec3& p : cube_mesh(2.0).vertices) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const auto& t : cube_mesh(2.0).triangles)
    text += fmt::format("f {}/1/1 {}//2 {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

std::string cube_as_off() {
  const TriangleMesh cube = cube_mesh(2.0);
  std::string text = "OFF\n8 12 18  # a cube\n";
  for (const Vec3& p : cube.vertices) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  for (const auto& t : cube.triangles)
    text += fmt::format("3 {} {} {} 255 0 0\n", t[0], t[1], t[2]);
  return text;
}

std::string cube_as_ply(std::string_view format) {
  const TriangleMesh cube = cube_mesh(2.0);
  std::string text = fmt::format(
      "ply\nformat {} 1.0\ncomment a cube\nelement vertex 8\nproperty float x\nproperty float "
      "y\nproperty float z\n"
      "property uchar red\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n",
      format);
  const bool big = format == "binary_big_endian";
  const bool swap = big == (std::endian::native == std::endian::little);
  for (const Vec3& p : cube.vertices) {
    if (format == "ascii") {
      text += fmt::format("{} {} {} 7\n", p.x, p.y, p.z);
      continue;
    }
    for (const double x : {p.x, p.y, p.z}) put(text, static_cast<float>(x), swap);
    put(text, std::uint8_t{7});
  }
  for (const auto& t : cube.triangles) {
    if (format == "ascii") {
      text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
      continue;
    }
    put(text, std::uint8_t{3});
    for (const int v : t) put(text, v, swap);
  }
  return text;
}

std::string cube_as_stl(bool binary) {
  const TriangleMesh cube = cube_mesh(2.0);
  std::string text = binary ? std::string("solid but binary") : std::string("solid cube\n");
  if (binary) {
    text.resize(80);
    put(text, std::uint32_t{12});
  }
  for (const auto& t : cube.triangles) {
    if (binary)
      text.append(12, '\0');
    else
      text += "facet normal 0 0 0\n outer loop\n";
    for (const int v : t) {
      const Vec3 p = cube.vertices[v];
      if (!binary) text += fmt::format("  vertex {} {} {}\n", p.x, p.y, p.z);
      for (const double x : {p.x, p.y, p.z}) {
        if (binary) put(text, static_cast<float>(x));
      }
    }
    if (binary)
      text.append(2, '\0');
    else
      text += " endloop\nendfacet\n";
  }
  return text;
}

struct Sample {
  const char* format;
  std::string bytes;
};

std::vector<Sample> all_formats() {
  return {{"obj", cube_as_obj()},
          {"off", cube_as_off()},
          {"ply", cube_as_ply("ascii")},
          {"ply", cube_as_ply("binary_little_endian")},
          {"ply", cube_as_ply("binary_big_endian")},
          {"stl", cube_as_stl(true)},
          {"stl", cube_as_stl(false)}};
}

TEST(ReadMesh, ACubeIsTheSameSolidInEveryFormat) {
  for (const Sample& sample : all_formats()) {
    const auto mesh = decode_mesh(sample.format, sample.bytes);
    ASSERT_TRUE(mesh) << sample.format << ": " << mesh.error().message;
    const MeshTopology found = topology(*mesh);
    EXPECT_EQ(mesh->vertices.size(), 8U) << sample.format;
    EXPECT_TRUE(found.watertight()) << sample.format;
    EXPECT_EQ(found.genus, 0);
    EXPECT_DOUBLE_EQ(found.volume, 8.0) << sample.format;
    EXPECT_DOUBLE_EQ(found.area, 24.0) << sample.format;
  }
}

TEST(ReadMesh, AFileCutOffAnywhereIsAMeshOrAnErrorAndNeverMore) {
  for (const Sample& sample : all_formats()) {
    for (std::size_t size = 0; size < sample.bytes.size(); size += 3) {
      const auto mesh = decode_mesh(sample.format, sample.bytes.substr(0, size));
      if (mesh) {
        EXPECT_TRUE(validate(*mesh));
      } else {
        EXPECT_EQ(mesh.error().code, ErrorCode::kInvalidArgument);
        EXPECT_FALSE(mesh.error().message.empty());
      }
    }
  }
}

TEST(ReadMesh, PolygonsAndNegativeIndicesOfAnObjAreRead) {
  const auto mesh =
      decode_mesh("obj", "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf -4 -3 -2 -1\r\n");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->triangles.size(), 2U);
  EXPECT_DOUBLE_EQ(topology(*mesh).area, 1.0);
  EXPECT_EQ(topology(*mesh).open_edges, 4U);
}

TEST(ReadMesh, AnErrorNamesTheLine) {
  EXPECT_THAT(decode_mesh("obj", "v 0 0 0\nv 1 x 0\n").error().message,
              AllOf(HasSubstr("line 2"), HasSubstr("\"x\"")));
  EXPECT_THAT(decode_mesh("obj", "v 0 0 0\nf 1 0 1\n").error().message, HasSubstr("line 2"));
  EXPECT_THAT(decode_mesh("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 zero\n").error().message,
              HasSubstr("line 5"));
  EXPECT_THAT(decode_mesh("off", "OFF\n1000000000 1 0\n").error().message, HasSubstr("do not fit"));
  EXPECT_THAT(decode_mesh("ply", "ply\nformat ascii 1.0\nelement vertex many\n").error().message,
              HasSubstr("line 3"));
  const std::string ply = cube_as_ply("ascii");
  const auto changed = [&ply](std::string_view what, std::string_view to) {
    std::string text = ply;
    return decode_mesh("ply", text.replace(text.find(what), what.size(), to)).error().message;
  };
  EXPECT_THAT(changed("property float y\n", ""),
              HasSubstr("line 4: element vertex has no property y"));
  EXPECT_THAT(changed("property list uchar int vertex_indices\n", "property uchar red\n"),
              HasSubstr("line 9: element face has no property list vertex_indices"));
  EXPECT_THAT(changed(" 7\n", "\n"), HasSubstr("line 12: vertex 0 of 8 is damaged or cut off"));
  EXPECT_THAT(changed(" 7\n", " 7 7\n"),
              HasSubstr("line 12: vertex 0 of 8 is damaged or cut off: more numbers"));
  EXPECT_THAT(decode_mesh("stl", cube_as_stl(true).substr(0, 200)).error().message,
              HasSubstr("triangle 2 of 12"));
}

TEST(ReadMesh, WhatIsNoMeshIsRefusedWithTheReason) {
  EXPECT_THAT(decode_mesh("obj", "# nothing\n").error().message, HasSubstr("no triangles"));
  EXPECT_THAT(decode_mesh("obj", "v 0 0 0\nf 1 2 3\n").error().message,
              HasSubstr("line 2: names vertex 3 of 1"));
  EXPECT_THAT(decode_mesh("obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").error().message,
              HasSubstr("not finite"));
  EXPECT_THAT(decode_mesh("fbx", "").error().message, HasSubstr("obj, off, ply, stl"));
  EXPECT_EQ(read_mesh("no/such.obj").error().code, ErrorCode::kNotFound);
}

TEST(ReadMesh, AFileInCentimetresComesOutInMillimetres) {
  const opaline::testing::TemporaryDirectory directory;
  const auto path = directory.path() / "Cube.OBJ";
  ASSERT_TRUE(write_whole(system_files(), path, cube_as_obj()));
  const auto mesh = read_mesh(path, 10.0);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_DOUBLE_EQ(topology(*mesh).volume, 8000.0);
  EXPECT_THAT(read_mesh(path, 0.0).error().message, HasSubstr("expected > 0"));
}

TEST(Topology, HolesFlippedAndCrowdedEdgesAndPartsAreCounted) {
  TriangleMesh mesh = cube_mesh(1.0);
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(topology(mesh).flipped_edges, 3U);
  mesh = cube_mesh(1.0);
  mesh.triangles.pop_back();
  EXPECT_EQ(topology(mesh).open_edges, 3U);
  mesh = cube_mesh(1.0);
  mesh.triangles.push_back(mesh.triangles[0]);
  EXPECT_EQ(topology(mesh).crowded_edges, 3U);
  mesh = cube_mesh(1.0);
  append(mesh, cube_mesh(1.0, {5.0, 0.0, 0.0}));
  EXPECT_EQ(topology(mesh).components, 2);
  mesh.triangles.push_back({0, 0, 1});
  EXPECT_EQ(topology(mesh).degenerate_triangles, 1U);
}

TEST(ReadMesh, StopsWhenAskedInEveryFormat) {
  std::stop_source stop;
  stop.request_stop();
  std::string obj;
  std::string off = "OFF\n70000 1 0\n";
  for (int i = 0; i < 70'000; ++i) {
    obj += "v 0 0 0\n";
    off += "0 0 0\n";
  }
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
      "y\nproperty float z\nend_header\n0 0 0\n";
  std::string stl(84, '\0');
  stl[80] = 1;
  stl += std::string(50, '\0');
  for (const auto& [format, bytes] :
       {std::pair{"obj", obj}, {"off", off}, {"ply", ply}, {"stl", stl}}) {
    const auto mesh = decode_mesh(format, bytes, stop.get_token());
    ASSERT_FALSE(mesh) << format;
    EXPECT_EQ(mesh.error().code, ErrorCode::kCancelled) << format << ": " << mesh.error().message;
  }
}

}  // namespace
}  // namespace opaline::render
