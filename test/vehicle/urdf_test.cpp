#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "test/common/arbitrary.h"
#include "test/common/file_content.h"
#include "vehicle/model.h"

namespace dive::vehicle {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Points = std::vector<Eigen::Vector3d>;

const fs::path kData = fs::path(DIVE_SHARED_DATA) / "vehicles";

Model read(const std::string& xml) {
  Diagnostics diagnostics;
  std::optional<Model> model = parse_urdf({"test.urdf", xml}, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list())
    ADD_FAILURE() << render(diagnostic, false);
  if (!model) throw std::runtime_error("not read");
  return *model;
}

Model aqua2() {
  Diagnostics diagnostics;
  std::optional<Model> model = parse_urdf(aqua2_urdf(), diagnostics);
  if (!model || !diagnostics.list().empty()) throw std::runtime_error("aqua2.urdf is not read");
  return *model;
}

// The planes through three vertices that have all others on one side: the faces of the hull, by
// brute force. Gives the distance of a point outside the hull.
class Faces {
 public:
  explicit Faces(const Points& hull) {
    for (std::size_t i = 0; i < hull.size(); ++i) {
      for (std::size_t j = i + 1; j < hull.size(); ++j) {
        for (std::size_t k = j + 1; k < hull.size(); ++k) add(hull, {i, j, k});
      }
    }
  }

  [[nodiscard]] double outside(const Eigen::Vector3d& p) const {
    double worst = -1e9;
    for (const auto& [n, offset] : planes_) worst = std::max(worst, n.dot(p) - offset);
    return worst;
  }

 private:
  void add(const Points& hull, const std::array<std::size_t, 3>& corners) {
    const Eigen::Vector3d& a = hull[corners[0]];
    Eigen::Vector3d n = (hull[corners[1]] - a).cross(hull[corners[2]] - a);
    if (n.norm() < 1e-9) return;
    n.normalize();
    bool above = false;
    bool below = false;
    for (const Eigen::Vector3d& v : hull) {
      above = above || n.dot(v - a) > 1e-9;
      below = below || n.dot(v - a) < -1e-9;
      if (above && below) return;
    }
    if (above) n = -n;
    planes_.emplace_back(n, n.dot(a));
  }

  std::vector<std::pair<Eigen::Vector3d, double>> planes_;
};

// ---- the Aqua2 ------------------------------------------------------------------------------

TEST(Aqua2, HasTheDatasheetsMassAndItsCentreOfMassBelowTheOrigin) {
  const Model model = aqua2();
  EXPECT_EQ(model.name, "aqua2");
  EXPECT_NEAR(model.mass_kg, 16.4, 0.01);
  EXPECT_NEAR(model.centre_of_mass_B.x(), 0.0, 1e-3);
  EXPECT_NEAR(model.centre_of_mass_B.y(), 0.0, 1e-3);
  EXPECT_LT(model.centre_of_mass_B.z(), -0.002);
  const Eigen::Vector3d moments = model.inertia_B.selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_GT(moments.minCoeff(), 0.05);
  EXPECT_LT(moments.maxCoeff(), moments.sum() - moments.maxCoeff());
}

TEST(Aqua2, IsAsLargeAsTheVehicleWithItsFlippersInTheGait) {
  Eigen::AlignedBox3d bounds;
  for (const planning::ConvexSolid& part : aqua2().hull.parts) {
    for (const Eigen::Vector3d& vertex : part.vertices) bounds.extend(vertex);
  }
  // The body extends 0.320 m forward; a flipper 0.2 m behind its hip at -0.249 m; half the width is
  // a mid hip and half a flipper; half the height is a flipper's tip at 35 degrees.
  EXPECT_NEAR(bounds.max().x(), 0.320, 1e-3);
  EXPECT_NEAR(bounds.min().x(), -0.449, 2e-3);
  EXPECT_NEAR(bounds.max().y(), 0.237, 1e-9);
  EXPECT_NEAR(bounds.min().y(), -0.237, 1e-9);
  EXPECT_NEAR(bounds.max().z(), 0.2 * std::sin(0.611) + 0.00175 * std::cos(0.611), 3e-3);
  EXPECT_NEAR(bounds.min().z(), -bounds.max().z(), 1e-9);
}

TEST(Aqua2, HasItsHipsInTheOrderOfTheirNames) {
  const Model model = aqua2();
  for (int hip = 0; hip < 6; ++hip) {
    EXPECT_EQ(model.hips_B(1, hip) > 0.0, hip < 3) << hip;
    EXPECT_EQ(model.hips_B(0, hip), model.hips_B(0, (hip + 3) % 6)) << hip;
  }
  EXPECT_GT(model.hips_B(0, 0), model.hips_B(0, 1));
  EXPECT_GT(model.hips_B(0, 1), model.hips_B(0, 2));
}

// Corners of all triangles of a binary STL file.
Points read_stl(const fs::path& path) {
  const std::string bytes = dive::testing::content_of(path);
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  Points corners;
  for (std::size_t triangle = 0; triangle < count; ++triangle) {
    std::array<float, 12> numbers{};  // normal, then three corners
    std::memcpy(numbers.data(), bytes.data() + 84 + 50 * triangle, sizeof numbers);
    for (std::size_t k = 3; k < 12; k += 3) {
      corners.emplace_back(numbers[k], numbers[k + 1], numbers[k + 2]);
    }
  }
  return corners;
}

Eigen::AlignedBox3d bounds_of(const planning::ConvexSolid& part) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : part.vertices) box.extend(vertex);
  return box;
}

