// Executive, vehicle, supervisor and topside as separate processes, over UDP multicast on this
// machine. Skipped with a message if the machine does not route multicast.
//
// Nothing here depends on the speed of the machine. Tests that depend on the course of a dive run
// in lock-step. Only tests about real time run in real time: killed processes, operator requests,
// and clock changes. They wait for events, in open water, and need far less time than their limits.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "test/common/file_content.h"
#include "test/common/sanitizers.h"
#include "test/mission/link/attacker.h"
#include "test/mission/link/process.h"
#include "test/vehicle/link/datagrams.h"
#include "vehicle/link/bus.h"
#include "vehicle/link/udpm_url.h"

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::Process;

namespace fs = std::filesystem;
using dive::testing::content_of;

// Factor on real time for tests that need real time: a tick of the executive then takes some 3 % of
// its budget.
constexpr const char* kPace = "2";
constexpr const char* kFastPace = "4";  // where most of the dive is the same as ever

// Limit in seconds for processes that end by themselves: against hanging, not a measurement.
constexpr double kLong = 900.0;

class Processes : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = (fs::path(::testing::TempDir()) / "dive-link" / info->name()).string();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    // A separate group for each test, because tests run in parallel.
    const unsigned port = 20'000 + 2 * static_cast<unsigned>(::getpid() % 15'000);
    url_ = fmt::format("udpm://239.255.76.67:{}?ttl=0", port);
    far_url_ = fmt::format("udpm://239.255.76.67:{}?ttl=0", port + 1);
    if (!hears_itself()) GTEST_SKIP() << "no multicast on this machine";
  }

  [[nodiscard]] bool hears_itself() const {
    tl::expected<link::Bus, std::string> bus = link::Bus::open(url_);
    if (!bus) return false;
    bool received = false;
    bus->subscribe("DIVE_TEST", 16, [&](link::PacketView) { return received = true; });
    bus->publish("DIVE_TEST", link::Packet(8));
    SteadyClock clock;
    return bus->wait(clock, clock.now() + 20 * kMicrosecondsPerSecond, [&] { return received; });
  }

  /// Waits until the vehicle's sensors have run for the given vehicle time.
  void wait_for_vehicle_time(double seconds) const {
    tl::expected<link::Bus, std::string> bus = link::Bus::open(url_);
    ASSERT_TRUE(bus) << bus.error();
    std::optional<Utime> first;
    Utime last = 0;
    bus->listen<DepthSample>(link::channel::kDepth, [&](const DepthSample& sample) {
      if (!first) first = sample.utime;
      last = sample.utime;
    });
    SteadyClock clock;
    ASSERT_TRUE(bus->wait(clock, clock.now() + from_seconds(kLong),
                          [&] { return first && to_seconds(last - *first) >= seconds; }));
  }

  /// Waits until the vehicle's sensors have set their clock back, and some checkpoints longer.
  void wait_until_clock_is_set_back() const {
    tl::expected<link::Bus, std::string> bus = link::Bus::open(url_);
    ASSERT_TRUE(bus) << bus.error();
    Utime last = 0;
    std::optional<Utime> set_back;
    bus->listen<DepthSample>(link::channel::kDepth, [&](const DepthSample& sample) {
      if (!set_back && sample.utime < last) set_back = sample.utime;
      last = sample.utime;
    });
    SteadyClock clock;
    ASSERT_TRUE(bus->wait(clock, clock.now() + from_seconds(kLong),
                          [&] { return set_back && to_seconds(last - *set_back) >= 1.0; }));
  }

  static std::string mission(const std::string& name) {
    return fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, name);
  }

  [[nodiscard]] std::unique_ptr<Process> dive(const std::string& name,
                                              std::vector<std::string> words) const {
    words.insert(words.begin(), DIVE_COMMAND);
    words.insert(words.begin(), launcher_.begin(), launcher_.end());
    if (std::ranges::find(words, "--lcm") == words.end()) {
      words.insert(words.end(), {"--lcm", url_});
    }
    // Some tests dive twice.
    if (words[launcher_.size() + 1] == "run") words.emplace_back("--force");
    words.emplace_back("--json");
    return std::make_unique<Process>(words, folder_, name);
  }

  /// Sends a topside command and returns its exit status.
  int say(const std::string& name, std::vector<std::string> words) const {
    return dive(name, std::move(words))->wait(kLong);
  }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }

  /// Calibration of the simulated vehicle's cameras.
  [[nodiscard]] std::string cameras(const std::string& mission) const {
    const std::string folder = path("cameras");
    EXPECT_EQ(say("calibration", {"sim", mission, "--write-calibration", folder}), 0);
    return folder;
  }

  /// The mission murk in a shallower bay with a thick post on the straight path: the vehicle's
  /// motion there depends on its observations.
  [[nodiscard]] std::string murk() const {
    const auto box = [](const char* name, const char* at, const char* size) {
      return fmt::format(
          "<model name='{}'><static>1</static><pose>{} 0 0 0</pose><link name='l'>"
          "<collision name='c'><geometry><box><size>{}</size></box></geometry>"
          "</collision></link></model>",
          name, at, size);
    };
    fs::create_directories(path("maps"));
    std::ofstream(path("maps/bay.sdf"))
        << "<sdf version='1.6'><world name='bay'>" << box("seabed", "0 0 -6.5", "60 60 1")
        << box("post", "3.5 0.2 -3", "1 1 6") << "</world></sdf>";
    fs::copy_file(mission("scenarios/missions/murk"), path("murk.xml"),
                  fs::copy_options::overwrite_existing);
    return path("murk.xml");
  }

  std::string folder_;
  std::string url_;
  std::string far_url_;
  std::vector<std::string> launcher_;  ///< Words before the command.
};

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
TEST_F(Processes, InLockStepASignedBundleIsDivedAsByTheBuiltInSimulator) {
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
                HasSubstr(dived == bundle ? "signed with this key" : "not a verified bundle"));
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
  EXPECT_THAT(report.at("cause").get<std::string>(), HasSubstr("topside says abort"));
  EXPECT_GE(report.at("stats").at("refused").at("auth_failed").get<int>(), 1);
  EXPECT_EQ(vehicle->json().at("collisions"), 0);
  Process explain({DIVE_COMMAND, "explain", path("log")}, folder_, "explain");
  EXPECT_EQ(explain.wait(kLong), 0);
  for (const char* said : {"topside says pause", "topside says resume", "topside says skip"}) {
    EXPECT_THAT(explain.out(), HasSubstr(said));
  }
}

