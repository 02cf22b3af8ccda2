// A vertex far away is refused with its line in the file; an unused one is ignored.

#include "planning/world/mesh_extent.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "planning/world/sdf.h"

namespace dive::planning {
namespace {

class MeshExtent : public ::testing::Test {
 protected:
  MeshExtent() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dive-extent-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~MeshExtent() override { std::filesystem::remove_all(folder_); }

  // Diagnostics of the map reader for a mesh file with that content.
  [[nodiscard]] Diagnostics load(const std::string& name, const std::string& content,
                                 const std::string& scale = "1 1 1") const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    std::ofstream(folder_ / "map.sdf")
        << "<sdf version='1.6'><model name='m'><static>1</static><pose>0 0 -20 0 0 0</pose>\n"
           "<link name='l'><collision name='c'><geometry>\n<mesh><uri>"
        << name << "</uri><scale>" << scale
        << "</scale></mesh></geometry></collision></link></model></sdf>";
    Diagnostics diagnostics;
    const bool is_read = load_sdf((folder_ / "map.sdf").string(), diagnostics).has_value();
    EXPECT_EQ(is_read, diagnostics.ok());
    return diagnostics;
  }

  void expect_excess(const Diagnostics& diagnostics, const std::string& says) const {
    ASSERT_EQ(diagnostics.list().size(), 1U);
    const Diagnostic& found = diagnostics.list()[0];
    EXPECT_EQ(found.code, "MAP-EXTENT");
    EXPECT_EQ(found.span.line, 3);
    EXPECT_NE(found.message.find(says), std::string::npos) << found.message;
    EXPECT_NE(found.message.find("the limit is 10000 m"), std::string::npos) << found.message;
    EXPECT_NE(found.hint, "");
  }

  std::filesystem::path folder_;
};

const std::string kBox =
    "# four corners and a stray\nv 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nv 1 1000000 1\n"
    "f 1 2 3\nf 1 2 4\nf 1 3 4\n";

TEST_F(MeshExtent, NamesTheVertexAndLineOfAnObj) {
  expect_excess(load("a.obj", kBox + "f 2 3 5\n"), "vertex 5 (line 6) has y = 1e+06 m");
}

TEST_F(MeshExtent, AVertexThatNoTriangleUsesDoesNotMatter) {
  EXPECT_TRUE(load("a.obj", kBox).list().empty());
}

TEST_F(MeshExtent, NamesTheVertexAndLineOfAnAsciiStl) {
  expect_excess(load("a.stl",
                     "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                     "vertex 0 1e8 0\nendloop\nendfacet\nendsolid a\n"),
                "vertex 3 (line 6) has y = 1e+08 m");
}

TEST_F(MeshExtent, NamesTheTriangleOfABinaryStl) {
  std::string stl(80, ' ');
  const auto put = [&](const auto& value) {
    stl.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(std::uint32_t{2});
  for (const float far : {1.F, 2e4F}) {
    for (const float x : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, far, 0.F}) put(x);
    put(std::uint16_t{0});
  }
  expect_excess(load("a.stl", stl), "a vertex of triangle 2 has y = 20000 m");
}

TEST_F(MeshExtent, NamesTheLineOfACollada) {
  const std::string dae =
      "<?xml version='1.0'?>\n"
      "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\n"
      "<asset><unit name='meter' meter='1'/><up_axis>Z_UP</up_axis></asset>\n"
      "<library_geometries><geometry id='g'><mesh><source id='p'>\n"
      "<float_array id='pa' count='9'>0 0 0\n"
      "1 0 0\n"
      "0 1 54321</float_array>\n"
      "<technique_common><accessor source='#pa' count='3' stride='3'>"
      "<param name='X' type='float'/><param name='Y' type='float'/><param name='Z' type='float'/>"
      "</accessor></technique_common></source>"
      "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
      "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2</p>"
      "</triangles></mesh></geometry></library_geometries>"
      "<library_visual_scenes><visual_scene id='s'><node id='n'><instance_geometry url='#g'/>"
      "</node></visual_scene></library_visual_scenes>"
      "<scene><instance_visual_scene url='#s'/></scene></COLLADA>\n";
  expect_excess(load("a.dae", dae), "a vertex of triangle 1 (line 7) has z = 54321 m");
}

TEST_F(MeshExtent, IsThatOfTheScaledMesh) {
  const std::string millimetres = "v 0 0 0\nv 20000 0 0\nv 0 30000 0\nf 1 2 3\n";
  EXPECT_TRUE(load("a.obj", millimetres, "0.001 0.001 0.001").list().empty());
  const Diagnostics diagnostics = load("a.obj", millimetres);
  expect_excess(diagnostics, "vertex 2 (line 2) has x = 20000 m");
  EXPECT_NE(diagnostics.list()[0].hint.find("0.001"), std::string::npos);
}

}  // namespace
}  // namespace dive::planning