// The four boxes of the body, as axis-aligned boxes.
std::vector<Eigen::AlignedBox3d> body_boxes(const Model& model) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const planning::ConvexSolid& part : model.hull.parts) {
    if (part.vertices.size() == 8) boxes.push_back(bounds_of(part));
  }
  return boxes;
}

// True if a triangle is inside the union of the boxes. Subdivided until each piece is inside one of
// them.
bool covered(const std::vector<Eigen::AlignedBox3d>& boxes, const std::array<Eigen::Vector3d, 3>& t,
             int depth = 0) {
  for (const Eigen::AlignedBox3d& box : boxes) {
    if (box.contains(t[0]) && box.contains(t[1]) && box.contains(t[2])) return true;
  }
  if (depth == 12) return false;
  // Bisect the longest edge.
  int edge = 0;
  for (int k = 1; k < 3; ++k) {
    const auto length = [&t](int i) {
      return (t[static_cast<std::size_t>((i + 1) % 3)] - t[static_cast<std::size_t>(i)]).norm();
    };
    if (length(k) > length(edge)) edge = k;
  }
  const Eigen::Vector3d& a = t[static_cast<std::size_t>(edge)];
  const Eigen::Vector3d& b = t[static_cast<std::size_t>((edge + 1) % 3)];
  const Eigen::Vector3d& c = t[static_cast<std::size_t>((edge + 2) % 3)];
  const Eigen::Vector3d middle = 0.5 * (a + b);
  return covered(boxes, {a, middle, c}, depth + 1) && covered(boxes, {middle, b, c}, depth + 1);
}

TEST(Aqua2, ContainsTheRealBodyMesh) {
  const fs::path mesh = kData / "aqua2/aqua_description_rev5/meshes/aqua_body_collision.stl";
  if (!fs::exists(mesh)) GTEST_SKIP() << "the mesh of the real vehicle is not there: " << mesh;
  const Points corners = read_stl(mesh);
  ASSERT_EQ(corners.size(), 3U * 4554U);
  const std::vector<Eigen::AlignedBox3d> boxes = body_boxes(aqua2());
  ASSERT_EQ(boxes.size(), 4U);
  int outside_count = 0;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    outside_count += covered(boxes, {corners[i], corners[i + 1], corners[i + 2]}) ? 0 : 1;
  }
  EXPECT_EQ(outside_count, 0);
}

TEST(Aqua2, ContainsTheRealHubsAtEveryAngleOfTheGait) {
  const fs::path mesh = kData / "aqua2/aqua_description_rev5/meshes/shoulder_collision.stl";
  if (!fs::exists(mesh)) GTEST_SKIP() << "the mesh of the real vehicle is not there: " << mesh;
  const Points corners = read_stl(mesh);
  const Model model = aqua2();
  const std::vector<Eigen::AlignedBox3d> boxes = body_boxes(model);
  for (int hip = 0; hip < 6; ++hip) {
    for (double angle = -0.611; angle <= 0.612; angle += 0.0611) {
      const Eigen::AngleAxisd R(angle, Eigen::Vector3d::UnitY());
      for (const Eigen::Vector3d& corner : corners) {
        const Eigen::Vector3d p = model.hips_B.col(hip) + R * corner;
        ASSERT_TRUE(std::any_of(boxes.begin(), boxes.end(),
                                [&](const auto& box) { return box.contains(p); }))
            << "hip " << hip << " at " << angle << " rad: " << p.transpose();
      }
    }
  }
}

