// The environments of the AquaNav paper: sizes, passages and plans, computed from the maps' text
// and the plans' waypoints. Nothing here uses the planner or the reader of maps.

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <regex>
#include <sstream>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::Ran;

constexpr double kDegree = std::numbers::pi / 180.0;

// ---- Maps, from their text. ----

/// A box, or an upright cylinder of its own frame.
struct Solid {
  Vector3d p_W = Vector3d::Zero();
  Matrix3d R_WS = Matrix3d::Identity();
  Vector3d half = Vector3d::Zero();  ///< Of a cylinder: radius, radius, half length; m.
  bool is_box = false;

  /// Half of its extent along a direction, m.
  [[nodiscard]] double half_extent(const Vector3d& n_W) const {
    const Vector3d n = R_WS.transpose() * n_W;
    if (is_box) return n.cwiseAbs().dot(half);
    return half.x() * n.head<2>().norm() + half.z() * std::abs(n.z());
  }

  /// Distance of a point outside, m.
  [[nodiscard]] double distance(const Vector3d& point_W) const {
    const Vector3d p = R_WS.transpose() * (point_W - p_W);
    if (is_box) return (p.cwiseAbs() - half).cwiseMax(0.0).norm();
    return std::hypot(std::max(0.0, p.head<2>().norm() - half.x()),
                      std::max(0.0, std::abs(p.z()) - half.z()));
  }
};

using Solids = std::map<std::string, Solid>;  // by MODEL/COLLISION

