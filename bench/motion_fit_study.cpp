// Fits the motion model to nine simulated dives of one vehicle and measures its open-loop error, by
// ground truth, on dives of other missions that the fit has not seen:
//     motion_fit_study                        a hull with each figure 20 % off (one sigma)
//     motion_fit_study --scatter 0            the nominal hull, to which today's model is matched
//     motion_fit_study --hulls 4 --seed 71    four hulls, all draws from another seed
//
// The fit has what a vehicle records, as in `dive fit`. The error is that of the motion over 10 s
// and 30 s, with true attitude about the vertical and without the current, which no motion model
// knows.

#include <array>
#include <cstdint>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/run_study.h"
#include "bench/study_setup.h"
#include "common/random.h"
#include "estimation/motion_fit/motion_fit.h"
#include "estimation/motion_fit/open_loop.h"
#include "estimation/planar.h"
#include "mission/fit/recorded_motion.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::bench {
namespace {

using estimation::MotionRecord;

constexpr std::array<const char*, 9> kFitted{"cluttered", "wreck", "pool1",  "pool2",      "pool3",
                                             "pool4",     "maze",  "blocks", "penetration"};
constexpr std::array<const char*, 4> kUnseen{"window", "orbit", "survey", "transect"};
constexpr std::array<double, 2> kHorizons_s{10.0, 30.0};
constexpr Utime kTruthPeriod = 500'000;  // us between two true positions that are compared

/// A dive as its log has it, and the same with the true position and heading as its fixes.
struct Dive {
  MotionRecord recorded;
  MotionRecord with_truth;
};

struct Options {
  double scatter = 0.2;
  int hulls = 1;
  std::uint64_t seed = 24'117;
};

MapFix true_fix(const vehicle::GroundTruth& truth, const ImuSample& imu) {
  constexpr double kCertain = 1e8;
  MapFix fix;
  fix.scan_utime = truth.utime;
  fix.position_W = truth.X_WB.p.head<2>();
  const Eigen::Quaterniond compass =
      imu.q_WB * so3_exp(to_seconds(truth.utime - imu.utime) * imu.gyro_B);
  fix.heading_correction = estimation::turn_between(truth.X_WB.q, compass);
  fix.information = kCertain * Eigen::Matrix3d::Identity();
  return fix;
}

Dive dive(const std::string& name, std::uint64_t seed, std::uint64_t hull, double scatter,
          bool still_water) {
  const StudySetup setup = load_shipped_setup(name);
  mission::DiveSettings settings;
  settings.seed = seed;
  settings.conditions = mission::simulated_conditions(setup.mission);
  settings.conditions.hull_scatter = scatter;
  settings.conditions.hull_seed = static_cast<double>(hull);
  if (scatter == 0.0) {
    settings.conditions.buoyancy_sigma_n = 0.0;
    settings.conditions.speed_scale_sigma = 0.0;
  }
  if (still_water) settings.conditions.current_sigma = 0.0;
  mission::MotionCollector collector(fmt::format("{} with seed {}", name, seed));
  std::vector<MapFix> truths;
  const mission::DiveResult result = mission::simulate_dive(
      setup.mission, setup.world, setup.model, settings,
      [&](const mission::StepInputs& in, const mission::StepOutputs& out,
          const vehicle::GroundTruth& truth, const auto&) {
        collector.add(in, out);
        const bool is_due =
            truths.empty() || truth.utime - truths.back().scan_utime >= kTruthPeriod;
        if (in.imu && is_due) truths.push_back(true_fix(truth, *in.imu));
      });
  Dive dive{collector.take(), {}};
  dive.with_truth = {dive.recorded.name, dive.recorded.ticks, std::move(truths)};
  std::cerr << fmt::format("  {}: {}, {:.0f} s, {} fixes, {} windows\n", dive.recorded.name,
                           result.outcome, result.duration_s, dive.recorded.fixes.size(),
                           estimation::usable_windows(dive.recorded, {}));
  return dive;
}

void print_errors(const std::string& what, const std::vector<MotionRecord>& dives,
                  const MotionModel& before, const MotionModel& after) {
  const auto old_errors =
      estimation::open_loop_errors(dives, before, kHorizons_s, estimation::Drift::kIsError);
  const auto new_errors =
      estimation::open_loop_errors(dives, after, kHorizons_s, estimation::Drift::kIsError);
  for (std::size_t i = 0; i < kHorizons_s.size(); ++i) {
    const estimation::OpenLoopError& a = old_errors[i];
    const estimation::OpenLoopError& b = new_errors[i];
    if (a.errors_m.empty()) continue;
    std::cout << fmt::format(
        "  {:<12} {:>2.0f} s  median {:.3f} -> {:.3f} m ({:.2f}), p95 {:.3f} -> {:.3f} m "
        "({:.2f})\n",
        what, kHorizons_s[i], a.quantile(0.5), b.quantile(0.5), b.quantile(0.5) / a.quantile(0.5),
        a.quantile(0.95), b.quantile(0.95), b.quantile(0.95) / a.quantile(0.95));
  }
}

void study(const Options& options, std::uint64_t hull, Random& random) {
  const auto seed = [&] { return static_cast<std::uint64_t>(random.uniform(1.0, 1e9)); };
  std::vector<MotionRecord> fitted;
  for (const char* name : kFitted) {
    fitted.push_back(dive(name, seed(), hull, options.scatter, false).recorded);
  }
  std::vector<MotionRecord> unseen;
  for (const char* name : kUnseen) {
    unseen.push_back(dive(name, seed(), hull, options.scatter, true).with_truth);
  }
  const MotionModel before = load_shipped_setup(kFitted[0]).model.motion;
  const auto fit = estimation::fit_motion(fitted, before, {});
  if (!fit) throw std::runtime_error(fit.error());
  std::cout << fmt::format("hull {} with a scatter of {:g}: {} windows, {} iterations{}\n", hull,
                           options.scatter, fit->windows, fit->iterations,
                           fit->converged ? "" : ", not converged");
  for (std::size_t i = 0; i < fit->coefficients.size(); ++i) {
    const estimation::FittedCoefficient& c = fit->coefficients[i];
    std::cout << fmt::format("  {:<18} {:>8.4g} -> {:>8.4g} +- {:.2g}{}\n",
                             motion_coefficients()[i].name, c.before, c.value, c.sigma,
                             c.is_constrained ? "" : "  kept");
  }
  const auto slip = estimation::slip_sigmas(fitted, fit->model);
  std::cout << fmt::format("  slip {:.3f}, {:.3f}, {:.3f} m/s\n", slip[0].value_or(-1.0),
                           slip[1].value_or(-1.0), slip[2].value_or(-1.0));
  for (std::size_t i = 0; i < unseen.size(); ++i) {
    print_errors(kUnseen[i], {unseen[i]}, before, fit->model);
  }
  print_errors("all unseen", unseen, before, fit->model);
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Open-loop error before and after a fit of the motion model to nine dives");
  dive::bench::Options options;
  app.add_option("--scatter", options.scatter, "Of each figure of the hull, one sigma");
  app.add_option("--hulls", options.hulls, "Number of vehicles");
  app.add_option("--seed", options.seed, "Of all draws");
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    dive::Random random(options.seed, 0xf17);
    for (int i = 0; i < options.hulls; ++i) {
      const auto hull = static_cast<std::uint64_t>(random.uniform(1.0, 1e6));
      dive::bench::study(options, hull, random);
    }
  });
}
