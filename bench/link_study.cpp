// Hundreds of dives over the link, in parallel: kills the executive or the supervisor at a random
// moment, or aborts, and records the vehicle's response. For the latency of an abort see
// abort_study.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "common/parallel.h"
#include "common/priority.h"
#include "common/random.h"
#include "test/mission/link/process.h"
#include "vehicle/link/bus.h"
#include "vehicle/link/codec.h"

namespace {

using dive::bench::quantile;
using dive::mission::testing::Process;

enum class What { kKillExecutive, kKillSupervisor, kAbort };

struct Case {
  What what = What::kAbort;
  double at_s = 0.0;  // real time since the first command
};

struct Outcome {
  bool is_well = false;
  double lateness_ms = 0.0;  // 99.9th percentile
  double silent_s = 0.0;     // interval until the supervisor took over
  std::string why;
};

double speed = 1.0;

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

bool hears_commands(const std::string& url) {
  auto bus = dive::link::Bus::open(url);
  if (!bus) return false;
  bool received = false;
  bus->listen<dive::link::VehicleCommand>(dive::link::channel::kCommand,
                                          [&](const auto&) { received = true; });
  dive::SteadyClock clock;
  return bus->wait(clock, clock.now() + 20 * dive::kMicrosecondsPerSecond,
                   [&] { return received; });
}

Outcome run(const Case& one, int index, const std::string& folder) {
  const std::string url = fmt::format("udpm://239.255.76.67:{}?ttl=0", 30'000 + index);
  const std::string mission = DIVE_SOURCE_DIR "/missions/pool3.xml";
  const std::string pace = fmt::format("{}", speed);
  const auto start = [&](const std::string& name, std::vector<std::string> words) {
    words.insert(words.begin(), DIVE_COMMAND);
    words.insert(words.end(), {"--lcm", url, "--json"});
    return std::make_unique<Process>(words, folder, fmt::format("{}-{}", name, index));
  };
  const auto vehicle = start("sim", {"sim", mission, "--time-factor", pace});
  const auto supervisor = start("supervise", {"supervise"});
  const auto executive = start("run", {"run", mission, "--time-factor", pace, "--stats", "--log",
                                       fmt::format("{}/{}.lcmlog", folder, index)});
  Outcome outcome;
  if (!hears_commands(url)) {
    outcome.why = "the dive did not begin: " + executive->err();
    return outcome;
  }
  sleep_s(one.at_s);
  if (one.what == What::kKillExecutive) executive->kill(SIGKILL);
  if (one.what == What::kKillSupervisor) supervisor->kill(SIGKILL);
  if (one.what == What::kAbort) {
    const int status = start("abort", {"abort"})->wait(20.0);
    if (status != 0) outcome.why = "no process answered the abort; ";
  }
  if (vehicle->wait(180.0) < 0) {
    outcome.why += "the vehicle is still under way";
    return outcome;
  }
  const auto report = vehicle->json();
  const double depth = report.at("final_depth_m").get<double>();
  outcome.is_well = outcome.why.empty() && depth < 0.4;
  if (depth >= 0.4) outcome.why += fmt::format("it ended {:.2f} m deep", depth);
  if (one.what == What::kKillExecutive) {
    if (supervisor->wait(30.0) >= 0) outcome.silent_s = supervisor->json().value("silent_s", 0.0);
  } else if (executive->wait(30.0) >= 0) {
    const auto stats = executive->json().at("stats");
    outcome.lateness_ms = stats.at("lateness_ms").at("p999").get<double>();
  }
  return outcome;
}

// Timing limit of the machine itself: a bare loop that sleeps until every 20 ms, with the same
// real-time priority as the executive's.
std::vector<double> bare_lateness_ms(const std::atomic<bool>& wanted) {
  using Clock = std::chrono::steady_clock;
  dive::set_realtime_priority();
  std::vector<double> late_ms;
  for (auto due = Clock::now(); wanted;) {
    due += std::chrono::milliseconds(20);
    std::this_thread::sleep_until(due);
    late_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - due).count());
  }
  return late_ms;
}

std::vector<Case> make_cases(int kills, int aborts, std::uint64_t seed) {
  dive::Random random(seed);
  std::vector<Case> cases;
  for (int i = 0; i < kills; ++i) {
    cases.push_back({What::kKillExecutive, random.uniform(0.0, 30.0) / speed});
    cases.push_back({What::kKillSupervisor, random.uniform(0.0, 30.0) / speed});
  }
  for (int i = 0; i < aborts; ++i) {
    cases.push_back({What::kAbort, random.uniform(0.0, 25.0) / speed});
  }
  return cases;
}

/// Prints what the dives did; false if one did not surface as it should.
bool report(const std::vector<Case>& cases, const std::vector<Outcome>& outcomes,
            std::vector<double>& bare_ms) {
  int unwell = 0;
  std::vector<double> lateness_ms;
  std::vector<double> silent_s;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Outcome& outcome = outcomes[i];
    if (!outcome.is_well) {
      ++unwell;
      fmt::print("dive {}, {:.2f} s: {}\n", i, cases[i].at_s, outcome.why);
    }
    if (cases[i].what != What::kKillExecutive) lateness_ms.push_back(outcome.lateness_ms);
    if (outcome.silent_s > 0.0) silent_s.push_back(outcome.silent_s);
  }
  fmt::print("{} dives, {} not well\n", cases.size(), unwell);
  fmt::print("lateness, 99.9th percentile of a dive: median {:.2f} ms, largest {:.2f} ms\n",
             quantile(lateness_ms, 0.5), quantile(lateness_ms, 1.0));
  fmt::print("a bare loop beside it: 99.9th percentile {:.2f} ms, largest {:.2f} ms\n",
             quantile(bare_ms, 0.999), quantile(bare_ms, 1.0));
  fmt::print("the supervisor took over after at most {:.2f} s\n", quantile(silent_s, 1.0));
  return unwell == 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Kills, or aborts, dives over the link at random moments.");
  int kills = 200;
  int aborts = 100;
  int jobs = 4;
  std::uint64_t seed = 1;
  app.add_option("--kills", kills, "Of the executive, and as many of the supervisor");
  app.add_option("--aborts", aborts, "By an operator without a key");
  app.add_option("--jobs", jobs, "Dives at a time");
  app.add_option("--speed", speed, "Times real time");
  app.add_option("--seed", seed, "Of the moments");
  CLI11_PARSE(app, argc, argv);

  const std::vector<Case> cases = make_cases(kills, aborts, seed);
  const std::string folder = (std::filesystem::temp_directory_path() / "dive-link-study").string();
  std::vector<Outcome> outcomes(cases.size());
  std::atomic<bool> wanted = true;
  std::vector<double> bare_ms;
  std::jthread bare([&] { bare_ms = bare_lateness_ms(wanted); });
  dive::run_in_parallel(cases.size(), jobs, [&](std::size_t index) {
    outcomes[index] = run(cases[index], static_cast<int>(index), folder);
  });
  wanted = false;
  bare.join();
  return report(cases, outcomes, bare_ms) ? 0 : 1;
}
