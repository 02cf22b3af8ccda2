#include "planning/world/sdf.h"

#include <algorithm>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "test/common/sanitizers.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

std::optional<World> parse(const std::string& text, Diagnostics& diagnostics) {
  MeshFiles meshes("map.sdf");
  return parse_sdf(SourceText("map.sdf", text), diagnostics, meshes);
}

// One static model on lines 2 to 6, with `inside` on line 5.
std::string collision(const std::string& inside) {
  return "<sdf version='1.6'><world name='w'>\n"
         "<model name='m'><static>true</static>\n"
         "<link name='l'>\n"
         "<collision name='c'>\n" +
         inside +
         "\n</collision></link></model>\n"
         "</world></sdf>\n";
}

std::string geometry(const std::string& shape) {
  return collision("<geometry>" + shape + "</geometry>");
}

template <class S>
S only_shape(const std::string& text) {
  Diagnostics diagnostics;
  const auto world = parse(text, diagnostics);
  for (const Diagnostic& d : diagnostics.list()) ADD_FAILURE() << render(d, false);
  if (!world || world->obstacles.size() != 1 ||
      !std::holds_alternative<S>(world->obstacles[0].shape)) {
    ADD_FAILURE() << "not one shape of the expected kind:\n" << text;
    return {};
  }
  return std::get<S>(world->obstacles[0].shape);
}

// The origin of a world whose <spherical_coordinates> hold `inside`, and the codes of what is
// reported.
std::pair<std::optional<GeoPoint>, std::string> origin(const std::string& inside) {
  Diagnostics diagnostics;
  const SourceText source("map.sdf", "<sdf version='1.6'><world name='w'><spherical_coordinates>" +
                                         inside + "</spherical_coordinates></world></sdf>\n");
  const auto found = sdf_origin(source, diagnostics);
  std::string codes;
  for (const Diagnostic& d : diagnostics.list()) codes += d.code;
  return {found, codes};
}

TEST(SdfOrigin, IsThePlaceThatTheWorldStates) {
  const std::string place =
      "<latitude_deg>44.65</latitude_deg><longitude_deg>-63.57</longitude_deg>";
  const auto [found, codes] = origin(
      "<surface_model>EARTH_WGS84</surface_model><elevation>12</elevation>"
      "<heading_deg>0</heading_deg>" +
      place);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->latitude_deg, 44.65);
  EXPECT_EQ(found->longitude_deg, -63.57);
  EXPECT_EQ(codes, "");
  for (const char* other :
       {"<surface_model>MOON_SCS</surface_model>", "<heading_deg>90</heading_deg>",
        "<world_frame_orientation>NED</world_frame_orientation>"}) {
    const auto [none, warning] = origin(other + place);
    EXPECT_FALSE(none) << other;
    EXPECT_EQ(warning, "MAP-ORIGIN") << other;
  }
  for (const char* wrong : {"<latitude_deg>44.65</latitude_deg>",
                            "<latitude_deg>94</latitude_deg><longitude_deg>0</longitude_deg>",
                            "<latitude_deg>N44</latitude_deg><longitude_deg>0</longitude_deg>"}) {
    const auto [none, error] = origin(wrong);
    EXPECT_FALSE(none) << wrong;
    EXPECT_EQ(error, "MAP-NUMBER") << wrong;
  }
}

TEST(ParseSdf, ReadsEveryPrimitive) {
  EXPECT_EQ(only_shape<Box>(geometry("<box><size>1 2 3</size></box>")).size, Vector3d(1, 2, 3));
  const auto cylinder =
      only_shape<Cylinder>(geometry("<cylinder><radius>0.5</radius><length>2</length></cylinder>"));
  EXPECT_EQ(cylinder.radius, 0.5);
  EXPECT_EQ(cylinder.length, 2.0);
  EXPECT_EQ(only_shape<Sphere>(geometry("<sphere><radius>7</radius></sphere>")).radius, 7.0);
  const auto capsule =
      only_shape<Capsule>(geometry("<capsule><length>3</length><radius>0.25</radius></capsule>"));
  EXPECT_EQ(capsule.radius, 0.25);
  EXPECT_EQ(capsule.length, 3.0);
  EXPECT_EQ(only_shape<Ellipsoid>(geometry("<ellipsoid><radii>1 2 3</radii></ellipsoid>")).radii,
            Vector3d(1, 2, 3));
  EXPECT_EQ(only_shape<HalfSpace>(geometry("<plane><normal>0 3 4</normal></plane>")).normal,
            Vector3d(0, 0.6, 0.8));
  EXPECT_EQ(only_shape<HalfSpace>(geometry("<plane><size>10 10</size></plane>")).normal,
            Vector3d::UnitZ());
}

