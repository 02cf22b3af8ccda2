// Dives over the link in real time: killed processes, stalls, operator requests, and clocks that
// are set.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "test/common/sanitizers.h"
#include "test/mission/link/attacker.h"
#include "test/mission/link/processes.h"

namespace dive::mission {
namespace {

using testing::Death;
using ::testing::HasSubstr;
using testing::kFastPace;
using testing::kLong;
using testing::kPace;
using testing::mission;
using ::testing::Not;
using testing::Process;
using testing::Processes;

namespace fs = std::filesystem;

// In real time, where the number of images depends on the machine: these assertions do not.
TEST_F(Processes, InRealTimeImagesAreSortedIntoPairs) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of pictures are drawn");
  const std::string basin = mission("scenarios/missions/basin_visual_inertial");
  const auto vehicle = dive("sim", {"sim", basin, "--time-factor", "0.5", "--clock-jump=-3600@5"});
  const auto executive = dive("run", {"run", basin, "--time-factor", "0.5", "--cameras",
                                      cameras(basin), "--log", path("log"), "--stats"});
  EXPECT_GE(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  const auto stats = executive->json().at("stats");
  EXPECT_GT(stats.at("images").at("pairs").get<int>(), 0);
  EXPECT_GT(stats.at("images").at("imu_samples").get<int>(), 0);
  EXPECT_GE(stats.at("clock_jumps").get<int>(), 1);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

// In real time packets are also delayed, duplicated and reordered. How far the vehicle then comes
// depends on the machine; that it surfaces and that its log replays does not.
TEST_F(Processes, InRealTimeWithScansLostAndLateTheVehicleComesUp) {
  const std::string mission = murk();
  Process relay({LOSSY_RELAY, url_, far_url_, "0.2", "5"}, folder_, "relay");
  const auto vehicle =
      dive("sim", {"sim", mission, "--time-factor", kPace, "--clock-jump=-3600@3"});
  const auto executive = dive("run", {"run", mission, "--time-factor", kPace, "--lcm", far_url_,
                                      "--log", path("log"), "--stats"});
  EXPECT_GE(executive->wait(kLong), 0) << executive->err();
  EXPECT_GE(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_GE(executive->json().at("stats").at("clock_jumps").get<int>(), 1);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

TEST_F(Processes, TopsidePausesResumesSkipsAndAborts) {
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("key")}, folder_, "key").wait(kLong), 0);
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("other")}, folder_, "other").wait(kLong), 0);
  const auto vehicle =
      dive("sim", {"sim", mission("window"), "--time-factor", kPace, "--key", path("key")});
  const auto executive = dive("run", {"run", mission("window"), "--time-factor", kPace, "--key",
                                      path("key"), "--log", path("log"), "--stats"});
  EXPECT_EQ(say("status", {"status", "--key", path("key"), "--timeout", "600"}), 0);
  EXPECT_EQ(say("reader", {"status", "--timeout", "600"}), 0) << "anyone may read";
  EXPECT_EQ(say("pause", {"pause", "--key", path("key"), "--timeout", "600"}), 0);
  EXPECT_EQ(say("nokey", {"resume"}), 1);
  EXPECT_EQ(say("wrong", {"resume", "--key", path("other"), "--timeout", "1"}), 1);
  EXPECT_EQ(say("resume", {"resume", "--key", path("key"), "--timeout", "600"}), 0);
  EXPECT_EQ(say("skip", {"skip", "--key", path("key"), "--timeout", "600"}), 0);
  EXPECT_EQ(say("abort", {"abort", "--timeout", "600"}), 0);
  EXPECT_EQ(say("again", {"abort", "--timeout", "600"}), 0);
  EXPECT_EQ(executive->wait(kLong), 1) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  const auto report = executive->json();
  EXPECT_EQ(report.at("final_state"), "dive.aborted");
  EXPECT_THAT(report.at("cause").get<std::string>(), HasSubstr("topside commanded abort"));
  EXPECT_GE(report.at("stats").at("refused").at("auth_failed").get<int>(), 1);
  EXPECT_EQ(vehicle->json().at("collisions"), 0);
  Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
  EXPECT_EQ(explain.wait(kLong), 0);
  for (const char* cause :
       {"topside commanded pause", "topside commanded resume", "topside commanded skip"}) {
    EXPECT_THAT(explain.out(), HasSubstr(cause));
  }
}

