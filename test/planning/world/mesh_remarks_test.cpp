// Extents, volume and warnings of meshes against boxes of known size.

#include "planning/world/mesh_remarks.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "planning/world/sdf.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

// A closed box about the origin, its triangles facing outwards.
TriangleMesh box(const Vector3d& size) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < 8; ++i) {
    const Vector3d sign((i & 1U) ? 0.5 : -0.5, (i & 2U) ? 0.5 : -0.5, (i & 4U) ? 0.5 : -0.5);
    mesh.vertices.push_back(size.cwiseProduct(sign));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(MeshFacts, OfAClosedBox) {
  TriangleMesh mesh = box({2, 3, 4});
  for (Vector3d& v : mesh.vertices) v += Vector3d(100, 200, -1);
  const MeshFacts facts = facts_of(mesh);
  EXPECT_EQ(facts.bounds.sizes(), Vector3d(2, 3, 4));
  EXPECT_EQ(facts.bounds.max().z(), 1.0);
  EXPECT_NEAR(facts.area_m2, 52.0, 1e-9);
  EXPECT_TRUE(facts.is_closed);
  EXPECT_NEAR(facts.volume_m3.value(), 24.0, 1e-9);
}

TEST(MeshFacts, ReportWhichWayTrianglesFaceAndWhetherOneIsMissing) {
  TriangleMesh inwards = box({2, 3, 4});
  for (auto& t : inwards.triangles) std::swap(t[1], t[2]);
  EXPECT_NEAR(facts_of(inwards).volume_m3.value(), -24.0, 1e-9);
  TriangleMesh mixed = box({2, 3, 4});
  std::swap(mixed.triangles[0][1], mixed.triangles[0][2]);
  EXPECT_FALSE(facts_of(mixed).is_closed);
  TriangleMesh open = box({2, 3, 4});
  open.triangles.pop_back();
  EXPECT_FALSE(facts_of(open).is_closed);
  EXPECT_FALSE(facts_of(open).volume_m3);
  EXPECT_FALSE(facts_of({}).is_closed);
}

struct Case {
  const char* name;
  Vector3d size;          // m, in the file
  std::string unit;       // <unit>
  std::string up_axis;    // <up_axis>
  std::string scale;      // scale in the map
  std::string pose;       // pose in the map
  std::string code;       // the one warning; empty for none
  std::string says = {};  // part of its message
};

// A COLLADA file of a box of that size.
std::string collada(const Case& each) {
  const TriangleMesh mesh = box(each.size);
  std::string points;
  std::string corners;
  for (const Vector3d& v : mesh.vertices) {
    points += fmt::format("{} {} {} ", v.x(), v.y(), v.z());
  }
  for (const auto& t : mesh.triangles) corners += fmt::format("{} {} {} ", t[0], t[1], t[2]);
  return "<?xml version='1.0'?>\n"
         "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>"
         "<asset><unit name='u' meter='" +
         each.unit + "'/><up_axis>" + each.up_axis +
         "</up_axis></asset><library_geometries><geometry id='g'><mesh><source id='p'>"
         "<float_array id='pa' count='24'>" +
         points +
         "</float_array><technique_common><accessor source='#pa' count='8' stride='3'>"
         "<param name='X' type='float'/><param name='Y' type='float'/>"
         "<param name='Z' type='float'/></accessor></technique_common></source>"
         "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
         "<triangles count='12'><input semantic='VERTEX' source='#v' offset='0'/><p>" +
         corners +
         "</p></triangles></mesh></geometry></library_geometries>"
         "<library_visual_scenes><visual_scene id='s'><node id='n'><instance_geometry url='#g'/>"
         "</node></visual_scene></library_visual_scenes>"
         "<scene><instance_visual_scene url='#s'/></scene></COLLADA>\n";
}

class MeshRemarks : public ::testing::TestWithParam<Case> {};

TEST_P(MeshRemarks, WarnAtTheUri) {
  std::string pattern = (std::filesystem::temp_directory_path() / "dive-remark-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(pattern.data());
  const Case& each = GetParam();
  std::ofstream(folder / "ship.dae") << collada(each);
  const std::string model =
      "<static>1</static><pose>" + each.pose +
      "</pose><link name='l'><collision name='c'><geometry>\n<mesh><uri>ship.dae</uri><scale>" +
      each.scale + "</scale></mesh></geometry></collision></link></model>";
  std::ofstream(folder / "map.sdf")
      << "<sdf version='1.6'><model name='m'>" << model << "<model name='n'>" << model << "</sdf>";
  Diagnostics diagnostics;
  const auto world = load_sdf((folder / "map.sdf").string(), diagnostics);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(world);
  EXPECT_EQ(world->surfaces.size(), 2U);
  if (each.code.empty()) {
    EXPECT_TRUE(diagnostics.list().empty()) << render(diagnostics.list()[0], false);
    return;
  }
  ASSERT_EQ(diagnostics.list().size(), 1U) << "once for each file";
  const Diagnostic& found = diagnostics.list()[0];
  EXPECT_EQ(found.code, each.code);
  EXPECT_EQ(found.severity, Severity::kWarning);
  EXPECT_EQ(found.span.line, 2);
  EXPECT_NE(found.message.find(each.says), std::string::npos) << found.message;
  EXPECT_NE(found.hint, "");
}

const Vector3d kShip(30, 8, 10);

INSTANTIATE_TEST_SUITE_P(
    All, MeshRemarks,
    ::testing::Values(
        Case{"sunk", kShip, "1", "Z_UP", "1 1 1", "0 0 -20 0 0 0.4", ""},
        Case{"on_its_side", kShip, "1", "Z_UP", "1 1 1", "0 0 -20 1.5708 0 0", ""},
        Case{"turned_upright", {30, 10, 8}, "1", "Y_UP", "1 1 1", "0 0 -20 1.5708 0 0", ""},
        Case{"in_centimetres", 100 * kShip, "0.01", "Z_UP", "1 1 1", "0 0 -20 0 0 0", ""},
        Case{"half_size", 200 * kShip, "0.01", "Z_UP", "0.5 0.5 0.5", "0 0 -20 0 0 0", ""},
        Case{"unit_applied_again", 10000 * kShip, "0.01", "Z_UP", "0.01 0.01 0.01", "0 0 -20 0 0 0",
             "MAP-MESH-UNIT", "0.01 m, which is applied when it is read; <scale> 0.01"},
        Case{"unit_undone", kShip, "0.01", "Z_UP", "100 100 100", "0 0 -20 0 0 0", "MAP-MESH-UNIT",
             "undoes it"},
        Case{"unit_disputed", 1000 * kShip, "1", "Z_UP", "0.001 0.001 0.001", "0 0 -20 0 0 0",
             "MAP-MESH-UNIT", "for millimetres"},
        Case{"y_up",
             {30, 10, 8},
             "1",
             "Y_UP",
             "1 1 1",
             "0 0 -20 0 0 0",
             "MAP-MESH-UP-AXIS",
             "90 degrees from the vertical"},
        Case{"rolled_over", kShip, "1", "Z_UP", "1 1 1", "0 0 -20 3.1416 0 0",
             "MAP-MESH-UPSIDE-DOWN", "its Z axis points down"},
        Case{"mirrored", kShip, "1", "Z_UP", "1 1 -1", "0 0 -20 0 0 0", "MAP-MESH-UPSIDE-DOWN"},
        Case{"turned_the_wrong_way",
             {30, 10, 8},
             "1",
             "Y_UP",
             "1 1 1",
             "0 0 -20 -1.5708 0 0",
             "MAP-MESH-UPSIDE-DOWN",
             "its Y axis points down"},
        Case{"wall_of_seabed",
             {100, 3, 100},
             "1",
             "Z_UP",
             "1 1 1",
             "0 0 -60 0 0 0",
             "MAP-MESH-ON-EDGE",
             "3.0 m thick"},
        Case{"depth_as_z", kShip, "1", "Z_UP", "1 1 1", "0 0 20 0 0 0", "MAP-MESH-ABOVE-SURFACE",
             "from z = 15.0 to 25.0 m"},
        Case{"deck_in_the_air", kShip, "1", "Z_UP", "1 1 1", "0 0 -3 0 0 0", "MAP-MESH-EMERGES",
             "reaches 2.0 m above the surface"},
        Case{"shore", {400, 300, 20}, "1", "Z_UP", "1 1 1", "0 0 -7 0 0 0", ""},
        Case{"centimetres_as_metres", 100 * kShip, "1", "Z_UP", "1 1 1", "0 0 -600 0 0 0",
             "MAP-MESH-LARGE", "1000 m high"},
        Case{"kilometres", 0.001 * kShip, "1", "Z_UP", "1 1 1", "0 0 -20 0 0 0", "MAP-MESH-SMALL",
             "0.03 x 0.008 x 0.01 m"}),
    [](const auto& each) { return std::string(each.param.name); });

}  // namespace
}  // namespace dive::planning