TEST_F(Processes, WithAKeyNoForgedOrRepeatedPacketIsObeyed) {
  ASSERT_EQ(Process({DIVE_COMMAND, "key", path("key")}, folder_, "key").wait(kLong), 0);
  std::string text = content_of(mission("pool3"));
  const std::size_t at = text.find("<failsafes>");
  ASSERT_NE(at, std::string::npos);
  text.insert(at, "<operator abort=\"key\"/>");
  std::ofstream(path("pool.xml")) << text;
  fs::copy(DIVE_SOURCE_DIR "/missions/maps", path("maps"));
  const std::string pool = path("pool.xml");
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
  std::string text = content_of(mission("pool3"));
  text.insert(text.find("<failsafes>"), "<operator abort=\"key\"/>");
  std::ofstream(path("pool.xml")) << text;
  fs::copy(DIVE_SOURCE_DIR "/missions/maps", path("maps"));
  const auto refused = dive("run", {"run", path("pool.xml")});
  EXPECT_EQ(refused->wait(kLong), 2);
  EXPECT_THAT(refused->err(), HasSubstr("abort only with the key"));
}

class Death : public Processes {
 protected:
  // In open water.
  void begin(const std::vector<std::string>& pace = {"--time-factor", kPace},
             const std::vector<std::string>& vehicle = {}) {
    begin("pool3", 8.0, pace, vehicle);
  }
  void begin(const std::string& name, double until_s, const std::vector<std::string>& pace,
             const std::vector<std::string>& vehicle = {}) {
    std::vector<std::string> sim = {"sim", mission(name)};
    std::vector<std::string> supervise = {"supervise"};
    std::vector<std::string> run = {"run", mission(name), "--log", path("log")};
    sim.insert(sim.end(), vehicle.begin(), vehicle.end());
    sim.insert(sim.end(), pace.begin(), pace.end());
    run.insert(run.end(), pace.begin(), pace.end());
    if (pace.size() == 2) supervise.insert(supervise.end(), pace.begin(), pace.end());
    vehicle_ = dive("sim", sim);
    supervisor_ = dive("supervise", supervise);
    executive_ = dive("run", run);
    wait_for_vehicle_time(until_s);
  }
  // In the hold of the wreck: the way out leads through the gash in her side.
  void begin_inside() { begin("penetration", 45.0, {"--time-factor", kFastPace}); }