TEST_F(Processes, WithAKeyNoForgedOrRepeatedPacketIsObeyed) {
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("key")}, folder_, "key").wait(kLong), 0);
  const std::string pool = pool_aborted_by_key();
  const auto with_key = [&](const std::string& name, std::vector<std::string> words) {
    words.insert(words.end(), {"--key", path("key")});
    return dive(name, words);
  };
  const auto vehicle = with_key("sim", {"sim", pool, "--time-factor", kPace});
  const auto supervisor = with_key("supervise", {"supervise", "--time-factor", kPace});
  const auto executive =
      with_key("run", {"run", pool, "--time-factor", kPace, "--log", path("log"), "--stats"});
  wait_for_vehicle_time(2.0);
  testing::Attacker attacker(url_);
  while (executive->wait(0.02) < 0) attacker.attack();
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_EQ(supervisor->wait(kLong), 0) << supervisor->err();
  EXPECT_EQ(vehicle->json().at("ended"), "finished");
  EXPECT_EQ(vehicle->json().at("supervised_s"), 0.0);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  const auto stats = executive->json().at("stats");
  EXPECT_GT(stats.at("rejected").at("unauthenticated").get<int>(), 0);
  EXPECT_GT(stats.at("refused").at("auth_failed").get<int>(), 0);
  for (const auto& transition : executive->json().at("transitions")) {
    EXPECT_THAT(transition.at("cause").get<std::string>(), Not(HasSubstr("topside")));
  }
}

TEST_F(Processes, ASensorsClockThatIsSetDisturbsNobody) {
  const auto vehicle =
      dive("sim", {"sim", mission("pool3"), "--time-factor", kPace, "--clock-jump=-3600@10"});
  const auto executive = dive(
      "run", {"run", mission("pool3"), "--time-factor", kPace, "--log", path("log"), "--stats"});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_GE(executive->json().at("stats").at("clock_jumps").get<int>(), 2);
  const auto bad = dive("bad", {"sim", mission("pool3"), "--clock-jump", "soon"});
  EXPECT_EQ(bad->wait(kLong), 2);
  EXPECT_THAT(bad->err(), ::testing::HasSubstr("--clock-jump soon: expected BY@SECONDS"));
}

// supervisor_test.cpp tests the delay, by a clock that does not depend on the machine.
TEST_F(Death, OfTheExecutiveBringsTheSupervisorUp) {
  begin();
  executive_->kill(SIGKILL);
  EXPECT_EQ(supervisor_->wait(kLong), 1) << supervisor_->err();
  EXPECT_TRUE(supervisor_->json().at("surfaced").get<bool>());
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.3);
}

TEST_F(Death, AnExecutiveThatHangsIsAsGoodAsDead) {
  begin();
  executive_->kill(SIGSTOP);
  EXPECT_EQ(supervisor_->wait(kLong), 1) << supervisor_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_GT(vehicle_->json().at("supervised_s").get<double>(), 1.0);
}

TEST_F(Death, OfExecutiveAndSupervisorLeavesTheVehicleItsOwnTimeOut) {
  begin();
  executive_->kill(SIGKILL);
  supervisor_->kill(SIGKILL);
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(vehicle_->json().at("ended"), "surfaced");
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.3);
  EXPECT_GT(vehicle_->json().at("silent_s").get<double>(), 1.0);
}

// Straight up is the deck of the wreck.
TEST_F(Death, AnExecutiveThatStallsUnderAnOverheadIsGivenTheVehicleBack) {
  begin_inside();
  executive_->kill(SIGSTOP);
  wait_for_supervisor("holding");
  executive_->kill(SIGCONT);
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err() << executive_->out();
  EXPECT_EQ(supervisor_->wait(kLong), 0) << supervisor_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->out();
  EXPECT_EQ(vehicle_->json().at("collisions"), 0);
  EXPECT_GE(supervisor_->json().at("given_back").get<int>(), 1);
  EXPECT_FALSE(supervisor_->json().at("took_over").get<bool>());
}

TEST_F(Death, OfTheExecutiveUnderAnOverheadIsFollowedByTheExitPath) {
  begin_inside();
  executive_->kill(SIGKILL);
  EXPECT_EQ(supervisor_->wait(kLong), 1) << supervisor_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->out();
  EXPECT_EQ(vehicle_->json().at("collisions"), 0);
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.3);
  const auto report = supervisor_->json();
  EXPECT_TRUE(report.at("followed").get<bool>());
  EXPECT_GT(report.at("fixes").get<int>(), 0) << supervisor_->err();
  EXPECT_TRUE(report.at("surfaced").get<bool>());
  EXPECT_FALSE(report.at("blindly").get<bool>());
}

TEST_F(Death, OfTheDriverIsNoticedAndTheDiveGoesOn) {
  begin({"--time-factor", kPace}, {"--driver-restart", "0.3@6"});
  EXPECT_GE(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(vehicle_->json().at("ended"), "finished");
  EXPECT_LT(vehicle_->json().at("refused").get<int>(), 50) << "commands after the restart";
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.4);
  EXPECT_EQ(dive("bad", {"sim", mission("pool3"), "--driver-restart", "soon"})->wait(kLong), 2);
}

// The first dive lasts longer than anything here needs.
TEST_F(Death, ASecondExecutiveEndsAtOnceAndTheFirstGoesOn) {
  begin("penetration", 1.0, {"--time-factor", "1"});
  const auto second = dive("second", {"run", mission("pool3"), "--log", path("second")});
  EXPECT_EQ(second->wait(kLong), 1) << second->err();
  EXPECT_EQ(second->json().at("cause"), "another executive commands this vehicle");
  wait_for_vehicle_time(0.5);
  EXPECT_EQ(executive_->wait(0.0), -1) << "it still dives";
}

