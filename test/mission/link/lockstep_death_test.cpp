// Processes that end during a dive in lock-step, and what a restarted executive makes of it.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/mission/link/processes.h"

namespace dive::mission {
namespace {

using testing::Death;
using ::testing::HasSubstr;
using testing::kLong;
using testing::mission;
using testing::Process;

namespace fs = std::filesystem;

class Restart : public Death {
 protected:
  /// The executive of pool_ is killed after 8 s in lock-step.
  void kill_executive() {
    vehicle_ = dive("sim", {"sim", pool_, "--lockstep"});
    executive_ = dive("run", {"run", pool_, "--lockstep", "--log", path("log")});
    wait_for_vehicle_time(8.0);
    executive_->kill(SIGKILL);
  }
  void SetUp() override {
    Death::SetUp();
    if (!IsSkipped()) pool_ = resumable();
  }
  std::string pool_;
};

TEST_F(Death, OfTheSupervisorDisturbsNobody) {
  begin({"--lockstep"});
  supervisor_->kill(SIGKILL);
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
}

TEST_F(Restart, GoesOnWhereTheExecutiveWas) {
  kill_executive();
  executive_ = dive("resumed", {"run", pool_, "--lockstep", "--resume", "--journal",
                                path("log.journal"), "--log", path("log2")});
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(executive_->json().at("transitions").at(0).at("cause"), "the executive was restarted");
}

// An operator's abort in every respect: executed, logged, replayed, and the end of the dive.
TEST_F(Death, BySignalIsAnAbort) {
  for (const auto& [signal, name] : {std::pair{SIGTERM, "SIGTERM"}, std::pair{SIGINT, "SIGINT"}}) {
    fs::remove(path("log"));
    fs::remove(path("log.journal"));
    begin({"--lockstep"});
    executive_->kill(signal);
    EXPECT_EQ(executive_->wait(kLong), 1) << executive_->err();
    EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
    EXPECT_EQ(supervisor_->wait(kLong), 0) << supervisor_->err() << "the dive has ended";
    EXPECT_LT(vehicle_->json().at("final_depth_m").get<double>(), 0.4);
    EXPECT_EQ(executive_->json().at("final_state"), "dive.aborted");
    EXPECT_THAT(executive_->json().at("cause").get<std::string>(), HasSubstr(name));
    Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
    EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
    Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
    EXPECT_EQ(explain.wait(kLong), 0);
    EXPECT_THAT(explain.out(), HasSubstr(std::string(name) + " to the executive"));
  }
}

TEST_F(Death, BySignalBeforeTheDiveIsNoAbort) {
  executive_ = dive("run", {"run", mission("pool3"), "--log", path("log")});
  while (!fs::exists(path("log"))) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  executive_->kill(SIGTERM);
  EXPECT_EQ(executive_->wait(kLong), 128 + SIGTERM) << executive_->err();
}

TEST_F(Restart, GoesOnWithoutItsLogOnAFullDisk) {
  kill_executive();
  executive_->wait(kLong);
  EXPECT_EQ(fs::file_size(path("log.journal")), 2U << 20U);
  // A limit on file size that is smaller than the log's header simulates a full disk.
  const auto on_full_disk = [&](const std::string& name, const std::string& options) {
    const std::string command = "trap '' XFSZ; ulimit -f 12; exec " DIVE_COMMAND " run " + pool_ +
                                " --json --lcm '" + url_ + "' " + options;
    return std::make_unique<Process>(std::vector<std::string>{"/bin/sh", "-c", command}, folder_,
                                     name);
  };
  executive_ = on_full_disk(
      "resumed", "--lockstep --resume --log " + path("log") + " --journal " + path("log.journal"));
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(executive_->json().at("transitions").at(0).at("cause"), "the executive was restarted");
  EXPECT_THAT(executive_->err(), HasSubstr("the dive goes on"));
  const auto fresh = on_full_disk("new", "--log " + path("other"));
  EXPECT_EQ(fresh->wait(kLong), 3) << "a new dive needs a log";
}

}  // namespace
}  // namespace dive::mission
