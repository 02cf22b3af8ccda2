// The environments of the AquaNav paper: sizes, passages and plans, computed from the maps' text
// and the plans' waypoints. Nothing here uses the planner or the reader of maps.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "estimation/state_estimate.h"
#include "mission/document/mission.h"
#include "mission/record/log.h"
#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"

namespace dive::mission {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Ran;

constexpr double kDegree = std::numbers::pi / 180.0;

// ---- Maps, from their text. ----

/// A box, or an upright cylinder of its own frame; the cylinder round a sphere.
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
      R"re(<collision name="([^"]*)"><pose>([^<]*)</pose><geometry><(box|cylinder|sphere)>(.*)</geometry>)re");
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
    EXPECT_TRUE(size >> a) << line;
    if (found[3] == "sphere") {
      b = 2.0 * a;
    } else {
      EXPECT_TRUE(size >> b) << line;
    }
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
  std::string map = name;
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
      {"pool_obstacles_visual_inertial",
       {25, 15, 4},
       {{"columns/south", "columns/north", kNorth, 0}},
       "pool_obstacles"},
      {"pool_diver_visual_inertial", {25, 15, 4}, {}, "pool_diver"},
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
    solids_ = solids_of(GetParam().map);
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
  const bool is_online = name.ends_with("_visual_inertial");
  if (name != "pool1" && name != "pool3" && !is_online) GTEST_SKIP() << "free to roll";
  double pitch = 0.0;
  for (const PoseOnPath& pose : path_) {
    EXPECT_NEAR(pose.roll() / kDegree, 0.0, 0.5) << pose.p_W.transpose();
    pitch = std::max(pitch, std::abs(pose.pitch()) / kDegree);
  }
  if (name != "pool3") {
    EXPECT_LT(pitch, 0.5) << "its cameras face the floor";
  } else {
    EXPECT_GT(pitch, 10.0) << "it follows the slope of its path";
  }
}

// For a mission without a map it says that its proofs are for the simulated world.
TEST_P(PaperEnvironments, TheCheckHasNothingToSay) {
  const std::string& name = GetParam().name;
  const Ran ran = testing::run_dive(
      fmt::format("check --static --json '{}/missions/{}.xml'", DIVE_SOURCE_DIR, name), name);
  EXPECT_EQ(ran.status, 0) << ran.err;
  const auto diagnostics = nlohmann::json::parse(ran.out).at("diagnostics");
  if (!name.ends_with("_visual_inertial")) {
    EXPECT_TRUE(diagnostics.empty()) << ran.out;
    return;
  }
  ASSERT_EQ(diagnostics.size(), 1u) << ran.out;
  EXPECT_EQ(diagnostics[0].at("code"), "CHK-UNKNOWN-ENVIRONMENT");
}

// ---- The pools without a known map. ----

const Vector3d kOnlineStart(3, 0, -1.8);
const Vector3d kOnlineGoal(21, 0, -1.8);

/// Mission and its simulated world.
using OnlinePool = std::pair<std::string, std::string>;

class OnlinePools : public ::testing::TestWithParam<OnlinePool> {
 protected:
  [[nodiscard]] static std::string file(const std::string& folder, const std::string& name) {
    return fmt::format("{}/missions/{}{}.xml", DIVE_SOURCE_DIR, folder, name);
  }
};

TEST_P(OnlinePools, AreKnownToTheSimulatorAlone) {
  const auto& [name, map] = GetParam();
  Diagnostics diagnostics;
  const auto mission = load_mission(file("", name), diagnostics);
  ASSERT_TRUE(mission);
  EXPECT_TRUE(mission->unknown);
  EXPECT_TRUE(maps_with_stereo(*mission));
  EXPECT_TRUE(uses_visual_inertial(*mission));
  EXPECT_EQ(mission->map_file.value, fmt::format("maps/{}.sdf", map));
  EXPECT_EQ(mission->limits.clearance.value, kDMin);
  EXPECT_EQ(mission->start.in_world({}), kOnlineStart);
}

// Within 2.5 m of every place of the line, where the cameras that look down see them.
TEST_P(OnlinePools, HaveToysOnTheFloorAlongTheLine) {
  const Solids solids = solids_of(GetParam().second);
  const double floor = edge(solids, "pool/floor", kUp, 1.0);
  std::vector<Vector3d> toys;
  for (const auto& [name, toy] : solids) {
    if (!name.starts_with("toys/")) continue;
    toys.push_back(toy.p_W);
    EXPECT_NEAR(edge(solids, name, kUp, -1.0), floor, 1e-3) << name;
    EXPECT_LT(edge(solids, name, kUp, 1.0), floor + 0.45) << name;
  }
  for (double x = kOnlineStart.x(); x <= kOnlineGoal.x(); x += 0.5) {
    const auto near = std::ranges::count_if(
        toys, [x](const Vector3d& p_W) { return std::hypot(p_W.x() - x, p_W.y()) < 2.5; });
    EXPECT_GE(near, 5) << "at x = " << x;
  }
}

// Paths may leave the depth of start and goal by 0.1 m (max_depth_change); three sigmas of the
// depth sensor's bias are another 0.09 m. The estimate ends at the goal; the vehicle ends as near
// to the estimate as the published covariance says (99.9 % of two axes).
TEST_P(OnlinePools, AreDivedAtConstantDepthClearOfEverything) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive of a minute with images");
  DIVE_SKIP_LONG_TEST();
  constexpr double kTolerance = 0.2;  // m
  const auto& [name, map] = GetParam();
  const std::string scenario = "shipped_" + name;
  const std::string kept = fmt::format("{}dive-command/{}/kept", ::testing::TempDir(), name);
  std::filesystem::remove_all(kept);
  const Ran ran = testing::run_dive(
      fmt::format("test --keep-all --keep kept '{}'", file("scenarios/", scenario)), name);
  ASSERT_EQ(ran.status, 0) << ran.out << ran.err;
  auto log = LogReader::open(fmt::format("{}/{}.lcmlog", kept, scenario));
  ASSERT_TRUE(log) << log.error();
  std::vector<PoseOnPath> track;
  estimation::StateEstimate estimate;
  for (int i = 0; const auto tick = log->next(); ++i) {
    if (tick->outputs.status.state != "swim" || i % 5 != 0) continue;
    track.push_back({tick->truth->X_WB.p, tick->truth->X_WB.q});
    estimate = tick->outputs.estimate;
  }
  ASSERT_GT(track.size(), 500u);
  for (const PoseOnPath& pose : track) {
    ASSERT_NEAR(pose.p_W.z(), kOnlineStart.z(), kTolerance) << "at " << pose.p_W.transpose();
  }
  EXPECT_LT((estimate.X_WB.p - kOnlineGoal).norm(), 0.5);
  const Vector2d error = (track.back().p_W - estimate.X_WB.p).head<2>();
  EXPECT_LT(error.dot(estimate.covariance.topLeftCorner<2, 2>().inverse() * error), 13.8)
      << error.transpose();
  const Solids solids = solids_of(map);
  EXPECT_GT(clearance(track, solids), 0.5 * kDMin) << "as CHK-DIVE-CLEARANCE asks";
  if (map != "pool_obstacles") return;
  const double x = solids.at("columns/north").p_W.x();
  const auto there =
      std::ranges::find_if(track, [x](const PoseOnPath& pose) { return pose.p_W.x() > x; });
  EXPECT_LT(there->p_W.y(), edge(solids, "columns/north", kNorth, -1.0));
  EXPECT_GT(there->p_W.y(), edge(solids, "columns/south", kNorth, 1.0));
}

