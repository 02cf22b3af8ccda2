// The planner on random worlds, checked by two methods that share no code with it: the simulator's
// ground truth measures every returned path every millimetre, and OMPL's RRTConnect tries every
// world without a path.
//     stress_planner --worlds 1000

#include <algorithm>
#include <chrono>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/peers.h"
#include "common/assert.h"
#include "common/clock.h"
#include "planning/planner.h"
#include "test/planning/brute_force.h"
#include "test/planning/random_world.h"
#include "vehicle/model.h"

namespace dive::bench {
namespace {

// m: possible initial loss of clearance at a start in a tight place
constexpr double kGrace = 0.02;

using planning::PlanResult;
using planning::PlanStatus;
using testing::RandomQuestion;

bool rrt_connect_solves(const RandomQuestion& question, const planning::RobotHull& hull,
                        double seconds) {
  PeerTask task;
  task.start = question.request.start;
  task.goal = question.request.goal;
  task.clearance = question.request.limits.clearance;
  task.min_z = question.request.limits.min_z;
  task.length_target = std::numeric_limits<double>::infinity();
  task.time_limit_s = seconds;
  task.look = 0.01;
  task.seed = question.request.seed;
  return run_peer("RRTConnect", question.world, hull, task).reached;
}

struct Counts {
  int solved = 0;
  int reduced = 0;
  int invalid = 0;
  int no_path = 0;
  int too_near = 0;  ///< Paths nearer to an obstacle than certified or demanded.
  int missed = 0;    ///< Worlds without our path that RRTConnect solves.
  double min_margin = std::numeric_limits<double>::infinity();  ///< Measured minus certified, m.
};

/// Measures the clearance of a returned path.
void check_path(std::uint64_t seed, const RandomQuestion& question, const planning::RobotHull& hull,
                const PlanResult& result, Counts& counts) {
  const bool is_reduced = result.status == PlanStatus::kReduced;
  ++(is_reduced ? counts.reduced : counts.solved);
  const double allowed = testing::measured_too_little(question.world);
  const double measured = testing::measured_clearance(question.world, hull, result.waypoints,
                                                      result.clearance_m - allowed);
  const double margin = measured + allowed - result.clearance_m;
  counts.min_margin = std::min(counts.min_margin, margin);
  // A start with less clearance than required is allowed to leave.
  const double at_start =
      testing::measured_clearance(question.world, hull, {question.request.start}, 0.0);
  const double asked = question.request.limits.clearance;
  const double demanded = is_reduced ? std::min(asked, at_start) : asked;
  if (margin >= 0.0 && result.clearance_m >= demanded - kGrace) return;
  ++counts.too_near;
  std::cout << fmt::format("world {}: certified {:.4f} m, measured {:.4f} m, demanded {:.4f}\n",
                           seed, result.clearance_m, measured, demanded);
}

int stress(int worlds, std::uint64_t first, double rrt_seconds) {
  Diagnostics diagnostics;
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  DIVE_DEMAND(model.has_value());
  const planning::RobotHull& hull = model->hull;
  SteadyClock clock;
  Counts counts;
  std::vector<double> times;
  for (std::uint64_t seed = first; seed < first + static_cast<std::uint64_t>(worlds); ++seed) {
    const RandomQuestion question = testing::random_question(seed, hull);
    planning::Planner planner(question.world, hull, {}, clock);
    const PlanResult result = planner.plan(question.request);
    times.push_back(planner.statistics().total_ms);
    if (result.status == PlanStatus::kInvalid) {
      ++counts.invalid;
    } else if (planning::has_path(result.status)) {
      check_path(seed, question, hull, result, counts);
    } else {
      ++counts.no_path;
      if (rrt_connect_solves(question, hull, rrt_seconds)) {
        ++counts.missed;
        std::cout << fmt::format("world {}: RRTConnect has a path, we: {}\n", seed, result.reason);
      }
    }
  }
  std::ranges::sort(times);
  const auto at = [&](double share) {
    return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::cout << fmt::format(
      "{} worlds from seed {}: {} solved, {} reduced, {} without a path, {} refused; {} nearer "
      "than certified "
      "(least margin {:.1f} mm), {} that RRTConnect solves in {:.0f} s and we do not\n"
      "plan time: median {:.1f} ms, 99 % {:.1f} ms, longest {:.1f} ms\n",
      worlds, first, counts.solved, counts.reduced, counts.no_path, counts.invalid, counts.too_near,
      1e3 * counts.min_margin, counts.missed, rrt_seconds, at(0.5), at(0.99), at(1.0));
  return counts.too_near + counts.missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("The planner on random worlds, beside a brute-force check and RRTConnect");
  int worlds = 1000;
  std::uint64_t first = 1;
  double seconds = 10.0;
  app.add_option("--worlds", worlds, "Number of worlds")->check(CLI::PositiveNumber);
  app.add_option("--from", first, "Seed of the first world");
  app.add_option("--rrt-seconds", seconds, "Time for RRTConnect where we have no path")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  return dive::bench::stress(worlds, first, seconds);
}
