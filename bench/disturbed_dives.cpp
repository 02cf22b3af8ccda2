// Linked dives of missions under an overhead, each disturbed at a random instant: executive killed,
// stopped for 0.2 to 10 s, ended by SIGTERM, killed and restarted, killed together with the
// supervisor, its disk stalled for 5 s, the vehicle's driver restarted, the sensors' clock set.
// Counts collisions by ground truth, also those that the same seed has undisturbed, and dives that
// end at the surface. Measures how far from the end of the exit path the vehicle is when the
// supervisor, which swam it, begins to ascend.

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "bench/quantile.h"
#include "common/parallel.h"
#include "common/random.h"
#include "test/mission/link/process.h"
#include "vehicle/link/bus.h"

namespace {

using dive::mission::testing::Process;
using Words = std::vector<std::string>;

enum class What { kKill, kStop, kTerm, kRestart, kKillBoth, kDisk, kDriver, kClock };
constexpr std::array kNames = {"SIGKILL",         "SIGSTOP",      "SIGTERM", "restarted",
                               "with supervisor", "disk stalled", "driver",  "clock set"};
constexpr double kDiskStalls_s = 5.0;  // wall time, whatever the pace of the dive

const char* name_of(What what) { return kNames[static_cast<std::size_t>(what)]; }

struct Case {
  std::string mission;
  std::uint64_t seed = 1;
  What what = What::kKill;
  double at_s = 0.0;   // vehicle time
  double value = 0.0;  // duration of a stop or an absence, or the change of a clock, s
};

struct Outcome {
  bool has_collided = false;
  bool collides_undisturbed = false;
  bool is_up = false;
  int given_back = 0;
  bool took_over = false;
  std::optional<double> exit_error_m;  // horizontal
  std::string about;
};

double factor = 4.0;
bool without_fixes = false;
std::string command = DIVE_COMMAND;

std::string mission_file(const std::string& name) {
  return fmt::format(DIVE_SOURCE_DIR "/missions/{}.xml", name);
}

// Waits until the vehicle's clock shows `at_s`; it starts with the first command.
bool wait_for(const std::string& url, double at_s) {
  auto bus = dive::link::Bus::open(url);
  if (!bus) return false;
  dive::Utime newest = 0;
  bus->listen<dive::link::Truth>(
      dive::link::channel::kTruth, [&](const dive::link::Truth& truth) { newest = truth.utime; },
      dive::link::kMaxTruthPacket);
  dive::SteadyClock clock;
  return bus->wait(clock, clock.now() + 300 * dive::kMicrosecondsPerSecond,
                   [&] { return dive::to_seconds(newest) >= at_s; });
}

// Follows a dive on the bus until it is destroyed: where the vehicle is in truth when the
// supervisor has followed an exit path and begins to ascend.
class ExitWatch {
 public:
  explicit ExitWatch(const std::string& url)
      : thread_([this, url](const std::stop_token& stop) { watch(url, stop); }) {}

  /// Horizontal distance to the end of the exit path, m. Ends the watch.
  [[nodiscard]] std::optional<double> error_m() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    return error_m_;
  }

