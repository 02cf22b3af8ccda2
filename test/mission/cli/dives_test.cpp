// The simulated dives of `dive check`, as a user runs them. The mission swims along a quay; only an
// undeclared current makes it collide.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

using Json = nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Ran;
using testing::run_here;
using testing::shipped;
using ::testing::StartsWith;

const std::string kCheckQuay = "check '" DIVE_SOURCE_DIR "/test/mission/collision/quay.xml' ";
const std::string kCurrent =
    " --set current_y=0.04";  // carries about half of the dives to the quay

// With descents by heave, turns, and an ascent of 12 m.
TEST(Dives, TakeTheTimeAndEnergyOfTheBudget) {
  for (const char* name : {"window", "survey", "penetration"}) {
    const Json check = Json::parse(run_here("check --json --dives 1 " + shipped(name)).out);
    for (const char* key : {"duration_s", "energy_wh"}) {
      const double planned = check.at("budget").at(key);
      EXPECT_NEAR(check.at("dive").at(key).get<double>() / planned, 1.0, 0.15)
          << name << " " << key;
    }
  }
}

TEST(Dives, ThatCollideAreOneWithTheCommandThatRepeatsTheWorst) {
  const Ran ran = run_here(kCheckQuay + "--json --dives 6" + kCurrent);
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json check = Json::parse(ran.out);
  const Json& dives = check.at("dives");
  EXPECT_EQ(dives.at("dives"), 6);
  EXPECT_EQ(dives.at("first_seed"), 1);
  const int collided = dives.at("collisions");
  ASSERT_GT(collided, 0);
  ASSERT_LT(collided, 6);
  EXPECT_EQ(check.at("dive").at("collisions"), 0) << "the first dive alone would have passed";
  EXPECT_EQ(dives.at("clearance_m").at("min"), 0.0);
  EXPECT_GT(dives.at("collision_bound_95").get<double>(), collided / 6.0);

  Json finding;
  for (const Json& each : check.at("diagnostics")) {
    if (each.at("code") == "CHK-DIVE") finding = each;
  }
  ASSERT_TRUE(finding.is_object());
  const std::string message = finding.at("message");
  EXPECT_THAT(message, AllOf(StartsWith(std::to_string(collided) + " of 6 simulated dives"),
                             HasSubstr("'harbour/ground/quay' at ")));
  const std::string command = dives.at("worst").at(0).at("command");
  EXPECT_THAT(command, HasSubstr(" --seed " + dives.at("worst").at(0).at("seed").dump()));
  EXPECT_EQ(finding.at("hint"), "reproduce it with: " + command);
  const Ran again = run_here(command.substr(std::string("dive ").size()) + " --json");
  EXPECT_EQ(again.status, 1);
  const std::string cause = Json::parse(again.out).at("cause");
  EXPECT_THAT(message, HasSubstr(cause)) << "place and time of the same collision";

  const Ran text = run_here(kCheckQuay + "--dives 6" + kCurrent);
  EXPECT_EQ(text.status, 1);
  EXPECT_THAT(text.out, AllOf(HasSubstr("not ready to dive"),
                              HasSubstr("  dives  6 with seeds 1 to 6: "), HasSubstr(command)));
}

TEST(Dives, BeginWithTheGivenSeed) {
  const Ran ran = run_here(kCheckQuay + "--dives 2 --seed 41");
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("  dives  2 with seeds 41 to 42: 2 successful, 2 surfaced, "
                                       "0 with a collision (at most 77.6 % of dives, "),
                             HasSubstr("5th percentile")));
}

// Takes the ten seconds, and again as long.
TEST(Dives, AreAtLeastTenAndTheirNumberRepeatsTheResult) {
  const Ran ran = run_here(kCheckQuay + "--json" + kCurrent);
  EXPECT_EQ(ran.status, 1) << ran.err;
  const Json dives = Json::parse(ran.out).at("dives");
  ASSERT_GE(dives.at("dives"), 10);
  const Ran again =
      run_here(kCheckQuay + "--json --jobs 1 --dives " + dives.at("dives").dump() + kCurrent);
  EXPECT_EQ(again.status, 1);
  EXPECT_EQ(Json::parse(again.out).at("dives"), dives);
}

TEST(Dives, OfAStaticCheckAreRefused) {
  const Ran ran = run_here(kCheckQuay + "--static --dives 3");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.err, HasSubstr("--static skips simulated dives"));
  const Ran none = run_here(kCheckQuay + "--static --json");
  EXPECT_EQ(none.status, 0);
  EXPECT_FALSE(Json::parse(none.out).contains("dives"));
  EXPECT_EQ(run_here(kCheckQuay + "--dives 0").status, 2);
}

}  // namespace
}  // namespace dive::mission
