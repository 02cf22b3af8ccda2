// `dive fit`, as a user runs it: on logs of simulated dives.

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/sanitizers.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::AllOf;
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::own_folder;
using testing::Ran;
using testing::run_here;
using testing::shipped;

// One vehicle for all dives of a test: its thrust, drag and masses are 20 % off.
const std::string kVehicle = " --set hull_seed=5 --set hull_scatter=0.2 ";

void swim(const std::string& name, int seed, const std::string& log, const std::string& more = {}) {
  const Ran ran = run_here(
      fmt::format("run {} --seed {} --log {} {} {}", shipped(name), seed, log, kVehicle, more));
  ASSERT_TRUE(fs::exists(own_folder() / log)) << ran.err;
}

TEST(Fit, WritesAVehicleThatMissionsDive) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  swim("wreck", 1, "a.lcmlog");
  swim("cluttered", 2, "b.lcmlog");
  swim("pool1", 3, "c.lcmlog");
  swim("scenarios/missions/diver", 1, "without.lcmlog");
  const Ran ran = run_here(
      "fit a.lcmlog without.lcmlog b.lcmlog --validate c.lcmlog --output fitted.urdf --json");
  ASSERT_EQ(ran.status, 0) << ran.err << ran.out;
  const Json fit = Json::parse(ran.out);
  ASSERT_EQ(fit.at("left_out").size(), 1);
  EXPECT_THAT(fit.at("left_out").at(0), HasSubstr("without.lcmlog: the log has no fixes"));
  EXPECT_EQ(fit.at("dives"), 2);
  EXPECT_EQ(fit.at("validation"), "held_out");
  EXPECT_EQ(fit.at("vehicle"), "fitted.urdf");
  EXPECT_LT(fit.at("errors").at(0).at("after").at("median_m"),
            fit.at("errors").at(0).at("before").at("median_m"));
  const Json& speed = fit.at("coefficients").at(0);
  EXPECT_EQ(speed.at("name"), "full_speed");
  EXPECT_TRUE(speed.at("constrained"));
  EXPECT_THAT(
      content_of(own_folder() / "fitted.urdf"),
      HasSubstr(fmt::format("<full_speed value=\"{}\" sigma=\"", speed.at("value").get<double>())));

  const Ran again = run_here("run " + shipped("pool1") + kVehicle +
                             "--vehicle fitted.urdf --log d.lcmlog --json");
  EXPECT_THAT(again.status, ::testing::AnyOf(0, 1)) << again.err;
  EXPECT_EQ(run_here("replay d.lcmlog").status, 0) << "the log has the vehicle";
  // The prior of another fit is the description of its first log.
  const Ran second = run_here("fit d.lcmlog a.lcmlog b.lcmlog --validate c.lcmlog --json");
  EXPECT_THAT(second.status, ::testing::AnyOf(0, 1)) << second.err;
  EXPECT_EQ(Json::parse(second.out).at("coefficients").at(0).at("before"), speed.at("value"));
}

TEST(Fit, SaysWhatALogLacks) {
  DIVE_SKIP_UNDER_SANITIZERS("dives of minutes");
  swim("scenarios/missions/diver", 1, "without.lcmlog");
  const Ran without = run_here("fit without.lcmlog without.lcmlog");
  EXPECT_EQ(without.status, 2);
  EXPECT_THAT(
      without.err,
      AllOf(HasSubstr("left out: without.lcmlog: the log has no fixes: dive in a"),
            HasSubstr("known map with the range camera"), HasSubstr("there is no dive to fit to")));

  swim("pool4", 1, "shorter.lcmlog", "--leak-at 1");
  const Ran shorter = run_here("fit shorter.lcmlog shorter.lcmlog");
  EXPECT_EQ(shorter.status, 2);
  EXPECT_THAT(shorter.err, HasSubstr("shorter.lcmlog: the log is too short"));

  swim("pool4", 1, "short.lcmlog", "--leak-at 8");
  const Ran brief = run_here("fit short.lcmlog short.lcmlog");
  EXPECT_EQ(brief.status, 2);
  EXPECT_THAT(brief.err, HasSubstr("too little to fit"));

  const Ran one = run_here("fit short.lcmlog");
  EXPECT_EQ(one.status, 2);
  EXPECT_THAT(one.err, HasSubstr("cannot be checked: give more logs, or others with --validate"));

  const Ran none = run_here("fit no.lcmlog no.lcmlog");
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("no.lcmlog"));
}

TEST(Fit, RefusesTheDivesOfTwoVehicles) {
  DIVE_SKIP_UNDER_SANITIZERS("a dive");
  std::string other = content_of(fs::path(DIVE_SOURCE_DIR) / "vehicle" / "aqua2.urdf");
  other.replace(other.find("14.405"), 6, "13.405");
  fs::create_directories(own_folder());
  std::ofstream(own_folder() / "other.urdf") << other;
  swim("pool4", 1, "a.lcmlog");
  swim("pool4", 1, "b.lcmlog", "--vehicle other.urdf");
  const Ran ran = run_here("fit a.lcmlog b.lcmlog --output v.urdf");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("b.lcmlog: the dive of another vehicle"));
  EXPECT_FALSE(fs::exists(own_folder() / "v.urdf"));
}

TEST(Vehicle, ThatIsWrongIsReportedAtItsPlace) {
  fs::create_directories(own_folder());
  std::ofstream(own_folder() / "bad.urdf")
      << "<robot name=\"r\">\n  <link nam=\"base\"/>\n</robot>\n";
  const Ran bad = run_here("run " + shipped("pool4") + " --vehicle bad.urdf");
  EXPECT_EQ(bad.status, 2);
  EXPECT_THAT(bad.err, HasSubstr("bad.urdf:2:"));
  const Ran none = run_here("check " + shipped("pool4") + " --static --vehicle no.urdf");
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("no.urdf"));
}

}  // namespace
}  // namespace dive::mission
