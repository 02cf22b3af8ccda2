// Our planner and OMPL's on every environment, as the table of doc/benchmarks.md:
//     compare_planners --date 2026-01-31 > doc/benchmarks.md
// Same world, hull, distances and required clearance. Another planner succeeds when its path is at
// most 5 % longer than ours, and fails at 100 times our median time.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/environments.h"
#include "bench/peers.h"
#include "bench/quantile.h"
#include "common/clock.h"

namespace dive::bench {
namespace {

struct Case {
  const char* mission;
  std::size_t leg;
};
constexpr Case kCases[] = {{"window", 1},   {"window", 2}, {"cluttered", 0}, {"pool1", 0},
                           {"pool2", 0},    {"pool3", 0},  {"pool4", 0},     {"maze", 0},
                           {"transect", 0}, {"wreck", 0},  {"wreck", 1},     {"wreck", 2}};
constexpr double kLonger = 1.05;
constexpr double kCap = 100.0;

struct Ours {
  int solved = 0;
  int certified = 0;
  double median_ms = 0.0;
  double p99_ms = 0.0;
  double length_m = 0.0;
  double clearance_m = 0.0;
  double warm_starts = 0.0;
};

/// Consecutive seeds from `first`.
struct Seeds {
  std::uint64_t first = 1;
  int count = 0;
};

Ours run_ours(const Environment& environment, planning::PlanRequest request, const Seeds& seeds) {
  SteadyClock clock;
  planning::Planner planner(environment.world, environment.hull, {}, clock);
  std::vector<double> times;
  std::vector<double> lengths;
  std::vector<double> clearances;
  Ours ours;
  for (int i = 0; i < seeds.count; ++i) {
    request.seed = seeds.first + static_cast<std::uint64_t>(i);
    const auto begin = std::chrono::steady_clock::now();
    const planning::PlanResult result = planner.plan(request);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    times.push_back(took.count());
    if (!planning::has_path(result.status)) continue;
    ++ours.solved;
    if (result.status == planning::PlanStatus::kSuccess) ++ours.certified;
    lengths.push_back(result.length_m);
    clearances.push_back(result.clearance_m);
    ours.warm_starts += result.warm_starts;
  }
  ours.median_ms = quantile(times, 0.5);
  ours.p99_ms = quantile(times, 0.99);
  if (ours.solved > 0) {
    ours.length_m = quantile(lengths, 0.5);
    ours.clearance_m = *std::ranges::min_element(clearances);
    ours.warm_starts /= ours.solved;
  }
  return ours;
}

/// Times of another planner to the target length, as multiples of our median.
struct Theirs {
  int reached = 0;
  double median = 0.0;  ///< Median time; kCap if most runs failed.
};

Theirs run_theirs(const std::string& peer, const Environment& environment,
                  const planning::PlanRequest& request, const Ours& ours, const Seeds& seeds) {
  PeerTask task;
  task.start = request.start;
  task.goal = request.goal;
  task.horizontal = request.limits.attitude == planning::AttitudeMode::kHorizontal;
  task.clearance = request.limits.clearance;
  task.min_z = request.limits.min_z;
  task.max_z = request.limits.max_z;
  task.length_target = kLonger * ours.length_m;
  task.time_limit_s = kCap * ours.median_ms / 1e3;
  std::vector<double> ratios;
  Theirs theirs;
  for (int i = 0; i < seeds.count; ++i) {
    task.seed = seeds.first + static_cast<std::uint64_t>(i);
    const PeerRun run = run_peer(peer, environment.world, environment.hull, task);
    if (run.reached) ++theirs.reached;
    ratios.push_back(run.reached ? std::min(run.seconds * 1e3 / ours.median_ms, kCap) : kCap);
  }
  theirs.median = quantile(ratios, 0.5);
  return theirs;
}

std::string as_multiple(double ratio) {
  return ratio < kCap ? fmt::format("{:.1f}x", ratio) : fmt::format("> {:.0f}x", kCap);
}

std::string machine() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

void compare(const std::string& date, const Seeds& seeds, const Seeds& peer_seeds) {
  std::cout << fmt::format(
      "# Planner, beside its peers\n\nMade by `compare_planners --date {} --seeds {} --peer-seeds "
      "{} --first-seed {}` on {}, one core.\n\n"
      "Ours: medians over the seeds, certificate included. Clearance: the least certified of all "
      "seeds, and what was\ndemanded. \"Solved\" counts certified paths only.\n\n"
      "| leg | solved | median | 99 % | warm starts | length | clearance |\n"
      "|---|---|---|---|---|---|---|\n",
      date, seeds.count, peer_seeds.count, seeds.first, machine());
  std::string peers = "| leg |";
  std::string rule = "|---|";
  for (const std::string& peer : peer_names()) {
    peers += " " + peer + " |";
    rule += "---|";
  }
  peers += " best |\n" + rule + "---|\n";
  for (const Case& each : kCases) {
    const Environment environment = load_environment(each.mission);
    const EnvironmentLeg& leg = environment.legs.at(each.leg);
    const std::string name = fmt::format("{}: {}", each.mission, leg.name);
    const Ours ours = run_ours(environment, leg.request, seeds);
    std::cout << fmt::format(
        "| {} | {}/{} | {:.1f} ms | {:.1f} ms | {:.1f} | {:.1f} m | {:.3f} of {:.2f} m |\n", name,
        ours.certified, seeds.count, ours.median_ms, ours.p99_ms, ours.warm_starts, ours.length_m,
        ours.clearance_m, leg.request.limits.clearance);
    std::cout.flush();
    peers += "| " + name + " |";
    double best = kCap;
    for (const std::string& peer : peer_names()) {
      const Theirs theirs = run_theirs(peer, environment, leg.request, ours, peer_seeds);
      best = std::min(best, theirs.median);
      const std::string cell =
          fmt::format("{} ({}/{})", as_multiple(theirs.median), theirs.reached, peer_seeds.count);
      peers += " " + cell + " |";
      std::cerr << fmt::format("{}: {}: {}\n", name, peer, cell);
    }
    peers += " " + as_multiple(best) + " |\n";
  }
  std::cout << fmt::format(
                   "\nOMPL's planners on the same question: time to a path at most {:.0f} % longer "
                   "than ours, as "
                   "a multiple of our\nmedian, median of {} seeds (how many got there before "
                   "{:.0f}x). RRTConnect, "
                   "KPIECE and BiTRRT are restarted and\ntheir paths simplified until one is short "
                   "enough; their "
                   "motions are looked at every 5 cm, ours are certified\nin between.\n\n",
                   100.0 * (kLonger - 1.0), peer_seeds.count, kCap)
            << peers;
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Our planner beside OMPL's, as a table");
  std::string date;
  std::uint64_t first_seed = 1;
  int seeds = 100;
  int peer_seeds = 5;
  app.add_option("--date", date, "Written into the table")->required();
  app.add_option("--seeds", seeds, "Of our planner")->check(CLI::PositiveNumber);
  app.add_option("--peer-seeds", peer_seeds, "Of each other planner")->check(CLI::PositiveNumber);
  app.add_option("--first-seed", first_seed, "Of ours and of each other planner");
  CLI11_PARSE(app, argc, argv);
  dive::bench::compare(date, {first_seed, seeds}, {first_seed, peer_seeds});
}