// It does not know for how long it was down, so it aborts; to a time before the clock's origin too.
TEST_F(Death, ARestartedExecutiveWhoseClockWasSetBackIsObeyed) {
  const std::string pool = resumable();
  const std::vector<std::string> pace = {"--time-factor", kPace};
  vehicle_ = dive("sim", {"sim", pool, pace[0], pace[1], "--clock-jump=-20@6"});
  executive_ = dive("run", {"run", pool, pace[0], pace[1], "--log", path("log")});
  wait_until_clock_is_set_back();
  executive_->kill(SIGKILL);
  executive_ = dive("resumed", {"run", pool, pace[0], pace[1], "--resume", "--journal",
                                path("log.journal"), "--log", path("log2")});
  EXPECT_EQ(executive_->wait(kLong), 1) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(executive_->json().at("final_state"), "dive.aborted");
  EXPECT_THAT(executive_->json().at("cause").get<std::string>(), HasSubstr("restarted after"));
  EXPECT_EQ(vehicle_->json().at("ended"), "finished");
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.4);
  EXPECT_LT(vehicle_->json().at("refused").get<int>(), 50);
}

// The status differs from those of a dive that has ended, so that systemd restarts the executive.
TEST_F(Death, ByASecondSignalLeavesTheVehicleToTheSupervisor) {
  begin();
  executive_->kill(SIGTERM);
  executive_->kill(SIGINT);
  const int status = executive_->wait(kLong);
  EXPECT_TRUE(status == 128 + SIGTERM || status == 128 + SIGINT) << status;
  EXPECT_EQ(supervisor_->wait(kLong), 1) << supervisor_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(vehicle_->json().at("ended"), "surfaced");
}

/// Limits the size of files that a process writes, as a full disk does.
void limit_files(const Process& process, rlim_t bytes) {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(prlimit(process.pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
}

TEST_F(Death, OfTheDiskDoesNotEndTheDive) {
  begin();
  limit_files(*executive_, 1000);
  wait_for_vehicle_time(4.0);
  limit_files(*executive_, RLIM_INFINITY);
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_THAT(executive_->err(), HasSubstr("the log is not complete"));
  EXPECT_THAT(executive_->err(), HasSubstr("File too large"));
  Process replay({DIVE_COMMAND, "replay", path("log"), "--json"}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 1);
  EXPECT_FALSE(replay.json().at("identical").get<bool>());
  EXPECT_FALSE(replay.json().at("gaps").empty());
  Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
  EXPECT_EQ(explain.wait(kLong), 0);
  EXPECT_THAT(explain.out(), HasSubstr("ticks of the log and"));
}

// The control thread goes on, so that the supervisor has nothing to do; what waited is written
// later.
TEST_F(Death, ADiskThatStallsUnderAnOverheadStallsNothingElse) {
  DIVE_SKIP_UNDER_SANITIZERS("their libraries must be loaded first");
  const std::string stalled = path("stalled");
  launcher_ = {"/usr/bin/env", "LD_PRELOAD=" STALLED_DISK, "DIVE_STALLED_DISK=" + stalled};
  begin_inside();
  std::ofstream(stalled).put('\n');
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const auto size = fs::file_size(path("log"));
  std::this_thread::sleep_for(std::chrono::seconds(4));
  EXPECT_EQ(fs::file_size(path("log")), size) << "the disk did not stall";
  fs::remove(stalled);
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->out();
  EXPECT_EQ(supervisor_->wait(kLong), 0) << supervisor_->err();
  EXPECT_EQ(supervisor_->json().at("holds"), 0) << supervisor_->err();
  EXPECT_EQ(vehicle_->json().at("collisions"), 0);
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

TEST_F(Death, OfTheDiskEndsADiveWhoseMissionSaysSo) {
  const std::string pool = pool_with("<log_lost rung=\"abort_and_surface\"/>", "<mission_timeout");
  vehicle_ = dive("sim", {"sim", pool, "--time-factor", kPace});
  executive_ = dive("run", {"run", pool, "--time-factor", kPace, "--log", path("log")});
  wait_for_vehicle_time(6.0);
  limit_files(*executive_, 1000);
  wait_for_vehicle_time(3.0);
  limit_files(*executive_, RLIM_INFINITY);
  EXPECT_EQ(executive_->wait(kLong), 1) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(executive_->json().at("final_state"), "dive.aborted");
  EXPECT_THAT(executive_->json().at("cause").get<std::string>(), HasSubstr("failsafe log_lost"));
  EXPECT_THAT(executive_->err(), HasSubstr("ticks are lost"));
  EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.4);
}

}  // namespace
}  // namespace dive::mission
