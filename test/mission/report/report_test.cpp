// The contents of reports, compared with what the dive itself printed and with its log.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/record/log.h"
#include "mission/report/clearances.h"
#include "mission/report/sample_list.h"
#include "test/mission/cli/run_command.h"
#include "test/mission/report/report_dive.h"
#include "test/mission/report/written_page.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using testing::data_of;
using testing::dive_and_report;
using testing::floats_of;
using ::testing::HasSubstr;
using testing::ReportedDive;
using testing::rewrite_log;
using testing::shorts_of;

const std::string kWindow = "'" DIVE_SOURCE_DIR "/missions/window.xml'";
const std::string kQuay = "'" DIVE_SOURCE_DIR "/test/mission/collision/quay.xml' --seed 2";

testing::Ran dive(const std::string& arguments) {
  const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();
  return testing::run_dive(arguments, test.name());
}

void expect_near(const json& a, const json& b, double tolerance, const char* what) {
  EXPECT_EQ(a.is_null(), b.is_null()) << what;
  if (!a.is_null() && !b.is_null()) {
    EXPECT_NEAR(a.get<double>(), b.get<double>(), tolerance) << what;
  }
}

/// The verdict of the report is that of the dive.
void expect_same_verdict(const json& verdict, const json& run) {
  for (const char* key : {"outcome", "final_state", "cause", "plans", "replans"}) {
    EXPECT_EQ(verdict.at(key), run.at(key)) << key;
  }
  expect_near(verdict.at("duration_s"), run.at("duration_s"), 1e-6, "duration");
  expect_near(verdict.at("distance_m"), run.at("distance_m"), 0.01, "distance");
  expect_near(verdict.at("final_error_m"), run.at("final_error_m"), 1e-9, "error");
  expect_near(verdict.at("final_sigma_m"), run.at("final_sigma_m"), 1e-9, "sigma");
  const json& nearest = verdict.at("nearest");
  expect_near(nearest.at("clearance_m"), run.at("min_clearance_m"), 1e-12, "clearance");
  EXPECT_EQ(nearest.at("obstacle"), run.at("nearest").at("obstacle"));
  expect_near(nearest.at("t"), run.at("nearest").at("t"), 1e-6, "time of the least clearance");
  expect_near(nearest.at("position").at(0), run.at("nearest").at("x"), 1e-9, "its place");
}

TEST(Report, HasTheVerdictOfASuccessAndOfAnAbort) {
  const ReportedDive success = dive_and_report(kWindow);
  EXPECT_EQ(success.run.at("outcome"), "success");
  expect_same_verdict(data_of(success.page).at("dive").at("verdict"), success.run);
  const ReportedDive aborted = dive_and_report(kWindow + " --leak-at 40");
  EXPECT_EQ(aborted.run.at("outcome"), "aborted");
  const json dive_data = data_of(aborted.page).at("dive");
  expect_same_verdict(dive_data.at("verdict"), aborted.run);
  EXPECT_EQ(dive_data.at("rerun_problem"), "");
  json transitions = dive_data.at("transitions");
  ASSERT_EQ(transitions.size(), aborted.run.at("transitions").size());
  for (std::size_t i = 0; i < transitions.size(); ++i) {
    const json& expected = aborted.run.at("transitions").at(i);
    EXPECT_EQ(transitions[i].at("to"), expected.at("to"));
    expect_near(transitions[i].at("t"), expected.at("t"), 1e-6, "time of a transition");
  }
}

TEST(Report, MarksEveryCollision) {
  const ReportedDive dived = dive_and_report(kQuay + " --set current_y=0.15");
  const json dive_data = data_of(dived.page).at("dive");
  expect_same_verdict(dive_data.at("verdict"), dived.run);
  const json& marks = dive_data.at("verdict").at("collisions");
  const json& expected = dived.run.at("collision_list");
  ASSERT_FALSE(expected.empty());
  ASSERT_EQ(marks.size(), expected.size());
  for (std::size_t i = 0; i < marks.size(); ++i) {
    EXPECT_EQ(marks[i].at("obstacle"), expected[i].at("obstacle"));
    expect_near(marks[i].at("t"), expected[i].at("t"), 1e-6, "time");
    expect_near(marks[i].at("position").at(1), expected[i].at("y"), 1e-9, "place");
    expect_near(marks[i].at("estimate").at("error_m"), expected[i].at("error_m"), 1e-9, "error");
  }
}

/// A tick of the log, by its time in steps of 20 ms.
struct LoggedError {
  int segment = 0;
  double cross_track_m = 0.0;
  bool is_following = false;  ///< Its distance was computed in this tick.
};

