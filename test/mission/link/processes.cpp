#include "test/mission/link/processes.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>

#include <fmt/format.h>
#include <unistd.h>

#include "test/common/file_content.h"
#include "vehicle/link/bus.h"

namespace dive::mission::testing {

namespace fs = std::filesystem;
using dive::testing::content_of;

std::string mission(const std::string& name) {
  return fmt::format("{}/missions/{}.xml", DIVE_SOURCE_DIR, name);
}

void Processes::SetUp() {
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

bool Processes::hears_itself() const {
  tl::expected<link::Bus, std::string> bus = link::Bus::open(url_);
  if (!bus) return false;
  bool received = false;
  bus->subscribe("DIVE_TEST", 16, [&](link::PacketView) { return received = true; });
  bus->publish("DIVE_TEST", link::Packet(8));
  SteadyClock clock;
  return bus->wait(clock, clock.now() + 20 * kMicrosecondsPerSecond, [&] { return received; });
}

void Processes::wait_for_vehicle_time(double seconds) const {
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

void Processes::wait_until_clock_is_set_back() const {
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

std::unique_ptr<Process> Processes::dive(const std::string& name,
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

int Processes::say(const std::string& name, std::vector<std::string> words) const {
  return dive(name, std::move(words))->wait(kLong);
}

std::string Processes::cameras(const std::string& mission) const {
  const std::string folder = path("cameras");
  EXPECT_EQ(say("calibration", {"sim", mission, "--write-calibration", folder}), 0);
  return folder;
}

std::string Processes::murk() const {
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

std::string Processes::pool_with(const std::string& element, const std::string& place) const {
  std::string text = content_of(mission("pool3"));
  const std::size_t at = text.find(place);
  EXPECT_NE(at, std::string::npos);
  text.insert(at, element);
  std::ofstream(path("pool.xml")) << text;
  fs::copy(DIVE_SOURCE_DIR "/missions/maps", path("maps"));
  return path("pool.xml");
}

std::string Processes::pool_aborted_by_key() const {
  return pool_with(R"(<operator abort="key"/>)", "<failsafes>");
}

void Death::begin(const std::vector<std::string>& pace, const std::vector<std::string>& vehicle) {
  begin("pool3", 8.0, pace, vehicle);
}

void Death::begin(const std::string& name, double until_s, const std::vector<std::string>& pace,
                  const std::vector<std::string>& vehicle) {
  std::vector<std::string> sim = {"sim", mission(name)};
  std::vector<std::string> supervise = {"supervise", mission(name)};
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

void Death::begin_inside() { begin("penetration", 45.0, {"--time-factor", kFastPace}); }

void Death::wait_for_supervisor(const std::string& words) const {
  for (double waited = 0.0; waited < kLong; waited += 0.05) {
    if (supervisor_->err().find(words) != std::string::npos) return;
    if (supervisor_->wait(0.05) >= 0) break;
  }
  FAIL() << "the supervisor did not say: " << words << "\n" << supervisor_->err();
}

std::string Death::resumable() const {
  return pool_with("<resume policy=\"continue\"/>", "<failsafes>");
}

}  // namespace dive::mission::testing
