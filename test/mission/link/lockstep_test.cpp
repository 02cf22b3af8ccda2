// Dives over the link in lock-step: what happens does not depend on the machine.

#include <csignal>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "test/common/file_content.h"
#include "test/common/sanitizers.h"
#include "test/mission/link/processes.h"
#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/bus.h"
#include "vehicle/link/udpm_url.h"

namespace dive::mission {
namespace {

using dive::testing::content_of;
using ::testing::HasSubstr;
using testing::kLong;
using testing::mission;
using testing::Process;
using testing::Processes;

namespace fs = std::filesystem;

// The simulated dive and the dive over the link are bit-identical, with a key and without, and in a
// declared current.
TEST_F(Processes, InLockStepTheLogIsThatOfTheBuiltInSimulator) {
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("key")}, folder_, "key").wait(kLong), 0);
  for (const std::string name : {"window", "pool2", "scenarios/missions/ferry"}) {
    std::vector<std::string> sim = {"sim", mission(name), "--lockstep",    "--seed",
                                    "4",   "--set",       "current_x=0.02"};
    std::vector<std::string> run = {"run", mission(name), "--lockstep",         "--seed",
                                    "4",   "--log",       path("linked.lcmlog")};
    if (name == "pool2") {
      for (auto* words : {&sim, &run}) words->insert(words->end(), {"--key", path("key")});
    }
    const auto vehicle = dive("sim", sim);
    const auto executive = dive("run", run);
    EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
    EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
    EXPECT_EQ(vehicle->json().at("ended"), "finished");
    Process built_in({DIVE_COMMAND, "run", mission(name), "--seed", "4", "--set", "current_x=0.02",
                      "--log", path("built-in.lcmlog"), "--force", "--json"},
                     folder_, "built-in");
    EXPECT_EQ(built_in.wait(kLong), 0) << built_in.err();
    EXPECT_GT(content_of(path("linked.lcmlog")).size(), 1'000'000U);
    EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog"))) << name;
  }
}

// The header of both logs names the bundle too. A mission file is dived with a warning.
TEST_F(Processes, InLockStepABundleMadeWithTheKeyIsDivedAsByTheBuiltInSimulator) {
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("key")}, folder_, "key").wait(kLong), 0);
  const std::string bundle = path("pool2.bundle");
  Process check({DIVE_COMMAND, "check", "--static", mission("pool2"), "--bundle", bundle, "--key",
                 path("key")},
                folder_, "check");
  ASSERT_EQ(check.wait(kLong), 0) << check.err();
  for (const std::string& dived : {bundle, mission("pool2")}) {
    const auto vehicle = dive("sim", {"sim", mission("pool2"), "--lockstep", "--key", path("key")});
    const auto executive = dive(
        "run", {"run", dived, "--lockstep", "--key", path("key"), "--log", path("linked.lcmlog")});
    EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
    EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
    EXPECT_THAT(executive->err(),
                HasSubstr(dived == bundle ? "code made with this key" : "not a verified bundle"));
    if (dived != bundle) continue;
    Process built_in({DIVE_COMMAND, "run", bundle, "--key", path("key"), "--log",
                      path("built-in.lcmlog"), "--json"},
                     folder_, "built-in");
    EXPECT_EQ(built_in.wait(kLong), 0) << built_in.err();
    EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog")));
  }
}

// The simulated vehicle reports its contacts, and the executive's log contains them.
TEST_F(Processes, InLockStepACollisionIsReportedAndLoggedAsByTheBuiltInSimulator) {
  const std::string quay = DIVE_SOURCE_DIR "/test/mission/collision/quay.xml";
  const std::string current = "current_y=0.15";
  const auto vehicle = dive("sim", {"sim", quay, "--lockstep", "--seed", "2", "--set", current});
  const auto executive =
      dive("run", {"run", quay, "--lockstep", "--seed", "2", "--log", path("linked.lcmlog")});
  EXPECT_EQ(executive->wait(120.0), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(20.0), 1) << vehicle->err();
  Process built_in({DIVE_COMMAND, "run", quay, "--seed", "2", "--set", current, "--log",
                    path("built-in.lcmlog"), "--json"},
                   folder_, "built-in");
  EXPECT_EQ(built_in.wait(120.0), 1) << built_in.err();
  EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog")));
  auto expected = built_in.json().at("collision_list");
  ASSERT_FALSE(expected.empty());
  for (auto& collision : expected) {  // the vehicle has no access to the executive's estimates
    for (const char* key : {"estimated", "error_m", "sigma_m"}) collision[key] = nullptr;
  }
  EXPECT_EQ(vehicle->json().at("collision_list"), expected);
  EXPECT_EQ(vehicle->json().at("nearest"), built_in.json().at("nearest"));
  EXPECT_TRUE(executive->json().at("collision_list").is_null()) << "only ground truth knows";
  Process report(
      {DIVE_COMMAND, "report", path("linked.lcmlog"), "--output", path("linked.html"), "--force"},
      folder_, "report");
  EXPECT_EQ(report.wait(60.0), 0) << report.err();
  EXPECT_THAT(content_of(path("linked.html")), HasSubstr("\"obstacle\":\"harbour/ground/quay\""));
}