// With the cross product, from the positions and waypoints in the page and the segments in the log.
TEST(Report, ErrorsAreTheDistancesToTheLineBetweenLocalGoals) {
  const ReportedDive dived = dive_and_report(kWindow);
  std::map<long, LoggedError> logged;
  auto log = LogReader::open(dived.log);
  ASSERT_TRUE(log) << log.error();
  double last_m = 0.0;
  while (const auto tick = log->next()) {
    const Status& status = tick->outputs.status;
    const double error_m = status.cross_track_m;
    logged[std::lround(to_seconds(tick->inputs.now) * 50.0)] = {
        status.segment, error_m, error_m != 0.0 && error_m != last_m};
    last_m = error_m;
  }
  const json data = data_of(dived.page);
  const json& samples = data.at("dive").at("samples");
  const std::vector<float> t = floats_of(samples.at("t"));
  const std::vector<float> position = floats_of(samples.at("true_position"));
  const std::vector<float> true_error = floats_of(samples.at("true_cross_track"));
  const std::vector<float> error = floats_of(samples.at("cross_track"));
  const std::vector<std::int16_t> path = shorts_of(samples.at("path"));
  ASSERT_EQ(true_error.size(), t.size());
  std::size_t compared = 0;
  std::size_t following = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const LoggedError& tick = logged.at(std::lround(t[i] * 50.0F));
    if (tick.is_following) {
      ++following;
      EXPECT_NEAR(error[i], tick.cross_track_m, 1e-5);
    } else {
      EXPECT_TRUE(std::isnan(error[i])) << "at " << t[i] << " s";
    }
    if (std::isnan(true_error[i])) continue;
    const std::vector<float> waypoints =
        floats_of(data.at("paths").at(static_cast<std::size_t>(path[i])).at("waypoints"));
    const auto at = [](const std::vector<float>& list, std::size_t first) {
      return Eigen::Vector3d(list.at(first), list.at(first + 1), list.at(first + 2));
    };
    const auto segment = static_cast<std::size_t>(tick.segment);
    const Eigen::Vector3d a = at(waypoints, 7 * (segment - 1));
    const Eigen::Vector3d b = at(waypoints, 7 * segment);
    const double distance = (at(position, 3 * i) - a).cross(b - a).norm() / (b - a).norm();
    EXPECT_NEAR(true_error[i], distance, 2e-5) << "at " << t[i] << " s";
    ++compared;
  }
  EXPECT_GT(compared, 500U);
  EXPECT_EQ(compared, following) << "every followed path is known";
}

TEST(Report, InventsNothingWithoutGroundTruthAndWithTheClockOfAVehicle) {
  const ReportedDive dived = dive_and_report(kWindow);
  constexpr Utime kClock = 1'700'000'000'000'000;
  rewrite_log(
      dived.log, dived.folder + "/vehicle.lcmlog", [](LogHeader&) {},
      [&](LoggedTick& tick) {
        tick.truth.reset();
        tick.inputs.now += kClock;
        if (tick.inputs.imu) tick.inputs.imu->utime += kClock;
        if (tick.inputs.depth) tick.inputs.depth->utime += kClock;
        if (tick.inputs.health) tick.inputs.health->utime += kClock;
      });
  const testing::Ran ran = dive("report vehicle.lcmlog --output vehicle.html");
  EXPECT_EQ(ran.status, 0) << ran.err;
  const json data = data_of(testing::content_of(dived.folder + "/vehicle.html")).at("dive");
  const json& verdict = data.at("verdict");
  EXPECT_EQ(verdict.at("has_truth"), false);
  EXPECT_TRUE(verdict.at("nearest").is_null());
  EXPECT_TRUE(verdict.at("final_error_m").is_null());
  EXPECT_TRUE(verdict.at("collisions").empty());
  EXPECT_TRUE(data.at("near_misses").empty());
  EXPECT_FALSE(verdict.at("final_sigma_m").is_null());
  expect_near(verdict.at("duration_s"), dived.run.at("duration_s"), 1e-6, "duration");
  EXPECT_EQ(verdict.at("outcome"), "success");
  for (const float value : floats_of(data.at("samples").at("true_position"))) {
    ASSERT_TRUE(std::isnan(value));
  }
  const std::vector<float> t = floats_of(data.at("samples").at("t"));
  EXPECT_NEAR(t.back(), dived.run.at("duration_s").get<double>(), 0.2);
  EXPECT_NEAR(data.at("events").back().at("t").get<double>(), t.back(), 0.2);
}