INSTANTIATE_TEST_SUITE_P(Missions, OnlinePools,
                         ::testing::Values(OnlinePool{"pool_obstacles_visual_inertial",
                                                      "pool_obstacles"},
                                           OnlinePool{"pool_diver_visual_inertial", "pool_diver"}),
                         [](const auto& each) { return each.param.first; });

// A vehicle that does not map them hits one: its hull is wider than the line's distance.
TEST(OnlinePoolWithObstacles, HasTwoUprightColumnsAndTheLineMeetsOne) {
  const Solids solids = solids_of("pool_obstacles");
  int columns = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [name, solid] : solids) {
    if (!name.starts_with("columns/")) continue;
    ++columns;
    EXPECT_FALSE(solid.is_box);
    EXPECT_LT((solid.R_WS * kUp - kUp).norm(), 1e-6) << name << " is not upright";
    EXPECT_LE(edge(solids, name, kUp, -1.0), -4.0) << name;
    EXPECT_GE(edge(solids, name, kUp, 1.0), 0.0) << name;
    nearest = std::min(nearest, std::abs(solid.p_W.y()) - solid.half.x());
    EXPECT_GT(solid.p_W.x(), kOnlineStart.x() + 5.0);
    EXPECT_LT(solid.p_W.x(), kOnlineGoal.x() - 5.0);
  }
  EXPECT_EQ(columns, 2);
  EXPECT_LT(nearest, 0.44 / 2);
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