 private:
  void watch(const std::string& url, const std::stop_token& stop) {
    auto bus = dive::link::Bus::open(url);
    if (!bus) return;
    bus->listen<dive::link::Truth>(
        dive::link::channel::kTruth,
        [this](const dive::link::Truth& truth) { p_W_ = truth.X_WB.p; },
        dive::link::kMaxTruthPacket);
    bus->listen<dive::link::ExitPathMessage>(
        dive::link::channel::kExitPath,
        [this](const dive::link::ExitPathMessage& message) { path_ = message.path; },
        dive::link::kMaxExitPathPacket);
    bus->listen<dive::link::VehicleCommand>(
        dive::link::channel::kCommand,
        [this](const dive::link::VehicleCommand& sent) { take(sent); });
    dive::SteadyClock clock;
    while (!stop.stop_requested()) bus->wait(clock, clock.now() + 50'000);
  }

  void take(const dive::link::VehicleCommand& sent) {
    if (sent.source != dive::link::Source::kSupervisor) return;
    const ExitPhase before = std::exchange(phase_, sent.phase);
    if (before != ExitPhase::kFollowing || phase_ != ExitPhase::kAscending) return;
    const Eigen::Vector3d& end = path_.waypoints.empty() ? path_.X_WB.p : path_.waypoints.back().p;
    error_m_ = (p_W_ - end).head<2>().norm();
  }

  using ExitPhase = dive::vehicle::ExitPhase;
  Eigen::Vector3d p_W_ = Eigen::Vector3d::Zero();
  dive::vehicle::ExitPath path_;
  ExitPhase phase_ = ExitPhase::kIdle;
  std::optional<double> error_m_;
  std::jthread thread_;  // last: it uses the others
};

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

bool collides_undisturbed(const Case& one, const std::string& folder) {
  Process dive({command, "run", mission_file(one.mission), "--seed", fmt::format("{}", one.seed),
                "--log", folder + "/undisturbed.lcmlog", "--json"},
               folder, "undisturbed");
  dive.wait(120.0);
  return dive.json().at("collisions").get<int>() > 0;
}

Words simulator_words(const Case& one) {
  Words words = {"sim", mission_file(one.mission)};
  const std::string disturbance = fmt::format("{}@{}", one.value, one.at_s);
  if (one.what == What::kDriver) words.insert(words.end(), {"--driver-restart", disturbance});
  if (one.what == What::kClock) words.push_back("--clock-jump=" + disturbance);
  return words;
}

/// The processes of one dive.
class LinkedDive {
 public:
  LinkedDive(const Case& one, int index, const std::string& folder)
      : one_(one),
        folder_(folder),
        // Studies that run at the same time need their own ports.
        url_(fmt::format("udpm://239.255.76.67:{}?ttl=0", 20'000 + ::getpid() % 80 * 500 + index)),
        stalled_disk_(folder + "/disk-is-stalled"),
        watch_(url_) {
    Words sim = simulator_words(one);
    sim.insert(sim.end(), {"--seed", fmt::format("{}", one.seed)});
    vehicle_ = start("sim", sim);
    supervisor_ = start("supervise", supervise_words());
    executive_ = start("run", run_words("log"));
  }

  Outcome run() {
    Outcome outcome;
    if (!wait_for(url_, one_.at_s)) {
      outcome.about = "the dive did not begin: " + executive_->err();
      return outcome;
    }
    disturb();
    if (vehicle_->wait(600.0) < 0) {
      outcome.about = "the vehicle is still under way";
      return outcome;
    }
    outcome.exit_error_m = watch_.error_m();
    const auto report = vehicle_->json();
    outcome.has_collided = report.at("collisions").get<int>() > 0;
    outcome.is_up = report.at("final_depth_m").get<double>() < 0.4;
    if (supervisor_->wait(10.0) >= 0 && one_.what != What::kKillBoth) {
      const auto said = supervisor_->json();
      outcome.given_back = said.at("given_back").get<int>();
      outcome.took_over = said.at("took_over").get<bool>();
    }
    outcome.about = fmt::format(
        "{} at {:.2f} m, {}{} collision(s){}", report.at("ended").get<std::string>(),
        report.at("final_depth_m").get<double>(),
        outcome.exit_error_m
            ? fmt::format("{:.2f} m from the end of its exit path, ", *outcome.exit_error_m)
            : "",
        report.at("collisions").get<int>(),
        outcome.has_collided ? " " + report.at("collision_list").at(0).dump() : "");
    if (outcome.has_collided) outcome.collides_undisturbed = collides_undisturbed(one_, folder_);
    return outcome;
  }

 private:
  std::unique_ptr<Process> start(const std::string& name, Words words) const {
    words.insert(words.begin(), {"/usr/bin/env", "LD_PRELOAD=" STALLED_DISK,
                                 "DIVE_STALLED_DISK=" + stalled_disk_, command});
    words.insert(words.end(),
                 {"--time-factor", fmt::format("{}", factor), "--lcm", url_, "--json"});
    return std::make_unique<Process>(words, folder_, name);
  }

  [[nodiscard]] Words supervise_words() const {
    if (without_fixes) return {"supervise"};
    return {"supervise", mission_file(one_.mission)};
  }

  [[nodiscard]] Words run_words(const char* log) const {
    return {"run",   mission_file(one_.mission), "--seed", fmt::format("{}", one_.seed),
            "--log", folder_ + "/" + log};
  }

  void disturb() {
    switch (one_.what) {
      case What::kStop:
        executive_->kill(SIGSTOP);
        sleep_s(one_.value / factor);
        executive_->kill(SIGCONT);
        break;
      case What::kTerm:
        executive_->kill(SIGTERM);
        break;
      case What::kKillBoth:
        supervisor_->kill(SIGKILL);
        [[fallthrough]];
      case What::kKill:
        executive_->kill(SIGKILL);
        break;
      case What::kRestart: {
        executive_->kill(SIGKILL);
        sleep_s(one_.value / factor);
        Words words = run_words("log2");
        words.insert(words.end(), {"--resume", "--journal", folder_ + "/log.journal"});
        executive_ = start("resumed", words);
        break;
      }
      case What::kDisk:
        std::ofstream(stalled_disk_).put('\n');
        sleep_s(kDiskStalls_s);
        std::filesystem::remove(stalled_disk_);
        break;
      case What::kDriver:
      case What::kClock:
        break;
    }
  }

  Case one_;
  std::string folder_;
  std::string url_;
  std::string stalled_disk_;  // while this file exists
  ExitWatch watch_;
  std::unique_ptr<Process> vehicle_;
  std::unique_ptr<Process> supervisor_;
  std::unique_ptr<Process> executive_;
};

std::vector<Case> make_cases(int dives, std::uint64_t seed) {
  dive::Random random(seed);
  std::vector<Case> cases;
  for (int i = 0; i < dives; ++i) {
    Case one;
    one.mission = i % 2 == 0 ? "penetration" : "wreck";
    one.seed = seed + static_cast<std::uint64_t>(i);
    one.what = static_cast<What>((i / 2) % static_cast<int>(kNames.size()));
    one.at_s = random.uniform(2.0, 110.0);
    const double share = random.uniform(0.0, 1.0);
    one.value = 0.2 + 9.8 * share;
    if (one.what == What::kRestart) one.value = 0.3 + 4.7 * share;
    if (one.what == What::kDriver) one.value = 0.2 + 2.8 * share;
    if (one.what == What::kClock) one.value = share < 0.5 ? -20.0 : 3600.0;
    cases.push_back(one);
  }
  return cases;
}

void print_table(const std::vector<Case>& cases, const std::vector<Outcome>& outcomes) {
  fmt::print("{:16} {:>6} {:>9} {:>12} {:>8} {:>10} {:>10}\n", "disturbance", "dives", "collided",
             "undisturbed", "surfaced", "given back", "brought up");
  for (std::size_t what = 0; what < kNames.size(); ++what) {
    std::array<int, 6> sums{};
    for (std::size_t i = 0; i < cases.size(); ++i) {
      if (cases[i].what != static_cast<What>(what)) continue;
      const Outcome& o = outcomes[i];
      const std::array<bool, 6> is = {true,    o.has_collided,   o.collides_undisturbed,
                                      o.is_up, o.given_back > 0, o.took_over};
      for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += is[k] ? 1 : 0;
    }
    fmt::print("{:16} {:6} {:9} {:12} {:8} {:10} {:10}\n", kNames[what], sums[0], sums[1], sums[2],
               sums[3], sums[4], sums[5]);
  }
}

void print_exit_errors(const std::vector<Outcome>& outcomes) {
  std::vector<double> errors;
  for (const Outcome& outcome : outcomes) {
    if (outcome.exit_error_m) errors.push_back(*outcome.exit_error_m);
  }
  if (errors.empty()) return;
  std::ranges::sort(errors);
  fmt::print(
      "{} followed an exit path; from its end: median {:.2f} m, 90 % {:.2f} m, max {:.2f} m\n",
      errors.size(), dive::bench::quantile(errors, 0.5), dive::bench::quantile(errors, 0.9),
      errors.back());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Disturbs linked dives of penetration and wreck at random instants.");
  int dives = 28;
  int jobs = 2;
  std::uint64_t seed = 1;
  std::string only;
  std::uint64_t one_dive = 0;
  app.add_option("--one", one_dive, "Only the dive with this seed");
  app.add_option("--only", only, "One disturbance of them")
      ->check(CLI::IsMember(std::vector<std::string>(kNames.begin(), kNames.end())));
  app.add_option("--dives", dives, "Half of each mission, before --only");
  app.add_option("--command", command, "The command to test, in place of this build's");
  app.add_flag("--without-fixes", without_fixes, "The supervisor has no map, and dead-reckons");
  app.add_option("--jobs", jobs, "Dives at a time");
  app.add_option("--time-factor", factor, "Times real time");
  app.add_option("--seed", seed, "Of the instants, and of the first dive");
  CLI11_PARSE(app, argc, argv);

  std::vector<Case> cases = make_cases(dives, seed);
  if (!only.empty()) {
    std::erase_if(cases, [&](const Case& one) { return only != name_of(one.what); });
  }
  if (one_dive != 0) std::erase_if(cases, [&](const Case& one) { return one.seed != one_dive; });
  std::vector<Outcome> outcomes(cases.size());
  std::string pattern = (std::filesystem::temp_directory_path() / "dive-disturbed-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(pattern.data());
  std::mutex printing;
  dive::run_in_parallel(cases.size(), jobs, [&](std::size_t i) {
    const std::string own = (folder / fmt::format("{}", i)).string();
    std::filesystem::create_directories(own);
    outcomes[i] = LinkedDive(cases[i], static_cast<int>(i), own).run();
    std::filesystem::remove_all(own);
    const Case& one = cases[i];
    const std::lock_guard lock(printing);
    fmt::print("{} seed {}, {} at {:.1f} s ({:.1f}): {}\n", one.mission, one.seed,
               name_of(one.what), one.at_s, one.value, outcomes[i].about);
    std::fflush(stdout);
  });
  std::filesystem::remove_all(folder);
  print_table(cases, outcomes);
  print_exit_errors(outcomes);
  return std::ranges::all_of(outcomes,
                             [](const Outcome& o) {
                               return o.is_up && (!o.has_collided || o.collides_undisturbed);
                             })
             ? 0
             : 1;
}