TEST(Report, OfALogThatWasCutOffGoesUpToTheCutAndTellsIt) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string content = testing::content_of(dived.log);
  const auto cut = [&](std::size_t size) {
    std::ofstream(dived.folder + "/cut.lcmlog", std::ios::binary) << content.substr(0, size);
    return dive("report cut.lcmlog --output cut.html --force");
  };
  const testing::Ran half = cut(content.size() / 2);
  EXPECT_EQ(half.status, 0);
  EXPECT_THAT(half.err, HasSubstr("the log is torn"));
  const json verdict =
      data_of(testing::content_of(dived.folder + "/cut.html")).at("dive").at("verdict");
  EXPECT_EQ(verdict.at("outcome"), "failure");
  EXPECT_THAT(verdict.at("cause").get<std::string>(), HasSubstr("still in state"));
  EXPECT_LT(verdict.at("duration_s").get<double>(), dived.run.at("duration_s").get<double>());

  fs::remove(dived.folder + "/cut.html");
  for (const std::size_t size : {std::size_t{0}, std::size_t{100}}) {
    const testing::Ran ran = cut(size);
    EXPECT_EQ(ran.status, 2) << size;
    EXPECT_THAT(ran.err, HasSubstr("cut.lcmlog")) << size;
    EXPECT_FALSE(fs::exists(dived.folder + "/cut.html")) << size;
  }
}

TEST(Report, OfADamagedLogHasItsGap) {
  const ReportedDive dived = dive_and_report(kWindow);
  std::string content = testing::content_of(dived.log);
  for (std::size_t i = 0; i < 5000; ++i) content[content.size() / 3 + i] ^= 0x55;
  std::ofstream(dived.folder + "/damaged.lcmlog", std::ios::binary) << content;
  const testing::Ran ran = dive("report damaged.lcmlog --output damaged.html");
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("1 gap(s)"));
  const json data = data_of(testing::content_of(dived.folder + "/damaged.html")).at("dive");
  ASSERT_EQ(data.at("gaps").size(), 1U);
  EXPECT_EQ(data.at("rerun_problem"), "the log is damaged");
  EXPECT_NEAR(data.at("rerun_until_s").get<double>(),
              data.at("gaps").at(0).at("from_s").get<double>(), 0.1);
  // The end is still known.
  EXPECT_EQ(data.at("verdict").at("outcome"), "success");
}

TEST(Report, IsNotMadeOfOtherFiles) {
  const testing::Ran map = dive("report '" DIVE_SOURCE_DIR "/missions/maps/window.sdf' --output a");
  EXPECT_EQ(map.status, 2);
  EXPECT_THAT(map.err, HasSubstr("this is a map: a report needs a log, or a mission"));
  const testing::Ran missing = dive("report nothing.lcmlog --output a");
  EXPECT_EQ(missing.status, 2);
  EXPECT_THAT(missing.err, HasSubstr("cannot read 'nothing.lcmlog': no such file"));
  EXPECT_FALSE(fs::exists(testing::folder_of_test() + "/a"));
}

TEST(Report, OfALogIsNeverWrittenOverTheLog) {
  const ReportedDive dived = dive_and_report(kWindow);
  const std::string before = testing::content_of(dived.log);
  const testing::Ran ran = dive("report dive.lcmlog --output dive.lcmlog --force");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("dive.lcmlog"));
  EXPECT_TRUE(testing::content_of(dived.log) == before);
}

TEST(Report, OfAPlanHasTheLegsOfDivePlan) {
  const testing::Ran planned = dive("plan " + kWindow + " --json");
  ASSERT_EQ(planned.status, 0) << planned.err;
  const testing::Ran ran = dive("report " + kWindow + " --output plan.html --force");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const json data = data_of(testing::content_of(testing::folder_of_test() + "/plan.html"));
  EXPECT_TRUE(data.at("dive").is_null());
  const json plans = json::parse(planned.out).at("plans");
  ASSERT_EQ(data.at("paths").size(), plans.size());
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const json& path = data.at("paths").at(i);
    EXPECT_EQ(path.at("goal"), plans[i].at("goal"));
    EXPECT_EQ(path.at("clearance_m"), plans[i].at("clearance_m"));
    EXPECT_EQ(floats_of(path.at("waypoints")).size(), 7 * plans[i].at("waypoints").size());
  }
}