TEST(ParseSdf, ComposesPosesDownTheTreeAndNamesThePath) {
  Diagnostics diagnostics;
  const auto world = parse(R"(<sdf version="1.9"><world name="w">
    <model name="wreck"><static>1</static><pose>10 0 -5 0 0 1.5707963267948966</pose>
      <model name="deck"><pose degrees="true">1 0 0 0 0 90</pose>
        <link name="hatch"><pose>0 2 0 0 0 0</pose>
          <visual name="v"><geometry><mesh><uri>x.dae</uri></mesh></geometry></visual>
          <collision name="rim"><pose>0 0 1 0 0 0</pose>
            <geometry><sphere><radius>1</radius></sphere></geometry></collision>
        </link></model></model></world></sdf>)",
                           diagnostics);
  ASSERT_TRUE(world);
  ASSERT_EQ(world->obstacles.size(), 1U);
  const Obstacle& rim = world->obstacles[0];
  EXPECT_EQ(rim.name, "wreck/deck/hatch/rim");
  // wreck turns +90 degrees, deck another 90: deck's x is W's y, the hatch's y is W's -y.
  EXPECT_LT((rim.X_WO.p - Vector3d(10.0, 1.0 - 2.0, -4.0)).norm(), 1e-12);
  EXPECT_LT((rim.X_WO.q * Vector3d::UnitX() + Vector3d::UnitX()).norm(), 1e-12);
}

TEST(ParseSdf, TakesRollPitchYawAsFixedAxes) {
  Diagnostics diagnostics;
  const auto world = parse(collision("<pose>0 0 0 0.3 -0.4 1.2</pose><geometry><sphere>"
                                     "<radius>1</radius></sphere></geometry>"),
                           diagnostics);
  ASSERT_TRUE(world);
  const Eigen::Matrix3d expected =
      (Eigen::AngleAxisd(1.2, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.4, Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.3, Vector3d::UnitX()))
          .toRotationMatrix();
  EXPECT_LT((world->obstacles[0].X_WO.q.toRotationMatrix() - expected).norm(), 1e-12);
}

TEST(ParseSdf, TakesAModelWithoutAWorldAndTheSun) {
  Diagnostics diagnostics;
  const auto world = parse(
      "<sdf version='1.5'><include><uri>model://sun</uri></include>"
      "<model name='m'><static>true</static><link name='l'><collision name='c'><geometry><box>"
      "<size>1 1 1</size></box></geometry></collision></link></model></sdf>",
      diagnostics);
  ASSERT_TRUE(world);
  EXPECT_EQ(world->obstacles.size(), 1U);
  EXPECT_TRUE(diagnostics.list().empty());
}

TEST(ParseSdf, KeepsAMovableModelWithAWarning) {
  Diagnostics diagnostics;
  const auto world = parse(
      "<sdf version='1.5'><model name='m'>\n<link name='l'><collision name='c'><geometry><box>"
      "<size>1 1 1</size></box></geometry></collision></link></model></sdf>",
      diagnostics);
  ASSERT_TRUE(world);
  EXPECT_EQ(world->obstacles.size(), 1U);
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "MAP-MOVABLE");
  EXPECT_EQ(diagnostics.list()[0].severity, Severity::kWarning);
}

struct Refusal {
  const char* name;
  std::string text;
  const char* code;
  int line;
  const char* in_message_or_hint;
};

class RefusedSdf : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusedSdf, IsRefusedWhereItIsWrong) {
  const Refusal& expected = GetParam();
  Diagnostics diagnostics;
  EXPECT_FALSE(parse(expected.text, diagnostics));
  ASSERT_EQ(diagnostics.error_count(), 1U);
  const auto error = std::find_if(diagnostics.list().begin(), diagnostics.list().end(),
                                  [](const auto& d) { return d.severity == Severity::kError; });
  EXPECT_EQ(error->code, expected.code);
  EXPECT_EQ(error->span.line, expected.line);
  EXPECT_NE((error->message + error->hint).find(expected.in_message_or_hint), std::string::npos)
      << render(*error, false);
}

