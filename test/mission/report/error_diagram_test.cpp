// The error of every shipped mission's dive: the true position stays nearer to the line p_{i-1} p_i
// than the clearance that the mission asks for. It is taken in the map, with which the obstacles
// are shifted and turned: after 200 m, a map turned by a third of a degree is a metre off. Without
// a map a plan is made in what the vehicle has observed, so the error is what has come since then.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <regex>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mission/document/mission.h"
#include "mission/record/log.h"
#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"
#include "test/mission/cli/run_command.h"
#include "test/mission/report/report_dive.h"
#include "test/mission/report/written_page.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> shipped_missions() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fmt::format("{}/missions", DIVE_SOURCE_DIR))) {
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

/// D_min of a mission, from its text, m.
double d_min(const std::string& path) {
  const std::string text = testing::content_of(path);
  std::smatch found;
  const std::regex limits(R"re(<limits[^>]*\sclearance="([0-9.]+)")re");
  if (!std::regex_search(text, found, limits)) throw std::runtime_error(path + " has no clearance");
  return std::stod(found[1]);
}

/// The segment followed at each control tick of 20 ms.
std::map<long, int> segments_of(const std::string& path) {
  std::map<long, int> segments;
  auto log = LogReader::open(path);
  if (!log) throw std::runtime_error(log.error());
  while (const auto tick = log->next()) {
    segments[std::lround(to_seconds(tick->inputs.now) * 50.0)] = tick->outputs.status.segment;
  }
  return segments;
}

Eigen::Vector3d point(const std::vector<float>& list, std::size_t first) {
  return Eigen::Vector3f(list.at(first), list.at(first + 1), list.at(first + 2)).cast<double>();
}

/// About the vertical, rad, of a quaternion x, y, z, w in any unit.
double heading(const std::vector<std::int16_t>& list, std::size_t first) {
  const Eigen::Quaterniond q(list.at(first + 3), list.at(first), list.at(first + 1),
                             list.at(first + 2));
  const Eigen::Vector3d bow = q.normalized() * Eigen::Vector3d::UnitX();
  return std::atan2(bow.y(), bow.x());
}

class ErrorDiagram : public ::testing::TestWithParam<std::string> {};

TEST_P(ErrorDiagram, TheTruePositionStaysWithinDMinOfTheLine) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive of minutes");
  const std::string& name = GetParam();
  const bool takes_minutes = name.ends_with("_unknown") || name.ends_with("_visual_inertial");
  if (takes_minutes) DIVE_SKIP_LONG_TEST();
  const std::string path = fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, name);
  Diagnostics diagnostics;
  const auto mission = load_mission(path, diagnostics);
  ASSERT_TRUE(mission);
  const std::string diver =
      name == "pool_diver_visual_inertial" ? "--diver 5:20,0.2,-1.8:2,0.2,-1.8" : "";
  const testing::ReportedDive dived = testing::dive_and_report(fmt::format("'{}' {}", path, diver));
  EXPECT_EQ(dived.run.at("outcome"), "success");
  const std::map<long, int> segments = segments_of(dived.log);
  const auto data = testing::data_of(dived.page);
  const auto& samples = data.at("dive").at("samples");
  const std::vector<float> believed = testing::floats_of(samples.at("position"));
  const std::vector<std::int16_t> attitude = testing::shorts_of(samples.at("true_attitude"));
  const std::vector<std::int16_t> believed_attitude = testing::shorts_of(samples.at("attitude"));
  const bool has_map = !mission->unknown;
  const std::vector<float> t = testing::floats_of(samples.at("t"));
  const std::vector<float> position = testing::floats_of(samples.at("true_position"));
  const std::vector<float> shown = testing::floats_of(samples.at("true_cross_track"));
  const std::vector<std::int16_t> plan = testing::shorts_of(samples.at("path"));
  std::vector<std::vector<float>> paths;
  for (const auto& each : data.at("paths")) {
    paths.push_back(testing::floats_of(each.at("waypoints")));
  }
  std::size_t known = 0;
  double farthest = 0.0;
  float when = 0.0F;
  std::int16_t last_plan = -1;
  Pose observed_from_world;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (std::isnan(shown[i])) continue;
    ++known;
    const std::vector<float>& waypoints = paths.at(static_cast<std::size_t>(plan[i]));
    const auto segment = static_cast<std::size_t>(segments.at(std::lround(t[i] * 50.0F)));
    const Eigen::Vector3d a = point(waypoints, 7 * (segment - 1));
    const Eigen::Vector3d line = (point(waypoints, 7 * segment) - a).normalized();
    const Eigen::Vector3d truth = point(position, 3 * i);
    if (plan[i] != last_plan) {
      const double turned = heading(believed_attitude, 4 * i) - heading(attitude, 4 * i);
      observed_from_world.q = Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitZ());
      observed_from_world.p = point(believed, 3 * i) - observed_from_world.q * truth;
    }
    last_plan = plan[i];
    const Eigen::Vector3d in_map = has_map ? truth : observed_from_world * truth;
    const double error = line.cross(in_map - a).norm();
    if (error > farthest) when = t[i];
    farthest = std::max(farthest, error);
  }
  ASSERT_GT(known, 100U);
  EXPECT_LT(farthest, d_min(path)) << "at " << when << " s";
  RecordProperty("farthest_m", std::to_string(farthest));
}

INSTANTIATE_TEST_SUITE_P(Missions, ErrorDiagram, ::testing::ValuesIn(shipped_missions()),
                         [](const auto& each) { return each.param; });

}  // namespace
}  // namespace dive::mission
