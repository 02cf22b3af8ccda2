// `dive plan --cloud`: through rooms of points written by the tests, in several coordinate systems.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/sanitizers.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

using Point = std::array<double, 3>;
using testing::own_folder;
using testing::Ran;
using testing::run_here;

/// Two rooms, 8 m x 6 m x 3 m in total, and a door between them at x = 4, y from 3.5 to 5.2.
std::vector<Point> rooms() {
  constexpr double kStep = 0.1;
  std::vector<Point> points;
  for (int i = 0; i <= 80; ++i) {
    for (int j = 0; j <= 60; ++j) {
      points.push_back({kStep * i, kStep * j, 0.0});
      points.push_back({kStep * i, kStep * j, 3.0});
    }
  }
  for (int k = 1; k < 30; ++k) {
    for (int i = 0; i <= 80; ++i) {
      points.push_back({kStep * i, 0.0, kStep * k});
      points.push_back({kStep * i, 6.0, kStep * k});
    }
    for (int j = 0; j <= 60; ++j) {
      points.push_back({0.0, kStep * j, kStep * k});
      points.push_back({8.0, kStep * j, kStep * k});
      if (j <= 35 || j >= 52) points.push_back({4.0, kStep * j, kStep * k});
    }
  }
  return points;
}

/// Writes the points to the own folder, in the given units per metre, with `origin` (m) added.
void write_points(const std::string& name, const std::vector<Point>& points, const Point& origin,
                  double units = 1.0) {
  std::ofstream file(own_folder() / name);
  file << "ply\nformat ascii 1.0\nelement vertex " << points.size()
       << "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  for (const Point& p : points) {
    file << fmt::format("{:.3f} {:.3f} {:.3f}\n", units * (p[0] + origin[0]),
                        units * (p[1] + origin[1]), units * (p[2] + origin[2]));
  }
}

std::string at(const Point& p, const Point& origin) {
  return fmt::format("{:.3f},{:.3f},{:.3f}", p[0] + origin[0], p[1] + origin[1], p[2] + origin[2]);
}

constexpr Point kHere{1.0, 1.0, 1.5};
constexpr Point kThere{7.0, 1.0, 1.5};

/// From one room to the other; the path must lead through the door and never come near a point.
void plan_through_the_door(const std::string& file, const std::vector<Point>& points,
                           const Point& origin, const std::string& more = {}) {
  const Ran ran = run_here("plan --json --clearance 0.3 --cloud " + file + " --start " +
                           at(kHere, origin) + " --goal " + at(kThere, origin) + more);
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "success");
  for (const char* key : {"reason", "clearance_m", "length_m", "time_ms", "warm_starts"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_GE(json.at("clearance_m").get<double>(), 0.3);
  const auto& waypoints = json.at("waypoints");
  ASSERT_GE(waypoints.size(), 3U);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    EXPECT_NEAR(waypoints.front().at(a).get<double>(), kHere[a] + origin[a], 1e-6);
    EXPECT_NEAR(waypoints.back().at(a).get<double>(), kThere[a] + origin[a], 1e-6);
  }
  bool through_door = false;
  double nearest = 1e9;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    for (int s = 0; s <= 50; ++s) {
      Point p{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double from = waypoints.at(i - 1).at(a).get<double>() - origin[a];
        const double to = waypoints.at(i).at(a).get<double>() - origin[a];
        p[a] = from + (to - from) * s / 50.0;
      }
      through_door |= std::abs(p[0] - 4.0) < 0.05 && p[1] > 3.5 && p[1] < 5.2;
      for (const Point& q : points) {
        nearest = std::min(nearest, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
      }
    }
  }
  EXPECT_TRUE(through_door);
  // The hull extends beyond the vehicle's centre in every attitude.
  EXPECT_GT(nearest, 0.3 + 0.05);
}

TEST(PlanCloud, FindsTheDoorInAir) {
  write_points("rooms.ply", rooms(), {0.0, 0.0, 0.0});
  plan_through_the_door("rooms.ply", rooms(), {0.0, 0.0, 0.0}, " --svg rooms.svg");
  const Ran ran = run_here("plan --cloud rooms.ply --start 1,1,1.5 --goal 7,1,1.5 --clearance 0.3");
  EXPECT_EQ(ran.status, 0);
  EXPECT_THAT(ran.out, HasSubstr("certified clearance"));
  EXPECT_THAT(ran.err, HasSubstr("not taken for the surface"));
  EXPECT_THAT(ran.err, HasSubstr("taken to be metres"));
}