// ---- geometry and masses --------------------------------------------------------------------

std::string robot(const std::string& body) { return "<robot name=\"r\">\n" + body + "\n</robot>"; }

const std::string kMass =
    R"(<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>)";
const std::string kBox = R"(<collision><geometry><box size="1 1 1"/></geometry></collision>)";

std::string link(const std::string& name, const std::string& content) {
  return "<link name=\"" + name + "\">" + content + "</link>\n";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& content = {}) {
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/>{}</joint>\n", name,
      type, parent, child, content);
}

// A dumbbell: two bodies of 2 kg, 2 m apart along y, one turned by 90 degrees about z.
TEST(Urdf, CombinesMassesByTheParallelAxisTheorem) {
  const auto body = [](const char* name, const char* inertia) {
    return link(name, fmt::format("<inertial><origin xyz=\"0 0 0.5\"/><mass value=\"2\"/>"
                                  "<inertia {}/></inertial>",
                                  inertia));
  };
  const char* slim = R"(ixx="1" ixy="0" ixz="0" iyy="3" iyz="0" izz="3.5")";
  const Model model = read(robot(
      link("base", kBox) + body("a", slim) + body("b", slim) +
      joint("ja", "fixed", "base", "a", R"(<origin xyz="0 1 0"/>)") +
      joint("jb", "fixed", "base", "b", R"(<origin xyz="0 -1 0" rpy="0 0 1.5707963267948966"/>)")));
  EXPECT_DOUBLE_EQ(model.mass_kg, 4.0);
  EXPECT_TRUE(model.centre_of_mass_B.isApprox(Eigen::Vector3d(0, 0, 0.5), 1e-12));
  const Eigen::Matrix3d expected = Eigen::Vector3d(1 + 3 + 4, 3 + 1, 7 + 4).asDiagonal();
  EXPECT_TRUE(model.inertia_B.isApprox(expected, 1e-12)) << model.inertia_B;
  EXPECT_TRUE(model.hips_B.array().isNaN().all());
}

TEST(Urdf, EnclosesCurvedShapesClosely) {
  const auto part = [](const char* shape) {
    const Model model = read(
        robot(link("base", kMass + "<collision><geometry>" + shape + "</geometry></collision>")));
    return model.hull.parts.at(0).vertices;
  };
  const Points sphere = part(R"(<sphere radius="1"/>)");
  for (const Eigen::Vector3d& vertex : sphere) EXPECT_LT(vertex.norm(), 1.08);
  const Points cylinder = part(R"(<cylinder radius="1" length="4"/>)");
  for (const Eigen::Vector3d& vertex : cylinder) {
    EXPECT_LT(vertex.head<2>().norm(), 1.02);
    EXPECT_DOUBLE_EQ(std::abs(vertex.z()), 2.0);
  }
  const Faces of_sphere(sphere);
  const Faces of_cylinder(cylinder);
  EXPECT_TRUE(rc::check([&] {
    const Eigen::Vector3d p =
        (*dive::testing::arbitrary_vector(1.0) + Eigen::Vector3d(1e-3, 0, 0)).normalized();
    RC_ASSERT(of_sphere.outside(p) < 1e-9);
    const double angle = *dive::testing::arbitrary_double(0.0, 6.3);
    RC_ASSERT(of_cylinder.outside({std::cos(angle), std::sin(angle), 2.0}) < 1e-9);
  }));
}