// With scans too; a sensor failure on the vehicle side gives the same dive.
TEST_F(Processes, InUnknownWaterTheLogIsThatOfTheBuiltInSimulatorToo) {
  const std::string mission = murk();
  for (const std::string fault : {"range_silent@1000", "range_silent@12"}) {
    const auto vehicle = dive("sim", {"sim", mission, "--lockstep", "--seed", "3", "--set",
                                      "current_y=0.02", "--fault", fault});
    const auto executive =
        dive("run", {"run", mission, "--lockstep", "--seed", "3", "--log", path("linked.lcmlog")});
    EXPECT_GE(executive->wait(kLong), 0) << executive->err();
    EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
    EXPECT_EQ(vehicle->json().at("ended"), "finished");
    Process built_in({DIVE_COMMAND, "run", mission, "--seed", "3", "--set", "current_y=0.02",
                      "--fault", fault, "--log", path("built-in.lcmlog"), "--force", "--json"},
                     folder_, "built-in");
    EXPECT_EQ(built_in.wait(kLong), executive->wait(0.0)) << built_in.err();
    EXPECT_GT(built_in.json().at("replans").get<int>(), 0) << "nothing was seen";
    EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog"))) << fault;
  }
}

// Messages that no camera or IMU of the vehicle would send.
class Rubbish {
 public:
  explicit Rubbish(const std::string& url) : bus_(*link::Bus::open(url)) {}

  void publish() {
    bus_.publish(link::channel::kImage, link::Packet(1000, 7));
    bus_.publish(link::channel::kImu, link::Packet(50, 7));
    publish(frame(0, 752, 480), 29);    // truncated
    publish(frame(0, 800, 600), 0);     // larger than the cameras' images
    publish(frame(0, 752, 480, 3), 0);  // in colour
    publish(frame(2, 752, 480), 0);     // from another camera
    for (const int camera : {0, 1}) publish(frame(camera, 8, 4), 0);  // from long ago
  }

 private:
  static ImageFrame frame(int camera, int width, int height, int bytes = 1) {
    return {
        0,     camera, bytes == 3 ? ImageFrame::Format::kRgb8 : ImageFrame::Format::kGray8,
        width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height * bytes))};
  }
  void publish(const ImageFrame& frame, std::size_t cut) {
    link::Packet packet;
    ASSERT_TRUE(link::encode(frame, packet));
    packet.resize(packet.size() - cut);
    bus_.publish(link::channel::kImage, packet);
  }

  link::Bus bus_;
};

// With images and IMU samples too: in pairs, from one camera, and no longer at all.
TEST_F(Processes, WithImagesTheLogIsThatOfTheBuiltInSimulatorInSpiteOfOtherPackets) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of pictures are drawn");
  const std::string basin = mission("scenarios/missions/basin_visual_inertial");
  const std::vector<std::string> conditions = {"--seed",  "3",
                                               "--set",   "current_y=0.02",
                                               "--fault", "camera_right_missing@10",
                                               "--fault", "camera_missing@13"};
  std::vector<std::string> sim = {"sim", basin, "--lockstep"};
  sim.insert(sim.end(), conditions.begin(), conditions.end());
  const auto vehicle = dive("sim", sim);
  const auto executive = dive("run", {"run", basin, "--lockstep", "--cameras", cameras(basin),
                                      "--seed", "3", "--stats", "--log", path("linked.lcmlog")});
  Rubbish rubbish(url_);
  int status = -1;
  for (int i = 0; i < 3600 && status < 0; ++i) {
    rubbish.publish();
    status = executive->wait(0.25);
  }
  EXPECT_EQ(status, 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_EQ(vehicle->json().at("ended"), "finished");
  EXPECT_GT(executive->json().at("stats").at("malformed").get<int>(), 20);
  std::vector<std::string> run = {DIVE_COMMAND, "run", basin, "--log", path("built-in.lcmlog"),
                                  "--json"};
  run.insert(run.end(), conditions.begin(), conditions.end());
  Process built_in(run, folder_, "built-in");
  EXPECT_EQ(built_in.wait(kLong), 0) << built_in.err();
  EXPECT_GT(built_in.json().at("estimator_switches").get<int>(), 0) << "nothing was seen";
  EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog")));
}