TEST(PlanCloud, KeepsTheDigitsOfUtm) {
  const Point origin{512'345.0, 6'712'345.0, -20.0};
  write_points("utm.ply", rooms(), origin);
  plan_through_the_door("utm.ply", rooms(), origin);
  const Ran ran = run_here("plan --cloud utm.ply --start 1,1,-18.5 --goal 7,1,-18.5");
  EXPECT_EQ(ran.status, 2) << "poses in other axes";
  EXPECT_THAT(ran.err, HasSubstr("km away"));
  EXPECT_THAT(ran.err, HasSubstr("512345.0"));
}

TEST(PlanCloud, TakesMillimetresAsToldAndAsTheyLook) {
  write_points("mm.ply", rooms(), {0.0, 0.0, -9.0}, 1000.0);
  plan_through_the_door("mm.ply", rooms(), {0.0, 0.0, -9.0}, " --unit mm");
  plan_through_the_door("mm.ply", rooms(), {0.0, 0.0, -9.0});
}

TEST(PlanCloud, TheSurfaceBoundsWhatLiesBelowIt) {
  // A wall from the bed to just below the surface: the only path leads round its end.
  std::vector<Point> wall;
  for (int j = 0; j <= 100; ++j) {
    for (int k = 0; k <= 58; ++k) wall.push_back({5.0, 0.1 * j, -6.0 + 0.1 * k});
    for (int i = 0; i <= 100; ++i) wall.push_back({0.1 * i, 0.1 * j, -6.0});
  }
  write_points("wall.ply", wall, {0.0, 0.0, 0.0});
  const Ran ran = run_here("plan --json --cloud wall.ply --start 2,2,-3 --goal 8,2,-3");
  ASSERT_EQ(ran.status, 0) << ran.err << ran.out;
  const auto json = nlohmann::json::parse(ran.out);
  for (const auto& waypoint : json.at("waypoints")) {
    EXPECT_LT(waypoint.at(2).get<double>(), -0.5) << json.at("waypoints");
  }
  EXPECT_EQ(run_here("plan --cloud wall.ply --start 2,2,-3 --goal 8,2,-5 --max-depth 4").status, 2);
}

TEST(PlanCloud, LeavesOutWhatIsFarOnlyWhileThePathStaysAway) {
  DIVE_SKIP_UNDER_SANITIZERS("two large plans, and small ones take the same steps");
  // A bed 90 m square, and across it a wall up to the surface. The path round its end leaves the
  // neighbourhood of start and goal, where a second wall must not be omitted.
  std::vector<Point> points;
  for (int i = 0; i < 600; ++i) {
    for (int j = 0; j < 600; ++j) points.push_back({0.15 * i, 0.15 * j, -12.0});
  }
  for (int k = 0; k < 80; ++k) {
    for (int j = 0; j < 530; ++j) points.push_back({45.0, 0.15 * j, -12.0 + 0.15 * k});
    for (int i = 0; i < 30; ++i) points.push_back({42.75 + 0.15 * i, 83.0, -12.0 + 0.15 * k});
  }
  write_points("wide.ply", points, {0.0, 0.0, 0.0});
  const Ran ran = run_here("plan --json --cloud wide.ply --start 42,45,-9 --goal 48,45,-9");
  ASSERT_EQ(ran.status, 0) << ran.err << ran.out;
  const auto json = nlohmann::json::parse(ran.out);
  bool round_the_end = false;
  const auto& waypoints = json.at("waypoints");
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    for (int s = 0; s <= 20; ++s) {
      const auto along = [&](std::size_t axis) {
        const double from = waypoints.at(i - 1).at(axis).get<double>();
        return from + (waypoints.at(i).at(axis).get<double>() - from) * s / 20.0;
      };
      const double x = along(0);
      const double y = along(1);
      round_the_end |= y > 79.5;
      EXPECT_GT(std::hypot(x - 45.0, std::max(0.0, y - 79.35)), 0.6) << x << ' ' << y;
      EXPECT_GT(std::hypot(std::max(std::abs(x - 44.9) - 2.1, 0.0), y - 83.0), 0.6);
    }
  }
  EXPECT_TRUE(round_the_end);
  // A path that stays near is planned with the neighbourhood only.
  const Ran near = run_here("plan --cloud wide.ply --start 30,30,-9 --goal 36,30,-9");
  EXPECT_EQ(near.status, 0) << near.err;
  EXPECT_THAT(near.err, HasSubstr("left out"));
}

TEST(PlanCloud, AStartInThePointsIsRefusedByName) {
  write_points("rooms.ply", rooms(), {0.0, 0.0, -9.0});
  const Ran ran = run_here("plan --json --cloud rooms.ply --start 4,1,-7.5 --goal 7,1,-7.5");
  EXPECT_EQ(ran.status, 2);
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json.at("status"), "invalid");
  EXPECT_THAT(json.at("reason").get<std::string>(), HasSubstr("in collision with cloud at 4.0,"));
}

TEST(PlanCloud, WrongUsageAndUnreadableFilesAreTwo) {
  const std::string poses = " --start 1,1,-2 --goal 7,1,-2";
  write_points("rooms.ply", rooms(), {0.0, 0.0, 0.0});
  write_points("empty.ply", {}, {0.0, 0.0, 0.0});
  const std::string self = std::string(" '") + DIVE_SOURCE_DIR + "/missions/pool3.xml'";
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"plan --cloud nowhere.pcd" + poses, "nowhere.pcd: it cannot be opened: no such file"},
      {"plan --cloud" + self + poses, "this is a mission, not a point cloud"},
      {"plan --cloud empty.ply" + poses, "empty.ply"},
      {"plan --cloud rooms.ply --start 1,1,1", "--start and --goal"},
      {"plan --cloud rooms.ply --map a.sdf" + poses, "not several"},
      {"plan --cloud rooms.ply" + self + poses, "not several"},
      {"plan --unit mm --map a.sdf" + poses, "--unit"},
      {"plan --cloud rooms.ply --unit furlong" + poses, "furlong"},
      {"plan --cloud rooms.ply --max-depth 10" + poses, "--max-depth"},
      {"plan", "--cloud"}};
  for (const auto& [arguments, complaint] : wrong) {
    const Ran ran = run_here(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_EQ(ran.out, "") << arguments;
    EXPECT_THAT(ran.err, HasSubstr(complaint)) << arguments;
  }
  EXPECT_THAT(run_here("plan --help").out, HasSubstr("dive plan --cloud"));
}

}  // namespace
}  // namespace dive::mission