std::string model_with(const std::string& inside) {
  return "<sdf version='1.6'>\n<model name='m'><static>true</static>\n" + inside +
         "\n</model></sdf>";
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedSdf,
    ::testing::Values(
        Refusal{"not_sdf", "<urdf/>", "MAP-ROOT", 1, "<urdf>"},
        Refusal{"no_version", "<sdf/>", "MAP-VERSION", 1, "version"},
        Refusal{"old_version", "<sdf version='1.2'/>", "MAP-VERSION", 1, "1.2"},
        Refusal{"two_worlds", "<sdf version='1.6'><world name='a'/>\n<world name='b'/></sdf>",
                "MAP-WORLDS", 2, "one <world>"},
        Refusal{"misspelt_shape", geometry("<cilinder/>"), "MAP-GEOMETRY", 5, "<cylinder>"},
        Refusal{"no_uri", geometry("<mesh/>"), "MAP-MISSING", 5, "<uri>"},
        Refusal{"no_mesh", geometry("<mesh><uri>model://a/b.dae</uri></mesh>"), "MAP-MESH", 5,
                "was not found as a/b.dae, nor as"},
        Refusal{"far_mesh", geometry("<mesh><uri>https://a/b.dae</uri></mesh>"), "MAP-MESH", 5,
                "beside the map"},
        Refusal{"no_scale", geometry("<mesh><uri>a.dae</uri><scale>1 0 1</scale></mesh>"),
                "MAP-SIZE", 5, "zero"},
        Refusal{"submesh", geometry("<mesh><uri>a.dae</uri><submesh/></mesh>"), "MAP-UNSUPPORTED",
                5, "<submesh>"},
        Refusal{"heightmap", geometry("<heightmap/>"), "MAP-UNSUPPORTED", 5, "<heightmap>"},
        Refusal{"polyline", geometry("<polyline/>"), "MAP-UNSUPPORTED", 5, "<polyline>"},
        Refusal{"two_shapes", geometry("<box><size>1 1 1</size></box><sphere/>"), "MAP-GEOMETRY", 5,
                "exactly one"},
        Refusal{"no_shape", geometry(""), "MAP-GEOMETRY", 5, "exactly one"},
        Refusal{"no_geometry", collision(""), "MAP-MISSING", 4, "<geometry>"},
        Refusal{"no_size", geometry("<box/>"), "MAP-MISSING", 5, "<size>"},
        Refusal{"no_length", geometry("<cylinder><radius>1</radius></cylinder>"), "MAP-MISSING", 5,
                "<length>"},
        Refusal{"two_numbers", geometry("<box><size>1 2</size></box>"), "MAP-NUMBER", 5, "1 2"},
        Refusal{"nan", geometry("<box><size>1 2 nan</size></box>"), "MAP-NUMBER", 5, "nan"},
        Refusal{"inf", geometry("<sphere><radius>inf</radius></sphere>"), "MAP-NUMBER", 5, "inf"},
        Refusal{"far", geometry("<sphere><radius>1e9</radius></sphere>"), "MAP-NUMBER", 5,
                "1000000"},
        Refusal{"negative", geometry("<box><size>1 -2 3</size></box>"), "MAP-SIZE", 5, "greater"},
        Refusal{"zero", geometry("<sphere><radius>0</radius></sphere>"), "MAP-SIZE", 5, "greater"},
        Refusal{"no_normal", geometry("<plane><normal>0 0 0</normal></plane>"), "MAP-SIZE", 5,
                "zero"},
        Refusal{"pose_of_five", model_with("<pose>1 2 3 4 5</pose>"), "MAP-NUMBER", 3, "6"},
        Refusal{"relative_to", model_with("<pose relative_to='x'>1 2 3 0 0 0</pose>"), "MAP-FRAME",
                3, "relative_to"},
        Refusal{"quaternion", model_with("<pose rotation_format='quat_xyzw'>0 0 0 0 0 0 1</pose>"),
                "MAP-FRAME", 3, "quat_xyzw"},
        Refusal{"degrees", model_with("<pose degrees='yes'>1 2 3 0 0 90</pose>"), "MAP-FRAME", 3,
                "degrees"},
        Refusal{"placement_frame",
                "<sdf version='1.8'>\n<model name='m' placement_frame='l'><static>1</static>"
                "</model></sdf>",
                "MAP-FRAME", 2, "placement_frame"},
        Refusal{"include", model_with("<include><uri>model://wall</uri></include>"),
                "MAP-UNSUPPORTED", 3, "<include>"},
        Refusal{"state",
                "<sdf version='1.6'><world name='w'>\n<state><model name='m'/></state>"
                "</world></sdf>",
                "MAP-UNSUPPORTED", 2, "<state>"},
        Refusal{"population", model_with("<population name='p'/>"), "MAP-UNSUPPORTED", 3,
                "<population>"},
        Refusal{"no_name", model_with("<link/>"), "MAP-MISSING", 3, "name"},
        Refusal{"doctype", "<!DOCTYPE sdf []>\n<sdf version='1.6'/>", "XML-DOCTYPE", 1, ""}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(LoadSdf, ReportsAMissingFile) {
  Diagnostics diagnostics;
  EXPECT_FALSE(load_sdf(DIVE_SOURCE_DIR "/missions/maps/atlantis.sdf", diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "FILE-UNREADABLE");
}

// Worlds and models that other people made: each is read, or refused with a place and a reason.
TEST(LoadSdf, ReadsOrRefusesRealFiles) {
  DIVE_SKIP_UNDER_SANITIZERS("large meshes, and small ones take the same steps");
  const std::string data = DIVE_SHARED_DATA;
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "the shared data is not here";
  int read = 0;
  int refused = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".sdf" && extension != ".world" && extension != ".scn") continue;
    Diagnostics diagnostics;
    MeshFiles meshes(entry.path().string(), Resources::kInFolder, {}, MeshFiles::Keep::kNothing);
    auto source = read_source_text(entry.path().string(), 1U << 20U);
    if (source && parse_sdf(*source, diagnostics, meshes)) {
      ++read;
      continue;
    }
    ++refused;
    EXPECT_GT(diagnostics.error_count(), 0U) << entry.path();
    for (const Diagnostic& d : diagnostics.list()) {
      EXPECT_GT(d.span.line, 0) << render(d, false);
      EXPECT_FALSE(d.source_line.empty()) << render(d, false);
    }
  }
  EXPECT_GE(read, 4);     // Planes, a wreck, a seabed.
  EXPECT_GE(refused, 5);  // Files left out, the scenarios another language.
}

}  // namespace
}  // namespace dive::planning