  /// Waits until the supervisor has said so.
  void wait_for_supervisor(const std::string& words) const {
    for (double waited = 0.0; waited < kLong; waited += 0.05) {
      if (supervisor_->err().find(words) != std::string::npos) return;
      if (supervisor_->wait(0.05) >= 0) break;
    }
    FAIL() << "the supervisor did not say: " << words << "\n" << supervisor_->err();
  }

  /// The mission pool3 with another element before `place`.
  [[nodiscard]] std::string pool_with(const std::string& element, const std::string& place) const {
    std::string text = content_of(mission("pool3"));
    const std::size_t at = text.find(place);
    EXPECT_NE(at, std::string::npos);
    text.insert(at, element);
    std::ofstream(path("pool.xml")) << text;
    fs::copy(DIVE_SOURCE_DIR "/missions/maps", path("maps"));
    return path("pool.xml");
  }
  /// The same, which a restarted executive continues.
  [[nodiscard]] std::string resumable() const {
    return pool_with("<resume policy=\"continue\"/>", "<failsafes>");
  }

  std::unique_ptr<Process> vehicle_;
  std::unique_ptr<Process> supervisor_;
  std::unique_ptr<Process> executive_;
};

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

TEST_F(Death, OfTheSupervisorDisturbsNobody) {
  begin({"--lockstep"});
  supervisor_->kill(SIGKILL);
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
}

TEST_F(Death, ARestartedExecutiveGoesOnWhereItWas) {
  const std::string pool = resumable();
  vehicle_ = dive("sim", {"sim", pool, "--lockstep"});
  executive_ = dive("run", {"run", pool, "--lockstep", "--log", path("log")});
  wait_for_vehicle_time(8.0);
  executive_->kill(SIGKILL);
  executive_ = dive("resumed", {"run", pool, "--lockstep", "--resume", "--journal",
                                path("log.journal"), "--log", path("log2")});
  EXPECT_EQ(executive_->wait(kLong), 0) << executive_->err();
  EXPECT_EQ(vehicle_->wait(kLong), 0) << vehicle_->err();
  EXPECT_EQ(executive_->json().at("transitions").at(0).at("cause"), "the executive was restarted");
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

TEST_F(Death, BySignalBeforeTheDiveIsNoAbort) {
  executive_ = dive("run", {"run", mission("pool3"), "--log", path("log")});
  while (!fs::exists(path("log"))) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  executive_->kill(SIGTERM);
  EXPECT_EQ(executive_->wait(kLong), 128 + SIGTERM) << executive_->err();
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

TEST_F(Death, ARestartedExecutiveGoesOnWithoutItsLogOnAFullDisk) {
  const std::string pool = resumable();
  vehicle_ = dive("sim", {"sim", pool, "--lockstep"});
  executive_ = dive("run", {"run", pool, "--lockstep", "--log", path("log")});
  wait_for_vehicle_time(8.0);
  executive_->kill(SIGKILL);
  executive_->wait(kLong);
  EXPECT_EQ(fs::file_size(path("log.journal")), 2U << 20U);
  // A limit on file size that is smaller than the log's header simulates a full disk.
  const auto on_full_disk = [&](const std::string& name, const std::string& options) {
    const std::string command = "trap '' XFSZ; ulimit -f 12; exec " DIVE_COMMAND " run " + pool +
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

TEST_F(Processes, ASensorsClockThatIsSetDisturbsNobody) {
  const auto vehicle =
      dive("sim", {"sim", mission("pool3"), "--time-factor", kPace, "--clock-jump=-3600@10"});
  const auto executive = dive(
      "run", {"run", mission("pool3"), "--time-factor", kPace, "--log", path("log"), "--stats"});
  EXPECT_EQ(executive->wait(kLong), 0) << executive->err();
  EXPECT_EQ(vehicle->wait(kLong), 0) << vehicle->err();
  EXPECT_GE(executive->json().at("stats").at("clock_jumps").get<int>(), 2);
  EXPECT_EQ(dive("bad", {"sim", mission("pool3"), "--clock-jump", "soon"})->wait(kLong), 2);
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
  EXPECT_THAT(lonely->err(), HasSubstr("no heartbeat of an executive"));
}

}  // namespace
}  // namespace dive::mission