Solids solids_of(const std::string& name) {
  const std::regex model_line(R"re(<model name="([^"]*)">)re");
  const std::regex line_of_solid(
      R"re(<collision name="([^"]*)"><pose>([^<]*)</pose><geometry><(box|cylinder)>(.*)</geometry>)re");
  std::istringstream text(
      testing::content_of(fmt::format("{}/missions/maps/{}.sdf", DIVE_SOURCE_DIR, name)));
  Solids solids;
  std::string model;
  for (std::string line; std::getline(text, line);) {
    std::smatch found;
    if (std::regex_search(line, found, model_line)) model = found[1];
    if (!std::regex_search(line, found, line_of_solid)) continue;
    std::istringstream pose(found[2]);
    double x = 0.0, y = 0.0, z = 0.0, roll = 0.0, pitch = 0.0, yaw = 0.0;
    EXPECT_TRUE(pose >> x >> y >> z >> roll >> pitch >> yaw) << line;
    std::istringstream size(std::regex_replace(found[4].str(), std::regex("<[^>]*>"), " "));
    Solid solid{.p_W = {x, y, z}, .is_box = found[3] == "box"};
    solid.R_WS =
        (Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Vector3d::UnitX()))
            .toRotationMatrix();
    double a = 0.0, b = 0.0, c = 0.0;
    EXPECT_TRUE(size >> a >> b) << line;
    if (solid.is_box) {
      EXPECT_TRUE(size >> c) << line;
    }
    solid.half = solid.is_box ? Vector3d(a / 2, b / 2, c / 2) : Vector3d(a, a, b / 2);
    solids[fmt::format("{}/{}", model, found[1].str())] = solid;
  }
  return solids;
}

/// Where the free water ends along n, before `solid` (`side` -1) or behind it (1); the surface is z
/// = 0.
double edge(const Solids& solids, const std::string& solid, const Vector3d& n_W, double side) {
  if (solid == "surface") return 0.0;
  const auto found = solids.find(solid);
  if (found == solids.end()) throw std::runtime_error(fmt::format("no {} in the map", solid));
  return found->second.p_W.dot(n_W) + side * found->second.half_extent(n_W);
}

// ---- Plans. ----

struct PoseOnPath {
  Vector3d p_W;
  Quaterniond q_WB;

  [[nodiscard]] double roll() const {
    return std::atan2((q_WB * Vector3d::UnitY()).z(), (q_WB * Vector3d::UnitZ()).z());
  }
  [[nodiscard]] double pitch() const { return std::asin(-(q_WB * Vector3d::UnitX()).z()); }
};

/// The legs' paths, a pose every five centimetres at most.
std::vector<PoseOnPath> path_of_plan(const nlohmann::json& plans) {
  std::vector<PoseOnPath> path;
  for (const auto& plan : plans) {
    std::optional<PoseOnPath> last;
    for (const auto& w : plan.at("waypoints")) {
      const auto v = w.get<std::array<double, 7>>();
      const PoseOnPath pose{{v[0], v[1], v[2]}, Quaterniond(v[6], v[3], v[4], v[5])};
      const int steps = last ? static_cast<int>((pose.p_W - last->p_W).norm() / 0.05) + 1 : 1;
      for (int i = last ? 1 : steps; i <= steps; ++i) {
        const double t = static_cast<double>(i) / steps;
        const PoseOnPath& from = last ? *last : pose;
        path.push_back({from.p_W + t * (pose.p_W - from.p_W), from.q_WB.slerp(t, pose.q_WB)});
      }
      last = pose;
    }
  }
  return path;
}

/// Points on the edges and faces of the hull, of `collision` boxes in vehicle/aqua2.urdf; the
/// flippers move with the gait.
std::vector<Vector3d> hull_points() {
  struct Box {
    Vector3d middle, size;
  };
  std::vector<Vector3d> points;
  for (const Box& box :
       {Box{{-0.032, 0, 0.0026}, {0.704, 0.239, 0.137}}, Box{{0.249, 0, 0}, {0.09, 0.346, 0.068}},
        Box{{-0.007, 0, 0}, {0.09, 0.446, 0.068}}, Box{{-0.249, 0, 0}, {0.09, 0.346, 0.068}}}) {
    constexpr int kSteps = 6;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        for (int k = 0; k <= kSteps; ++k) {
          const auto at_edge = [](int n) { return n == 0 || n == kSteps; };
          if (!at_edge(i) && !at_edge(j) && !at_edge(k)) continue;
          const Vector3d fraction = Vector3d(i, j, k) / kSteps - Vector3d::Constant(0.5);
          points.emplace_back(box.middle + fraction.cwiseProduct(box.size));
        }
      }
    }
  }
  return points;
}

double clearance(const std::vector<PoseOnPath>& path, const Solids& solids) {
  const std::vector<Vector3d> hull = hull_points();
  double least = std::numeric_limits<double>::infinity();
  for (const PoseOnPath& pose : path) {
    for (const auto& [name, solid] : solids) {
      constexpr double kHullRadius = 0.5;
      if (solid.distance(pose.p_W) > least + kHullRadius) continue;
      for (const Vector3d& p_B : hull) {
        least = std::min(least, solid.distance(pose.p_W + pose.q_WB * p_B));
      }
    }
  }
  return least;
}

// ---- The environments. ----

/// Free water between two solids, which the path has to pass.
struct Passage {
  std::string from, to;
  Vector3d across_W;      ///< Unit vector from one to the other.
  double roll_deg;        ///< Roll for which the water suffices.
  double min_deg = -1.0;  ///< Bounds of the roll where it is passed.
  double max_deg = 1.0;
  bool level_is_too_wide = false;
};

struct Environment {
  std::string name;
  Vector3d water;  ///< Length, width, depth of a pool, m; zero: no pool.
  std::vector<Passage> passages;
};

const double kHalfTurn = std::sqrt(0.5);  // sine and cosine of 45 degrees
const Vector3d kNorth = Vector3d::UnitY();
const Vector3d kUp = Vector3d::UnitZ();

/// Least width of water for the hull of 0.44 x 0.14 m at a roll, m.
double least_gap(const Vector3d& across_W, double roll_deg, double d_min) {
  const Matrix3d R = Eigen::AngleAxisd(roll_deg * kDegree, Vector3d::UnitX()).toRotationMatrix();
  const Vector3d across = R.transpose() * across_W;
  return 0.44 * std::abs(across.y()) + 0.14 * std::abs(across.z()) + 2.0 * d_min;
}

const std::vector<Environment>& environments() {
  static const std::vector<Environment> all{
      {"pool1",
       {25, 15, 4},
       {{"pipes/upright_2", "pipes/upright_1", kNorth, 0},
        {"pipes/upright_3", "pipes/upright_4", kNorth, 0},
        {"pipes/lying", "surface", kUp, 0}}},
      {"pool2",
       {25, 15, 4},
       {{"pipes/slanting_north",
         "pipes/slanting_south",
         {0, -kHalfTurn, kHalfTurn},
         45,
         35,
         60,
         true}}},
      {"pool3",
       {25, 15, 4},
       {{"pool/floor", "sheets/first", kUp, 0},
        {"sheets/second", "surface", kUp, 0},
        {"pool/floor", "sheets/third", kUp, 0}}},
      {"pool4",
       {50, 25, 2},
       {{"pipes/middle", "pipes/left", {0, kHalfTurn, kHalfTurn}, -45, -60, -35, true}}},
      {"cluttered",
       Vector3d::Zero(),
       {{"pillars_0/pillar_3", "pillars_0/pillar_4", kNorth, 90, 65, 115, true},
        {"beams_0/beam_2", "beams_0/beam_1", kUp, 0, -15, 15},
        {"pillars_1/pillar_3", "pillars_1/pillar_4", kNorth, 90, 65, 115, true},
        {"beams_1/beam_2", "beams_1/beam_1", kUp, 0, -15, 15}}},
      {"wreck",
       Vector3d::Zero(),
       {{"bulkheads/engine_room_starboard", "bulkheads/engine_room_port", kNorth, 0, -25, 25}}}};
  return all;
}

constexpr double kDMin = 0.6;  // m

class PaperEnvironments : public ::testing::TestWithParam<Environment> {
 protected:
  void SetUp() override {
    solids_ = solids_of(GetParam().name);
    const std::string mission = fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, GetParam().name);
    const Ran ran = testing::run_dive(fmt::format("plan '{}' --json", mission), GetParam().name);
    ASSERT_EQ(ran.status, 0) << ran.err;
    path_ = path_of_plan(nlohmann::json::parse(ran.out).at("plans"));
    ASSERT_GT(path_.size(), 100u);
  }

  Solids solids_;
  std::vector<PoseOnPath> path_;
};

