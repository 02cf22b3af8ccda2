// Processes that refuse to begin.

#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/common/file_content.h"
#include "test/mission/link/processes.h"

namespace dive::mission {
namespace {

using dive::testing::content_of;
using ::testing::HasSubstr;
using testing::kLong;
using testing::mission;
using ::testing::Not;
using testing::Processes;

TEST_F(Processes, WithoutAKeyPacketsDoNotLeaveTheMachineUnlessItIsSaid) {
  const std::string far = fmt::format("{}1", url_.substr(0, url_.size() - 1));
  for (const std::string command : {"run", "supervise"}) {
    std::vector<std::string> words = {command, "--lcm", far};
    if (command == "run") words.insert(words.begin() + 1, mission("pool3"));
    const auto refused = dive(command, words);
    EXPECT_EQ(refused->wait(kLong), 2);
    EXPECT_THAT(refused->err(), HasSubstr("--insecure"));
  }
  const auto insecure = dive("insecure", {"supervise", "--lcm", far, "--insecure"});
  EXPECT_EQ(insecure->wait(0.5), -1) << insecure->err();
}

TEST_F(Processes, AMissionWhoseAbortNeedsTheKeyDoesNotStartWithoutOne) {
  const auto refused = dive("run", {"run", pool_aborted_by_key()});
  EXPECT_EQ(refused->wait(kLong), 2);
  EXPECT_THAT(refused->err(), HasSubstr("abort only with the key"));
}

TEST_F(Processes, ThereIsNoVehicleInWaterThatNothingIsSaidOf) {
  std::string text = content_of(murk());
  const std::string simulation_map = " simulation_map=\"maps/bay.sdf\"";
  ASSERT_NE(text.find(simulation_map), std::string::npos);
  text.erase(text.find(simulation_map), simulation_map.size());
  std::ofstream(path("murk.xml")) << text;
  const auto vehicle = dive("sim", {"sim", path("murk.xml")});
  EXPECT_EQ(vehicle->wait(kLong), 2);
  EXPECT_THAT(vehicle->err(), HasSubstr("simulation_map="));
}

TEST_F(Processes, WithoutAVehicleTheExecutiveReportsIt) {
  const auto bad = dive("bad", {"run", mission("pool3"), "--lcm", "carrier-pigeon://"});
  EXPECT_EQ(bad->wait(kLong), 2);
  EXPECT_THAT(bad->err(), HasSubstr("carrier-pigeon"));
  const auto lonely = dive("status", {"status", "--timeout", "0.3"});
  EXPECT_EQ(lonely->wait(kLong), 1);
  EXPECT_THAT(lonely->err(), HasSubstr("no heartbeat of an executive within 0.3 s on udpm://"));
  EXPECT_THAT(lonely->err(), HasSubstr("From another machine give --lcm with ttl=1"));
}

TEST_F(Processes, TheSupervisorOfAMissionReadsItsMapOrSaysWhyItDoesNot) {
  const auto missing = dive("missing", {"supervise", path("none.xml")});
  EXPECT_EQ(missing->wait(kLong), 2);
  EXPECT_THAT(missing->err(), HasSubstr("none.xml"));
  std::ofstream(path("broken.xml")) << "<mission><map></mission>";
  const auto broken = dive("broken", {"supervise", path("broken.xml")});
  EXPECT_EQ(broken->wait(kLong), 2);
  EXPECT_THAT(broken->err(), HasSubstr("broken.xml:1"));
  const auto nowhere = dive("nowhere", {"supervise", "--vehicle", path("none.urdf")});
  EXPECT_EQ(nowhere->wait(kLong), 2);
  EXPECT_THAT(nowhere->err(), HasSubstr("none.urdf"));
  const auto unknown = dive("unknown", {"supervise", murk()});
  EXPECT_EQ(unknown->wait(1.0), -1) << unknown->err();
  EXPECT_THAT(unknown->err(), HasSubstr("dead reckoning"));
  const auto known = dive("known", {"supervise", mission("pool3")});
  EXPECT_EQ(known->wait(1.0), -1) << known->err();
  EXPECT_THAT(known->err(), Not(HasSubstr("dead reckoning")));
}

}  // namespace
}  // namespace dive::mission