// Texts of a mission and a map may be anything that XML can contain.
TEST(Report, TextsCannotBecomeMarkup) {
  const std::string folder = testing::folder_of_test();
  const std::string evil = "</script><!--<script>alert(\"1\")</script>'&";
  const std::string evil_xml =
      "&lt;/script>&lt;!--&lt;script>alert(&quot;1&quot;)&lt;/script>'&amp;";
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const std::string source = DIVE_SOURCE_DIR "/test/mission/collision/";
  fs::create_directories(folder + "/maps");
  std::ofstream(folder + "/maps/quay.sdf")
      << replaced(testing::content_of(source + "maps/quay.sdf"), "name=\"harbour\"",
                  "name=\"" + evil_xml + "\"");
  const std::string name = "a<b>\"&.xml";
  std::ofstream(fs::path(folder) / name)
      << replaced(testing::content_of(source + "quay.xml"), "Along a quay", evil_xml);
  const ReportedDive dived = dive_and_report("'" + name + "'");
  const json data = data_of(dived.page);
  EXPECT_THAT(data.at("description").get<std::string>(), HasSubstr(evil));
  EXPECT_EQ(data.at("files").at(0).at("name"), name);
  EXPECT_EQ(data.at("map").at("shapes").at(0).at("name"), evil + "/ground/seabed");
  EXPECT_EQ(testing::count_of(dived.page, "<script>alert"), 0U);
  const ReportedDive plain = dive_and_report(kQuay);
  EXPECT_EQ(testing::count_of(dived.page, "<script"), testing::count_of(plain.page, "<script"));
  EXPECT_EQ(testing::count_of(dived.page, "<!--"), testing::count_of(plain.page, "<!--"));
}

TEST(Report, FindsNearMissesOnceEachWithTheirObstacle) {
  planning::World world;
  for (const double x : {0.0, 10.0}) {
    planning::Obstacle post;
    post.name = x == 0.0 ? "first" : "second";
    post.shape = planning::Box{{1.0, 1.0, 10.0}};
    post.X_WO.p = {x, 0.0, -5.0};
    world.obstacles.push_back(post);
  }
  planning::RobotHull hull;
  planning::ConvexSolid cube{"cube", {}};
  for (int i = 0; i < 8; ++i) {
    cube.vertices.emplace_back((i & 1) != 0 ? 0.1 : -0.1, (i & 2) != 0 ? 0.1 : -0.1,
                               (i & 4) != 0 ? 0.1 : -0.1);
  }
  hull.parts.push_back(cube);
  // Passes the first post 0.2 m from its face, and the second 0.5 m.
  std::vector<DiveSample> samples;
  for (int i = 0; i <= 300; ++i) {
    DiveSample sample;
    sample.t_s = 0.1 * i;
    const double x = -5.0 + 0.07 * i;
    sample.truth = Pose{{x, x < 5.0 ? 0.8 : 1.1, -5.0}, Eigen::Quaterniond::Identity()};
    samples.push_back(sample);
  }
  measure_clearances(world, hull, samples.size(), samples);
  const std::vector<NearMiss> misses = near_misses(world, hull, 0.6, 0.19, samples);
  ASSERT_EQ(misses.size(), 1U);
  EXPECT_EQ(misses[0].obstacle, "first");
  EXPECT_NEAR(misses[0].clearance_m, 0.2, 1e-9);
  EXPECT_NEAR(misses[0].p_W.x(), 0.0, 0.65);
  EXPECT_EQ(near_misses(world, hull, 1.2, 0.19, samples).size(), 2U);
  EXPECT_TRUE(near_misses(world, hull, 0.6, 0.5, samples).empty()) << "the post is not there";
}

TEST(Report, ASampleListIsBoundedAndKeepsWhatIsMarked) {
  constexpr std::size_t kCapacity = 100;
  SampleList list(kCapacity);
  std::size_t most = 0;
  for (Utime now = 0; now < 3600 * kMicrosecondsPerSecond; now += 20'000) {
    const bool is_marked = now % (90 * kMicrosecondsPerSecond) == 20'000;
    if (!is_marked && !list.is_due(now)) continue;
    DiveSample sample;
    sample.t_s = to_seconds(now);
    list.add(now, sample, is_marked);
    ++most;
  }
  EXPECT_GT(most, kCapacity);
  const double period_s = list.period_s();
  const std::vector<DiveSample> samples = list.take();
  EXPECT_LE(samples.size(), kCapacity);
  std::size_t marked = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    marked += std::abs(std::fmod(samples[i].t_s, 90.0) - 0.02) < 1e-6 ? 1 : 0;
    if (i > 0) {
      EXPECT_GT(samples[i].t_s, samples[i - 1].t_s);
      EXPECT_LE(samples[i].t_s - samples[i - 1].t_s, 2.0 * period_s + 0.1);
    }
  }
  EXPECT_EQ(marked, 40U);
}

}  // namespace
}  // namespace dive::mission