TEST_P(PaperEnvironments, ThePoolHasThePapersSize) {
  const Vector3d& water = GetParam().water;
  if (water.isZero()) GTEST_SKIP() << "no pool";
  const auto inside = [&](const std::string& from, const std::string& to, const Vector3d& n) {
    return edge(solids_, to, n, -1.0) - edge(solids_, from, n, 1.0);
  };
  EXPECT_NEAR(inside("pool/west", "pool/east", Vector3d::UnitX()), water.x(), 1e-9);
  EXPECT_NEAR(inside("pool/south", "pool/north", kNorth), water.y(), 1e-9);
  EXPECT_NEAR(inside("pool/floor", "surface", kUp), water.z(), 1e-9);
}

TEST_P(PaperEnvironments, ThePlanKeepsDMin) {
  EXPECT_GE(clearance(path_, solids_), kDMin);
  for (const PoseOnPath& pose : path_) EXPECT_LE(pose.p_W.z(), -kDMin) << "too near to the surface";
}

TEST_P(PaperEnvironments, EveryPassageIsOneTenthToOneHalfWiderThanItMustBe) {
  for (const Passage& passage : GetParam().passages) {
    SCOPED_TRACE(fmt::format("{} to {}", passage.from, passage.to));
    const double gap = edge(solids_, passage.to, passage.across_W, -1.0) -
                       edge(solids_, passage.from, passage.across_W, 1.0);
    const double ratio = gap / least_gap(passage.across_W, passage.roll_deg, kDMin);
    EXPECT_GE(ratio, 1.1);
    EXPECT_LE(ratio, 1.5);
    if (passage.level_is_too_wide) {
      EXPECT_LT(gap, least_gap(passage.across_W, 0.0, kDMin));
    }
  }
}

TEST_P(PaperEnvironments, ThePathLeadsThroughEveryPassageAtItsRoll) {
  for (const Passage& passage : GetParam().passages) {
    SCOPED_TRACE(fmt::format("{} to {}", passage.from, passage.to));
    // The surface and the floor reach along the pool: the other solid says where the passage is.
    const bool from_floor = passage.from == "pool/floor";
    const double x = solids_.at(from_floor ? passage.to : passage.from).p_W.x();
    int crossings = 0;
    for (std::size_t i = 1; i < path_.size(); ++i) {
      if ((path_[i - 1].p_W.x() < x) == (path_[i].p_W.x() < x)) continue;
      ++crossings;
      const double along = path_[i].p_W.dot(passage.across_W);
      EXPECT_GT(along, edge(solids_, passage.from, passage.across_W, 1.0));
      EXPECT_LT(along, edge(solids_, passage.to, passage.across_W, -1.0));
      EXPECT_GE(path_[i].roll() / kDegree, passage.min_deg);
      EXPECT_LE(path_[i].roll() / kDegree, passage.max_deg);
    }
    EXPECT_GE(crossings, 1);
  }
}

TEST_P(PaperEnvironments, OnlyWhereTheMissionAllowsItTheVehicleLeavesItsAttitude) {
  const std::string& name = GetParam().name;
  if (name != "pool1" && name != "pool3") GTEST_SKIP() << "free to roll";
  double pitch = 0.0;
  for (const PoseOnPath& pose : path_) {
    EXPECT_NEAR(pose.roll() / kDegree, 0.0, 0.5) << pose.p_W.transpose();
    pitch = std::max(pitch, std::abs(pose.pitch()) / kDegree);
  }
  if (name == "pool1") {
    EXPECT_LT(pitch, 0.5) << "its cameras face the floor";
  } else {
    EXPECT_GT(pitch, 10.0) << "it follows the slope of its path";
  }
}

TEST_P(PaperEnvironments, TheCheckHasNothingToSay) {
  const std::string& name = GetParam().name;
  const Ran ran = testing::run_dive(
      fmt::format("check --static --json '{}/missions/{}.xml'", DIVE_SOURCE_DIR, name), name);
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_TRUE(nlohmann::json::parse(ran.out).at("diagnostics").empty()) << ran.out;
}

INSTANTIATE_TEST_SUITE_P(Missions, PaperEnvironments, ::testing::ValuesIn(environments()),
                         [](const auto& each) { return each.param.name; });

// A point beside a pipe that slants by 45 degrees, and before the corner of a box.
TEST(SolidFromText, IsWhereItsPoseSays) {
  const Solids solids = solids_of("pool2");
  const Solid& pipe = solids.at("pipes/slanting_north");
  EXPECT_NEAR(pipe.distance(pipe.p_W + Vector3d(0, -kHalfTurn, kHalfTurn)), 0.95, 1e-6);
  EXPECT_NEAR(pipe.distance(pipe.p_W + Vector3d(0, kHalfTurn, kHalfTurn)), 0.0, 1e-6);
  EXPECT_NEAR(solids.at("pool/floor").distance({-1.5, 0.0, -3.0}), std::sqrt(2.0), 1e-9);
}

}  // namespace
}  // namespace dive::mission
