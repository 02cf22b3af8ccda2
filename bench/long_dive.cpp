// Dives over the link in lock-step for hours: growth of the executive's memory, and the time from a
// restart with --resume to the first command near the end. Exit status 0: the dive ended at the
// surface within the bounds printed.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "test/mission/link/process.h"
#include "vehicle/link/bus.h"

namespace {

using dive::mission::testing::Process;
using Words = std::vector<std::string>;

constexpr double kSettled_s = 600.0;  // after which memory should grow no more
constexpr double kReport_s = 3600.0;  // dive time between reports
constexpr double kMaxGrowth_MB = 10.0;
constexpr double kMaxResume_s = 0.5;
constexpr double kPatience_s = 600.0;  // wall time without progress

double resident_MB(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(status, line);) {
    std::istringstream words(line);
    std::string key;
    double kB = 0.0;
    if (words >> key >> kB && key == "VmRSS:") return kB / 1024.0;
  }
  return 0.0;
}

/// What the link shows of the dive.
class Observer {
 public:
  explicit Observer(const std::string& url) : bus_(*dive::link::Bus::open(url)) {
    bus_.listen<dive::link::Truth>(
        dive::link::channel::kTruth, [this](const dive::link::Truth& truth) { now_ = truth.utime; },
        dive::link::kMaxTruthPacket);
    bus_.listen<dive::link::VehicleCommand>(
        dive::link::channel::kCommand,
        [this](const dive::link::VehicleCommand& command) { session_ = command.session_id; });
  }

  [[nodiscard]] bool wait_until(double dive_s) {
    return wait([&] { return dive::to_seconds(now_) >= dive_s; });
  }
  [[nodiscard]] bool wait_for_another_session() {
    return wait([&, old = session_] { return session_ != old; });
  }

 private:
  template <typename Condition>
  bool wait(Condition condition) {
    return bus_.wait(clock_, clock_.now() + dive::from_seconds(kPatience_s), condition);
  }

  dive::link::Bus bus_;
  dive::SteadyClock clock_;
  dive::Utime now_ = 0;
  std::uint64_t session_ = 0;
};

struct Result {
  double growth_MB = 0.0;
  double resume_s = 0.0;
  double wall_s = 0.0;
  double final_depth_m = 0.0;
  int collisions = 0;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Result run(const std::filesystem::path& folder, double hours, const std::string& seed) {
  const std::string url = "udpm://239.255.76.67:29876?ttl=0";
  std::filesystem::copy(DIVE_SOURCE_DIR "/bench/long_survey.xml", folder);
  std::filesystem::copy(DIVE_SOURCE_DIR "/missions/maps/transect.sdf", folder);
  const auto start = [&](const std::string& name, Words words) {
    words.insert(words.begin(), DIVE_COMMAND);
    words.insert(words.end(), {"--lockstep", "--lcm", url, "--seed", seed, "--json"});
    return std::make_unique<Process>(words, folder.string(), name);
  };
  const std::string mission = folder / "long_survey.xml";
  const std::string journal = folder / "first.journal";
  const auto begin = std::chrono::steady_clock::now();
  Observer observer(url);
  const auto vehicle =
      start("sim", {"sim", mission, "--for", "36000", "--set", "battery_capacity_wh=2000"});
  auto executive =
      start("run", {"run", mission, "--log", folder / "first.log", "--journal", journal});
  Result result;
  double settled_MB = 0.0;
  for (double t = kSettled_s; t < hours * 3600.0; t += t < kReport_s ? kReport_s - t : kReport_s) {
    if (!observer.wait_until(t)) throw std::runtime_error(executive->err());
    const double now_MB = resident_MB(executive->pid());
    if (t == kSettled_s) settled_MB = now_MB;
    result.growth_MB = std::max(result.growth_MB, now_MB - settled_MB);
    fmt::print("{:6.0f} s of dive after {:6.1f} s: {:.1f} MB\n", t, seconds_since(begin), now_MB);
    std::fflush(stdout);
  }
  executive->kill(SIGKILL);
  executive->wait(10.0);
  const auto restart = std::chrono::steady_clock::now();
  executive = start("resumed", {"run", mission, "--log", folder / "second.log", "--resume",
                                "--journal", journal});
  if (!observer.wait_for_another_session()) throw std::runtime_error(executive->err());
  result.resume_s = seconds_since(restart);
  if (vehicle->wait(kPatience_s) < 0) throw std::runtime_error("the vehicle is still under way");
  result.wall_s = seconds_since(begin);
  result.final_depth_m = vehicle->json().at("final_depth_m").get<double>();
  result.collisions = vehicle->json().at("collisions").get<int>();
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Dives the rows of survey again and again over the link, in lock-step.");
  double hours = 8.0;
  std::string seed = "1";
  app.add_option("--hours", hours, "Dive time until the restart; the mission ends after 8 hours");
  app.add_option("--seed", seed, "Of everything random");
  CLI11_PARSE(app, argc, argv);

  std::string pattern = (std::filesystem::temp_directory_path() / "dive-long-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(pattern.data());
  try {
    const Result result = run(folder, hours, seed);
    fmt::print(
        "memory grew by {:.1f} MB (at most {:g}), resumed after {:.2f} s (at most {:g}), "
        "ended at {:.2f} m with {} collision(s), took {:.0f} s\n",
        result.growth_MB, kMaxGrowth_MB, result.resume_s, kMaxResume_s, result.final_depth_m,
        result.collisions, result.wall_s);
    std::filesystem::remove_all(folder);
    return result.growth_MB <= kMaxGrowth_MB && result.resume_s <= kMaxResume_s &&
                   result.final_depth_m < 0.4 && result.collisions == 0
               ? 0
               : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\nThe files are in {}.\n", error.what(), folder.string());
    return 2;
  }
}