// The images are then the source of the map, without a range camera.
TEST_F(Processes, WithStereoMappingTheLogIsThatOfTheBuiltInSimulator) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of pictures are drawn and matched, twice");
  const fs::path missions =
      fs::path(mission("scenarios/missions/basin_visual_inertial")).parent_path();
  std::string text = content_of((missions / "basin_visual_inertial.xml").string());
  const std::string known = R"(map file="maps/basin.sdf" fixes="off")";
  ASSERT_NE(text.find(known), std::string::npos);
  text.replace(
      text.find(known), known.size(),
      R"(map unknown="optimistic" mapping_sensor="stereo" simulation_map="maps/basin.sdf")");
  fs::create_directories(path("maps"));
  std::ofstream(path("stereo.xml")) << text;
  fs::copy_file(missions / "maps/basin.sdf", path("maps/basin.sdf"));
  const std::string mission = path("stereo.xml");
  const auto vehicle = dive("sim", {"sim", mission, "--lockstep", "--seed", "3"});
  const auto executive = dive("run", {"run", mission, "--lockstep", "--cameras", cameras(mission),
                                      "--seed", "3", "--log", path("linked.lcmlog")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  Process built_in(
      {DIVE_COMMAND, "run", mission, "--seed", "3", "--log", path("built-in.lcmlog"), "--json"},
      folder_, "built-in");
  EXPECT_EQ(built_in.wait(kLong), 0) << built_in.err();
  EXPECT_GT(fs::file_size(path("built-in.map.cloud.ply")), 5000U) << "nothing was seen";
  EXPECT_TRUE(content_of(path("linked.lcmlog")) == content_of(path("built-in.lcmlog")));
}

TEST_F(Processes, WithAFifthOfAllImagesLostItStillUsesVision) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of pictures are drawn");
  const std::string basin = mission("scenarios/missions/basin_visual_inertial");
  Process relay({LOCKSTEP_RELAY, url_, far_url_, "0.2", "5"}, folder_, "relay");
  const auto vehicle = dive("sim", {"sim", basin, "--lockstep"});
  const auto executive = dive("run", {"run", basin, "--lockstep", "--lcm", far_url_, "--cameras",
                                      cameras(basin), "--log", path("log")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err() << executive->out();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_EQ(vehicle->json().at("ended"), "finished");
  EXPECT_EQ(vehicle->json().at("collisions"), 0);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
  EXPECT_EQ(explain.wait(kLong), 0);
  EXPECT_THAT(explain.out(), HasSubstr("visual_inertial")) << "the cameras' estimator never led";
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

TEST_F(Processes, AVehicleWithoutCamerasUsesThePrimitiveEstimator) {
  const std::string map = DIVE_SOURCE_DIR "/missions/scenarios/missions/maps/basin.sdf";
  const auto vehicle = dive("sim", {"sim", map, "--start", "0,0,-1.5,0,0,0", "--lockstep"});
  const std::string basin = mission("scenarios/missions/basin_visual_inertial");
  const auto executive =
      dive("run", {"run", basin, "--lockstep", "--cameras", cameras(basin), "--log", path("log")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  const auto blind = dive("water", {"sim", map, "--start", "0,0,-1.5", "--simulated-water", "mud"});
  EXPECT_EQ(blind->wait(kLong), 2);
  EXPECT_THAT(blind->err(), HasSubstr("clear_pool"));
}

TEST_F(Processes, WithAFifthOfAllScansLostTheVehicleStillGoesRoundWhatItSees) {
  const std::string mission = murk();
  Process relay({LOCKSTEP_RELAY, url_, far_url_, "0.2", "5"}, folder_, "relay");
  const auto vehicle = dive("sim", {"sim", mission, "--lockstep"});
  const auto executive =
      dive("run", {"run", mission, "--lockstep", "--lcm", far_url_, "--log", path("log")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err() << executive->out();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_GT(executive->json().at("replans").get<int>(), 0) << "nothing was seen";
  EXPECT_EQ(vehicle->json().at("collisions"), 0);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

TEST_F(Processes, WhenTheScansStopTheVehicleHoldsAndComesUp) {
  const std::string mission = murk();
  const auto vehicle = dive("sim", {"sim", mission, "--lockstep", "--fault", "range_silent@8"});
  const auto executive = dive("run", {"run", mission, "--lockstep", "--log", path("log")});
  EXPECT_GE(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_EQ(vehicle->json().at("collisions"), 0);
  EXPECT_LT(vehicle->json().at("final_depth_m").get<double>(), 0.4);
  Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
  EXPECT_EQ(explain.wait(kLong), 0);
  EXPECT_THAT(explain.out(), HasSubstr("range_lost"));
}

TEST_F(Processes, WithAFifthOfAllPacketsLostTheWindowMissionEndsSurfacedAndUnharmed) {
  Process relay({LOCKSTEP_RELAY, url_, far_url_, "0.2", "5"}, folder_, "relay");
  const auto vehicle = dive("sim", {"sim", mission("window"), "--lockstep"});
  const auto executive = dive(
      "run", {"run", mission("window"), "--lockstep", "--lcm", far_url_, "--log", path("log")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  const auto report = vehicle->json();
  EXPECT_EQ(report.at("collisions"), 0);
  EXPECT_LT(report.at("final_depth_m").get<double>(), 0.4);
  EXPECT_GT(report.at("min_clearance_m").get<double>(), 0.3);
  Process replay({DIVE_COMMAND, "replay", path("log")}, folder_, "replay");
  EXPECT_EQ(replay.wait(kLong), 0) << replay.out();
}

// LCM 1.3.1's own receiver ends in a segmentation fault at this datagram.
TEST_F(Processes, NoDatagramEndsAProcess) {
  const auto vehicle = dive("sim", {"sim", mission("pool3"), "--lockstep"});
  const auto supervisor = dive("supervise", {"supervise"});
  const auto executive =
      dive("run", {"run", mission("pool3"), "--lockstep", "--log", path("log"), "--stats"});
  wait_for_vehicle_time(1.0);
  const link::testing::DatagramSender sender(*link::parse_udpm_url(url_));
  while (executive->wait(0.005) < 0) {
    for (const char* channel :
         {link::channel::kImu, link::channel::kAhrs, link::channel::kCommand}) {
      sender.send(link::testing::overflowing_datagram(channel));
    }
  }
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_LT(supervisor->wait(kLong), 128) << supervisor->err();
}

/// The socket of a service manager.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", "200000", 1);
  }
  ~NotifySocket() {
    close(socket_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// Appends what has arrived to messages().
  void receive() {
    char buffer[4096];
    for (ssize_t size = 0; (size = recv(socket_, buffer, sizeof(buffer), 0)) > 0;) {
      messages_.emplace_back(buffer, static_cast<std::size_t>(size));
    }
  }
  [[nodiscard]] const std::vector<std::string>& messages() const { return messages_; }

 private:
  int socket_;
  std::vector<std::string> messages_;
};

TEST_F(Processes, TheServiceManagerIsNotifiedFromTheControlLoop) {
  const auto vehicle = dive("sim", {"sim", mission("window"), "--lockstep"});
  NotifySocket socket("/tmp/dive-notify-" + std::to_string(::getpid()));
  const auto executive =
      dive("run", {"run", mission("window"), "--lockstep", "--log", path("log")});
  int status = -1;
  while (status < 0) {
    status = executive->wait(0.01);
    socket.receive();
  }
  EXPECT_EQ(status, 0) << executive->err();
  const std::vector<std::string>& messages = socket.messages();
  ASSERT_GE(messages.size(), 3U);
  EXPECT_THAT(messages.front(), ::testing::StartsWith("READY=1\nWATCHDOG=1\nSTATUS="));
  EXPECT_THAT(messages[1], ::testing::StartsWith("WATCHDOG=1\nSTATUS="));
  EXPECT_EQ(messages.back(), "STOPPING=1");
  EXPECT_EQ(vehicle->wait(kLong), 0);
}

TEST_F(Processes, TheVehicleMayLieAnywhereOnAMap) {
  const std::string map = DIVE_SOURCE_DIR "/missions/maps/pool2.sdf";
  const auto vehicle =
      dive("sim", {"sim", map, "--start", "6,0,-2,0,0,0", "--lockstep", "--range-camera"});
  const auto executive = dive("run", {"run", mission("pool2"), "--lockstep", "--log", path("log")});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_EQ(dive("nowhere", {"sim", map, "--start", "0,0"})->wait(kLong), 2);
  EXPECT_EQ(dive("nothing", {"sim", "no.sdf", "--start", "0,0,-1"})->wait(kLong), 2);
}

TEST_F(Processes, AVehicleOnAMapSendsScansWhenAsked) {
  const std::string mission = murk();
  for (const bool has_range_camera : {true, false}) {
    std::vector<std::string> words = {"sim", path("maps/bay.sdf"), "--start", "0,0,-2",
                                      "--lockstep"};
    if (has_range_camera) words.emplace_back("--range-camera");
    const auto vehicle = dive("sim", words);
    const auto executive = dive("run", {"run", mission, "--lockstep", "--log", path("log")});
    EXPECT_GE(executive->wait(kLong), 0) << executive->err();
    EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
    EXPECT_EQ(executive->json().at("replans").get<int>() > 0, has_range_camera) << executive->out();
  }
}

}  // namespace
}  // namespace dive::mission
