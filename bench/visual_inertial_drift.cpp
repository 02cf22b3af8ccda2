// The visual-inertial filter on 50 analytic dives around an oval of 115 m: drift, consistency,
// depth, time a frame; then in the dark for seven seconds, in snow, and the law of its covariance.

#include <algorithm>
#include <cmath>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "test/estimation/visual_inertial/filter_dive.h"

namespace {

using namespace dive;
using namespace dive::testing;

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

struct Study {
  AnalyticDiveOptions dive;
  int runs = 50;
  double seconds = 286.0;
  int landmarks = 20;
  int clones = 11;
  int update_features = 20;
  double keyframe_m = 0.15;
  bool verbose = false;
};

int laps(const Study& study) {
  std::vector<double> drift, depth, ms, nees_p, nees_a, final_p, final_a, ratio;
  std::int64_t used = 0, snow = 0, offered = 0;
  int diverged = 0;
  for (int i = 0; i < study.runs; ++i) {
    const auto seed = static_cast<std::uint64_t>(1000 + i);
    AnalyticDive dive(study.dive, seed);
    estimation::VisualInertialOptions options = told(dive, study.dive);
    options.max_landmarks = study.landmarks;
    options.max_clones = study.clones;
    options.max_update_features = study.update_features;
    options.keyframe_distance_m = study.keyframe_m;
    Random random(seed, 5);
    const double begin = random.uniform(0.0, 100.0);
    estimation::VisualInertialFilter filter(options, known_start(dive, begin, random));
    const FilterDiveResult result = run(dive, study.dive, filter, begin, begin + study.seconds);
    const ErrorSample& last = result.errors.back();
    drift.push_back(100.0 * last.position.norm() / result.distance_m);
    double sum = 0.0, p = 0.0, a = 0.0;
    for (const ErrorSample& e : result.errors) {
      sum += e.position.z() * e.position.z();
      p += e.nees_position;
      a += e.nees_attitude;
    }
    const auto n = static_cast<double>(result.errors.size());
    depth.push_back(std::sqrt(sum / n));
    nees_p.push_back(p / n);
    nees_a.push_back(a / n);
    final_p.push_back(last.nees_position);
    final_a.push_back(last.nees_attitude);
    ratio.push_back(filter.health().visual_innovation_ratio);
    ms.insert(ms.end(), result.frame_ms.begin(), result.frame_ms.end());
    used += result.used;
    snow += result.used_snow;
    offered += result.offered_snow;
    diverged += filter.health().diverged ? 1 : 0;
    if (study.verbose) {
      fmt::print(
          "seed {}: drift {:.3f} %, yaw/att {:.2f} deg, nees {:.2f} {:.2f} (end {:.2f} {:.2f}), "
          "depth {:.3f}, ratio {:.2f}, {}\n",
          seed, drift.back(), rad_to_deg(last.attitude), nees_p.back(), nees_a.back(),
          final_p.back(), final_a.back(), depth.back(), ratio.back(), filter.health().reason);
    }
  }
  fmt::print("drift %: mean {:.3f}, median {:.3f}, worst {:.3f}\n", mean(drift),
             quantile(drift, 0.5), quantile(drift, 1.0));
  fmt::print("nees (3): position {:.2f}, attitude {:.2f}; at the end {:.2f}, {:.2f}\n",
             mean(nees_p), mean(nees_a), mean(final_p), mean(final_a));
  fmt::print("depth rms {:.4f} m; innovation ratio {:.2f}; diverged {}\n", mean(depth), mean(ratio),
             diverged);
  fmt::print("ms a frame: mean {:.2f}, p99 {:.2f}, worst {:.2f}\n", mean(ms), quantile(ms, 0.99),
             quantile(ms, 1.0));
  fmt::print(
      "used {} landmarks, of them snow {} ({:.2f} % of those used); {} sights of snow\n", used,
      snow,
      100.0 * static_cast<double>(snow) / static_cast<double>(std::max<std::int64_t>(used, 1)),
      offered);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Drift and consistency of the visual-inertial filter.");
  Study study;
  bool mono = false;
  app.add_option("--runs", study.runs, "");
  app.add_option("--seconds", study.seconds, "");
  app.add_option("--landmarks", study.landmarks, "");
  app.add_option("--clones", study.clones, "");
  app.add_option("--update-features", study.update_features, "");
  app.add_option("--keyframe", study.keyframe_m, "");
  app.add_option("--snow", study.dive.snow_share, "");
  app.add_option("--speed", study.dive.speed, "");
  app.add_option("--imu-hz", study.dive.imu_hz, "");
  app.add_flag("--mono", mono, "");
  app.add_flag("-v", study.verbose, "");
  CLI11_PARSE(app, argc, argv);
  study.dive.is_stereo = !mono;
  return laps(study);
}