// A paddle on a revolute joint on a slider: at any position of both joints all of it is in the
// hull, and the hull exceeds its swept volume only a little.
TEST(Urdf, SweepsPartsOverTheRangesOfAllTheirJoints) {
  const Model model = read(robot(
      link("base", kMass) + link("carriage", "") +
      link("paddle", R"(<collision name="paddle"><origin xyz="0.3 0 0.02" rpy="0.1 0.2 0.3"/>
                        <geometry><box size="0.5 0.1 0.05"/></geometry></collision>)") +
      joint("slide", "prismatic", "base", "carriage",
            R"(<origin xyz="0.1 0.2 0.3" rpy="0 0 0.5"/><axis xyz="0 0 2"/>
               <limit lower="-0.2" upper="0.4"/>)") +
      joint("turn", "revolute", "carriage", "paddle",
            R"(<origin xyz="0 0 0.1"/><axis xyz="0 1 1"/><limit lower="-0.7" upper="1.1"/>)")));
  ASSERT_EQ(model.hull.parts.size(), 1U);
  EXPECT_EQ(model.hull.parts[0].name, "paddle");
  const Points& hull = model.hull.parts[0].vertices;
  ASSERT_LE(hull.size(), 256U);
  const Faces faces(hull);

  const auto corner = [](int i, double slide, double turn) {
    const Eigen::Vector3d in_box(0.25 * ((i & 1) != 0 ? 1 : -1), 0.05 * ((i & 2) != 0 ? 1 : -1),
                                 0.025 * ((i & 4) != 0 ? 1 : -1));
    const Pose X_LP{{0.3, 0, 0.02}, from_rpy(0.1, 0.2, 0.3)};
    const Eigen::AngleAxisd R(turn, Eigen::Vector3d(0, 1, 1).normalized());
    const Pose X_BJ{{0.1, 0.2, 0.3}, from_rpy(0, 0, 0.5)};
    return (X_BJ * (Eigen::Vector3d(0, 0, slide + 0.1) + R * (X_LP * in_box))).eval();
  };
  std::array<double, 3> reach{-1e9, -1e9, -1e9};
  for (int i = 0; i < 8; ++i) {
    for (int s = 0; s <= 3; ++s) {
      for (int t = 0; t <= 20; ++t) {
        const Eigen::Vector3d p = corner(i, -0.2 + 0.2 * s, -0.7 + 0.09 * t);
        if (s % 3 == 0 && t % 4 == 0) {
          EXPECT_LT(faces.outside(p), 1e-9) << p.transpose();
        }
        for (int axis = 0; axis < 3; ++axis) {
          auto& most = reach[static_cast<std::size_t>(axis)];
          most = std::max(most, p[axis]);
        }
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    double most = -1e9;
    for (const Eigen::Vector3d& vertex : hull) most = std::max(most, vertex[axis]);
    EXPECT_LT(most, reach[static_cast<std::size_t>(axis)] + 0.008) << axis;
  }
}

TEST(Urdf, SweepsContinuousJointsAllTheWayRound) {
  const Model model =
      read(robot(link("base", kMass) + link("wheel", R"(<collision><origin xyz="0.5 0 0"/><geometry>
                                  <box size="0.2 0.1 0.1"/></geometry></collision>)") +
                 joint("turn", "continuous", "base", "wheel", R"(<axis xyz="0 0 1"/>)")));
  const Points& hull = model.hull.parts.at(0).vertices;
  const Faces faces(hull);
  const double radius = std::hypot(0.6, 0.05);
  for (double angle = 0.0; angle < 6.3; angle += 0.07) {
    const Eigen::Vector3d rim(radius * std::cos(angle), radius * std::sin(angle), 0.05);
    EXPECT_LT(faces.outside(rim), 1e-9);
  }
  for (const Eigen::Vector3d& vertex : hull) EXPECT_LT(vertex.head<2>().norm(), radius * 1.011);
}

TEST(Urdf, GivesTheSameHullEveryTime) {
  const Model first = aqua2();
  const std::vector<std::string> filler(1000, std::string(100, 'x'));  // moves the heap
  const Model second = aqua2();
  ASSERT_EQ(first.hull.parts.size(), second.hull.parts.size());
  for (std::size_t i = 0; i < first.hull.parts.size(); ++i) {
    EXPECT_EQ(first.hull.parts[i].vertices, second.hull.parts[i].vertices);
  }
}

// ---- invalid files --------------------------------------------------------------------------

struct Mistake {
  const char* name;
  std::string xml;
  const char* code;
  const char* at;    ///< Text whose first occurrence the diagnostic points to.
  const char* hint;  ///< Part of the hint; may be empty.
};

void PrintTo(const Mistake& mistake, std::ostream* stream) { *stream << mistake.xml; }

class Mistakes : public ::testing::TestWithParam<Mistake> {};

TEST_P(Mistakes, IsReportedWhereItIs) {
  const Mistake& mistake = GetParam();
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_urdf({"test.urdf", mistake.xml}, diagnostics));
  const auto found =
      std::find_if(diagnostics.list().begin(), diagnostics.list().end(),
                   [](const Diagnostic& d) { return d.severity == Severity::kError; });
  ASSERT_NE(found, diagnostics.list().end());
  EXPECT_EQ(found->code, mistake.code) << render(*found, false);
  EXPECT_THAT(found->hint, HasSubstr(mistake.hint));
  const std::size_t offset = mistake.xml.find(mistake.at);
  ASSERT_NE(offset, std::string::npos);
  const Span expected = SourceText("test.urdf", mistake.xml).span_at(offset, 1);
  EXPECT_EQ(found->span.line, expected.line) << render(*found, false);
  EXPECT_EQ(found->span.column, expected.column) << render(*found, false);
}

std::string with_inertia(const std::string& mass, const std::string& inertia) {
  return robot(link("base", fmt::format("<inertial>{}{}</inertial>", mass, inertia) + kBox));
}

std::string with_shape(const std::string& shape) {
  return robot(link("base", kMass + "<collision><geometry>" + shape + "</geometry></collision>"));
}

std::string two_links(const std::string& the_joint) {
  return robot(link("base", kMass + kBox) + link("arm", kBox) + the_joint);
}

std::string with_motion_of(const std::string& coefficients) {
  return robot(link("base", kMass + kBox) + "<motion>" + coefficients + "</motion>");
}

std::string hips_without_one() {
  std::string body = link("base", kMass + kBox);
  for (const char* name :
       {"left_front", "lef_mid", "left_rear", "right_front", "right_mid", "right_rear"}) {
    body += link(fmt::format("{}_flipper", name), "") +
            joint(name, "fixed", "base", fmt::format("{}_flipper", name));
  }
  return robot(body);
}

std::string long_chain() {
  std::string body = link("l0", kMass + kBox);
  for (int i = 1; i <= 70; ++i) {
    body += link(fmt::format("l{}", i), "") +
            joint(fmt::format("j{}", i), "fixed", fmt::format("l{}", i - 1), fmt::format("l{}", i));
  }
  return robot(body);
}

const char* const kGoodInertia = R"(<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>)";

INSTANTIATE_TEST_SUITE_P(
    Each, Mistakes,
    ::testing::Values(
        Mistake{"wrong_root", "<sdf/>", "URDF-ROOT", "sdf", ""},
        Mistake{"xacro",
                "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:include "
                "filename=\"x\"/></robot>",
                "URDF-XACRO", "xacro:include", "expand"},
        Mistake{"nameless_robot", "<robot><link name=\"l\"/></robot>", "URDF-ATTRIBUTE", "robot",
                ""},
        Mistake{"misspelt_link", robot("<lnik name=\"a\"/>"), "URDF-ELEMENT", "lnik", "<link>"},
        Mistake{"no_links", robot(""), "URDF-TREE", "robot", ""},
        Mistake{"duplicate_link", robot(link("a", kMass + kBox) + "<link name='a'/>"),
                "URDF-DUPLICATE", "a'/>", ""},
        Mistake{"duplicate_joint",
                robot(link("a", kMass + kBox) + link("b", "") + link("c", "") +
                      joint("j", "fixed", "a", "b") +
                      "<joint name='j' type='fixed'><parent link='a'/><child link='c'/></joint>"),
                "URDF-DUPLICATE", "j' type", ""},
        Mistake{"two_inertials", robot(link("a", kMass + "<inertial >" + kMass.substr(10) + kBox)),
                "URDF-DUPLICATE", "inertial >", ""},
        Mistake{"missing_child", two_links(joint("j", "fixed", "base", "amr")), "URDF-LINK", "amr",
                "'arm'"},
        Mistake{"missing_parent", two_links(joint("j", "fixed", "bass", "arm")), "URDF-LINK",
                "bass", "'base'"},
        Mistake{"two_roots", two_links(""), "URDF-TREE", "arm", ""},
        Mistake{"two_parents",
                robot(link("a", kMass + kBox) + link("b", "") + link("c", "") +
                      joint("j", "fixed", "a", "c") +
                      "<joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child "
                      "link='c'/></joint>"),
                "URDF-TREE", "c'/>", ""},
        Mistake{"cycle_of_all",
                two_links(joint("j", "fixed", "base", "arm") + joint("k", "fixed", "arm", "base")),
                "URDF-TREE", "joint", ""},
        Mistake{"cycle_beside_the_root",
                robot(link("root", kMass + kBox) + link("odd", "") + link("even", "") +
                      joint("j", "fixed", "odd", "even") + joint("k", "fixed", "even", "odd")),
                "URDF-TREE", "odd", ""},
        Mistake{
            "joint_to_itself",
            robot(link("root", kMass + kBox) + link("odd", "") + joint("j", "fixed", "odd", "odd")),
            "URDF-TREE", "odd", ""},
        Mistake{"chain_too_long", long_chain(), "URDF-TREE", "l65", ""},
        Mistake{"unknown_joint_type", two_links(joint("j", "revolut", "base", "arm")),
                "URDF-JOINT-TYPE", "revolut", "'revolute'"},
        Mistake{"floating_joint", two_links(joint("j", "floating", "base", "arm")),
                "URDF-JOINT-TYPE", "floating", ""},
        Mistake{"no_limit", two_links(joint("j", "revolute", "base", "arm")), "URDF-LIMIT", "joint",
                "<limit"},
        Mistake{"limits_for_limit",
                two_links(joint("j", "revolute", "base", "arm", "<limits lower=\"0\"/>")),
                "URDF-ELEMENT", "limits", "<limit>"},
        Mistake{"limits_reversed",
                two_links(joint("j", "revolute", "base", "arm", R"(<limit lower="1" upper="0"/>)")),
                "URDF-LIMIT", "limit", ""},
        Mistake{"travel_without_end",
                two_links(joint("j", "prismatic", "base", "arm", R"(<limit upper="1e9"/>)")),
                "URDF-LIMIT", "limit", ""},
        Mistake{"no_axis",
                two_links(joint("j", "continuous", "base", "arm", R"(<axis xyz="0 0 0"/>)")),
                "URDF-AXIS", "axis", ""},
        Mistake{"joint_without_child",
                two_links("<joint name=\"j\" type=\"fixed\"><parent link=\"base\"/></joint>"),
                "URDF-JOINT", "joint", ""},
        Mistake{"nan", with_shape(R"(<box size="1 nan 1"/>)"), "URDF-NUMBER", "1 nan 1", ""},
        Mistake{"two_of_three", with_shape(R"(<box size="1 2"/>)"), "URDF-NUMBER", "1 2", ""},
        Mistake{"xacro_value", with_shape(R"(<sphere radius="${r}"/>)"), "URDF-NUMBER", "${r}",
                "xacro"},
        Mistake{"flat_box", with_shape(R"(<box size="1 1 0"/>)"), "URDF-SIZE", "1 1 0", ""},
        Mistake{"negative_radius", with_shape(R"(<sphere radius="-1"/>)"), "URDF-SIZE", "-1", ""},
        Mistake{"no_length", with_shape(R"(<cylinder radius="1"/>)"), "URDF-ATTRIBUTE", "cylinder",
                ""},
        Mistake{"mesh", with_shape(R"(<mesh filename="hull.stl"/>)"), "URDF-MESH", "mesh", "boxes"},
        Mistake{"capsule", with_shape(R"(<capsule radius="1" length="1"/>)"), "URDF-GEOMETRY",
                "geometry", ""},
        Mistake{"two_shapes", with_shape(R"(<box size="1 1 1"/><sphere radius="1"/>)"),
                "URDF-GEOMETRY", "geometry", "one <collision> for each"},
        Mistake{"no_geometry", robot(link("base", kMass + "<collision/>")), "URDF-GEOMETRY",
                "collision", ""},
        Mistake{"origin_far_away",
                robot(link("base", kMass + R"(<collision><origin xyz="1e300 0 0"/></collision>)")),
                "URDF-SIZE", "1e300", ""},
        Mistake{"negative_mass", with_inertia(R"(<mass value="-3"/>)", kGoodInertia), "URDF-MASS",
                "-3", ""},
        Mistake{"no_mass", with_inertia("", kGoodInertia), "URDF-INERTIAL", "inertial", ""},
        Mistake{"no_inertia", with_inertia(R"(<mass value="3"/>)", ""), "URDF-INERTIAL", "inertial",
                ""},
        Mistake{"inertia_incomplete", with_inertia(R"(<mass value="3"/>)", R"(<inertia ixx="1"/>)"),
                "URDF-ATTRIBUTE", "inertia ixx", ""},
        Mistake{"not_positive_definite",
                with_inertia(R"(<mass value="3"/>)",
                             R"(<inertia ixx="1" ixy="2" ixz="0" iyy="1" iyz="0" izz="1"/>)"),
                "URDF-INERTIA", "inertia ixx", ""},
        Mistake{"massless", robot(link("base", kBox)), "URDF-MASSLESS", "robot", ""},
        Mistake{"no_hull", robot(link("base", kMass)), "URDF-HULL", "robot", ""},
        Mistake{"a_hip_misspelt", hips_without_one(), "URDF-HIPS", "robot", "'lef_mid'"},
        Mistake{"a_coefficient_misspelt", with_motion_of(R"(<full_sped value="1"/>)"),
                "URDF-ELEMENT", "full_sped", "<full_speed>"},
        Mistake{"a_coefficient_beyond_its_range", with_motion_of(R"(<full_speed value="8.25"/>)"),
                "URDF-MOTION", "8.25", "dive fit"},
        Mistake{"a_coefficient_without_value", with_motion_of("<full_speed/>"), "URDF-ATTRIBUTE",
                "full_speed", ""},
        Mistake{"a_coefficient_that_is_no_number", with_motion_of(R"(<full_speed value="fast"/>)"),
                "URDF-NUMBER", "fast", ""},
        Mistake{"a_coefficient_twice",
                with_motion_of(R"(<tail_m value="1"/><full_speed value="1"/><tail_m value="2"/>)"),
                "URDF-DUPLICATE", "tail_m value=\"2\"", ""},
        Mistake{"motion_twice", robot(link("base", kMass + kBox) + "<motion/><motion />"),
                "URDF-DUPLICATE", "motion />", ""}),
    [](const auto& param_info) { return std::string(param_info.param.name); });

TEST(Urdf, WarnsOfMomentsThatNoBodyHas) {
  Diagnostics diagnostics;
  const std::string xml = with_inertia(
      R"(<mass value="3"/>)", R"(<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3"/>)");
  EXPECT_TRUE(parse_urdf({"test.urdf", xml}, diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "URDF-INERTIA-TRIANGLE");
  EXPECT_EQ(diagnostics.list()[0].severity, Severity::kWarning);
}

TEST(Urdf, FindsAllMistakesInOnePass) {
  Diagnostics diagnostics;
  const std::string xml =
      robot(link("a", R"(<collision><geometry><box size="1 1"/></geometry></collision>)") +
            link("b", R"(<collision><geometry><sphere radius="x"/></geometry></collision>)") +
            joint("j", "welded", "a", "b"));
  EXPECT_FALSE(parse_urdf({"test.urdf", xml}, diagnostics));
  EXPECT_EQ(diagnostics.error_count(), 3U);
}

TEST(Urdf, ReportsWhyAFileCannotBeRead) {
  Diagnostics diagnostics;
  EXPECT_FALSE(load_urdf("no/such/file.urdf", diagnostics));
  ASSERT_EQ(diagnostics.list().size(), 1U);
  EXPECT_EQ(diagnostics.list()[0].code, "FILE-UNREADABLE");
}

// Real files of other vehicles: each is read, or rejected with a reason and a position.
TEST(Urdf, ReadsOrRefusesRealFiles) {
  if (!fs::exists(kData / "urdf_others")) GTEST_SKIP() << "no real files at " << kData;
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kData)) {
    const std::string extension = entry.path().extension();
    if (extension != ".urdf" && extension != ".xacro" && extension != ".srdf") continue;
    ++files;
    Diagnostics diagnostics;
    if (load_urdf(entry.path().string(), diagnostics)) continue;
    ASSERT_FALSE(diagnostics.list().empty()) << entry.path();
    const Diagnostic& first = diagnostics.list().front();
    EXPECT_GT(first.span.line, 0) << entry.path() << ": " << render(first, false);
    EXPECT_FALSE(first.message.empty());
  }
  EXPECT_GT(files, 10);
}

}  // namespace
}  // namespace dive::vehicle
