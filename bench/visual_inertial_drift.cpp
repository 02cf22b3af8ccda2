// The visual-inertial filter on dives in closed form around an oval of 115 m: drift, consistency,
// depth, time per frame; darkness; marine snow; and the growth law of its covariance.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "test/estimation/visual_inertial/filter/covariance_law.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"
#include "test/estimation/visual_inertial/filter/sensor_faults.h"

namespace {

using namespace dive;
using bench::quantile;
using namespace dive::testing;
using estimation::VisualInertialFilter;

struct Study {
  AnalyticDiveOptions dive;
  int runs = 50;
  std::uint64_t first = 1000;
  double seconds = 286.0;        // one lap at 0.4 m/s
  estimation::KnownStart start;  // its sigmas
  double dark_at = -1.0;         // s after the start; negative: never
  double dark_s = 7.0;
  int landmarks = estimation::VisualInertialOptions{}.max_landmarks;
  int clones = estimation::VisualInertialOptions{}.max_clones;
  int update_features = estimation::VisualInertialOptions{}.max_update_features;
  double keyframe_m = estimation::VisualInertialOptions{}.keyframe_distance_m;
  double gate = estimation::VisualInertialOptions{}.gate_sigma;
  bool is_verbose = false;
};

// Figures of a study, one vector entry per dive.
struct Figures {
  std::vector<double> drift_percent;  // at the end, of the distance swum
  std::vector<double> most_percent;   // largest error during the dive, of the whole distance
  std::vector<double> depth_rms;
  std::vector<double> nees_position, nees_attitude;          // mean over the dive
  std::vector<double> end_nees_position, end_nees_attitude;  // at the end
  std::vector<double> ratio;
  std::vector<double> frame_ms;
  std::vector<double> dark_cost;                               // m, change of the error in the dark
  std::vector<double> dark_nees_position, dark_nees_attitude;  // as it ends
  std::vector<double> index_error, index_sigmas;               // of the refractive index at the end
  std::int64_t used = 0, used_particles = 0, snow = 0, accepted_particles = 0;
  int diverged = 0, flagged = 0;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

void add(Figures& all, const FilterDiveResult& result) {
  double depth = 0.0;
  double most = 0.0;
  std::vector<double> position, attitude;
  for (const ErrorSample& e : result.errors) {
    depth += e.position.z() * e.position.z() / static_cast<double>(result.errors.size());
    most = std::max(most, e.position.norm());
    position.push_back(e.nees_position);
    attitude.push_back(e.nees_attitude);
  }
  const ErrorSample& last = result.errors.back();
  all.drift_percent.push_back(100.0 * last.position.norm() / result.distance_m);
  all.most_percent.push_back(100.0 * most / result.distance_m);
  all.depth_rms.push_back(std::sqrt(depth));
  all.nees_position.push_back(mean(position));
  all.nees_attitude.push_back(mean(attitude));
  all.end_nees_position.push_back(last.nees_position);
  all.end_nees_attitude.push_back(last.nees_attitude);
  all.frame_ms.insert(all.frame_ms.end(), result.frame_ms.begin(), result.frame_ms.end());
  all.used += result.used;
  all.used_particles += result.used_particles;
  all.snow += static_cast<std::int64_t>(result.snow.size());
  all.accepted_particles += static_cast<std::int64_t>(result.accepted_particles.size());
}

ErrorSample error_at(const FilterDiveResult& result, double t) {
  ErrorSample latest{};
  for (const ErrorSample& e : result.errors) {
    if (e.t <= t) latest = e;
  }
  return latest;
}

void dive_once(const Study& study, std::uint64_t seed, Figures& all) {
  AnalyticDive dive(study.dive, seed);
  estimation::VisualInertialOptions options = filter_options(dive, study.dive);
  options.max_landmarks = study.landmarks;
  options.max_clones = study.clones;
  options.max_update_features = study.update_features;
  options.keyframe_distance_m = study.keyframe_m;
  options.gate_sigma = study.gate;
  Random random(seed, 5);
  const double begin = random.uniform(0.0, 100.0);
  VisualInertialFilter filter(options, known_start(dive, begin, random, study.start));
  const double dark = study.dark_at < 0.0 ? 1e9 : begin + study.dark_at;
  bool was_flagged = false;
  Hooks hooks;
  hooks.has_frame = [&](double t) { return t < dark || t > dark + study.dark_s; };
  hooks.each_tick = [&](double t, VisualInertialFilter& f) {
    if (t > dark && t < dark + study.dark_s) was_flagged = was_flagged || f.health().is_blind;
  };
  const FilterDiveResult result =
      run(dive, study.dive, filter, begin, begin + study.seconds, hooks);
  add(all, result);
  all.ratio.push_back(filter.health().visual_innovation_ratio);
  all.diverged += filter.health().diverged ? 1 : 0;
  all.flagged += was_flagged ? 1 : 0;
  if (study.dark_at >= 0.0) {
    const ErrorSample end = error_at(result, dark + study.dark_s);
    all.dark_cost.push_back((end.position - error_at(result, dark).position).norm());
    all.dark_nees_position.push_back(end.nees_position);
    all.dark_nees_attitude.push_back(end.nees_attitude);
  }
  if (const auto columns = filter.state().refractive_index_columns()) {
    const double error = std::abs(dive.true_cameras().front().refractive_index -
                                  filter.state().models.front().refractive_index);
    all.index_error.push_back(error);
    all.index_sigmas.push_back(
        error / std::sqrt(filter.state().covariance()(columns->start, columns->start)));
  }
  if (!study.is_verbose) return;
  fmt::print("seed {}: drift {:.3f} %, nees {:.2f} {:.2f}, at the end {:.2f} {:.2f} {}\n", seed,
             all.drift_percent.back(), all.nees_position.back(), all.nees_attitude.back(),
             all.end_nees_position.back(), all.end_nees_attitude.back(), filter.health().reason);
  std::fflush(stdout);
}

void report(const Study& study, const Figures& all) {
  // Bounds of the mean of that many variables of three degrees of freedom (normal approximation).
  const double band = 1.96 * std::sqrt(6.0 / study.runs);
  fmt::print(
      "drift, % of the distance: mean {:.3f}, median {:.3f}, worst {:.3f}; largest on the way "
      "{:.3f}, {:.3f}\n",
      mean(all.drift_percent), quantile(all.drift_percent, 0.5), quantile(all.drift_percent, 1.0),
      mean(all.most_percent), quantile(all.most_percent, 1.0));
  fmt::print(
      "NEES of 3, {:.2f} to {:.2f} expected: position {:.2f}, attitude {:.2f} at the end; "
      "{:.2f}, {:.2f} on the way\n",
      3.0 - band, 3.0 + band, mean(all.end_nees_position), mean(all.end_nees_attitude),
      mean(all.nees_position), mean(all.nees_attitude));
  fmt::print("depth RMS {:.4f} m; innovation ratio {:.2f}; diverged {}\n", mean(all.depth_rms),
             mean(all.ratio), all.diverged);
  const double p99 = quantile(all.frame_ms, 0.99);
  fmt::print("ms of processor a frame: mean {:.2f}, median {:.2f}, p99 {:.2f} ({:.1f} means)\n",
             mean(all.frame_ms), quantile(all.frame_ms, 0.5), p99, p99 / mean(all.frame_ms));
  if (all.snow > 0) {
    fmt::print("snow: {} of {} flakes ever believed ({:.2f} %), {:.2f} % of all uses\n",
               all.accepted_particles, all.snow,
               100.0 * static_cast<double>(all.accepted_particles) / static_cast<double>(all.snow),
               100.0 * static_cast<double>(all.used_particles) / static_cast<double>(all.used));
  }
  if (!all.index_error.empty()) {
    fmt::print("refractive index: off by {:.4f} in the median, at most {:.4f}, {:.1f} sigma\n",
               quantile(all.index_error, 0.5), quantile(all.index_error, 1.0),
               quantile(all.index_sigmas, 1.0));
  }
  if (!all.dark_cost.empty()) {
    fmt::print(
        "{:.0f} s in the dark: {:.3f} m on average, worst {:.3f} m; reported in {} of {}; "
        "NEES of 3 as it ends: position {:.2f}, attitude {:.2f}\n",
        study.dark_s, mean(all.dark_cost), quantile(all.dark_cost, 1.0), all.flagged, study.runs,
        mean(all.dark_nees_position), mean(all.dark_nees_attitude));
  }
}

// Every fault on that many dives: an error of five sigma must have been reported.
int report_faults(const Study& study, int dives) {
  int all_unreported = 0;
  std::vector<std::string> faults = sensor_faults();
  faults.insert(faults.begin(), "none");
  for (const std::string& fault : faults) {
    int far = 0, unreported = 0, flagged = 0;
    std::string reason;
    for (int i = 0; i < dives; ++i) {
      const FaultDive dive = dive_with(fault, study.first + static_cast<std::uint64_t>(i));
      far += dive.far > 0 ? 1 : 0;
      unreported += dive.unreported > 0 ? 1 : 0;
      flagged += dive.flagged > 0 ? 1 : 0;
      if (!dive.reason.empty()) reason = dive.reason;
      if (study.is_verbose && dive.unreported > 0) {
        fmt::print("  {} with seed {}: {} s unreported\n", fault,
                   study.first + static_cast<std::uint64_t>(i), dive.unreported);
      }
    }
    all_unreported += unreported;
    fmt::print("{}: of {} dives {} beyond 5 sigma, {} of them unreported; {} flagged{}{}\n", fault,
               dives, far, unreported, flagged, reason.empty() ? "" : ": ", reason);
    std::fflush(stdout);
  }
  return all_unreported == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Drift and consistency of the visual-inertial filter.");
  Study study;
  bool is_mono = false;
  bool is_equidistant = false;
  std::int64_t updates = 0;
  int faults = 0;
  app.add_option("--runs", study.runs, "Dives");
  app.add_option("--first", study.first, "Seed of the first dive");
  app.add_option("--seconds", study.seconds, "Of each dive");
  app.add_option("--speed", study.dive.speed, "m/s");
  app.add_option("--imu-hz", study.dive.imu_hz, "Of the IMU");
  app.add_option("--snow", study.dive.snow_share, "Share of the features that move");
  app.add_option("--dark", study.dark_at, "Darkness, from so many seconds after the start");
  app.add_option("--dark-seconds", study.dark_s, "Length of the darkness");
  app.add_option("--landmarks", study.landmarks, "Most in the state");
  app.add_option("--clones", study.clones, "In the window");
  app.add_option("--update-features", study.update_features, "Most in one update");
  app.add_option("--keyframe", study.keyframe_m, "m between clones that are kept");
  app.add_option("--gate", study.gate, "sigma");
  app.add_option("--covariance", updates, "Nothing but so many random updates of a covariance");
  app.add_option("--faults", faults, "Nothing but so many dives with each fault of a sensor");
  app.add_option("--imu-scale", study.dive.imu_scale_sigma, "Scale and misalignment of the IMU");
  app.add_option("--g-sensitivity", study.dive.gyro_by_accel_sigma, "Of the gyro, rad/s per m/s^2");
  app.add_option("--focal-sigma", study.dive.focal_sigma, "Of the focal lengths, as a share");
  app.add_option("--centre-sigma", study.dive.centre_sigma_px, "Of the principal points, pixels");
  app.add_option("--refractive-index", study.dive.refractive_index, "Before a flat port");
  app.add_option("--index-sigma", study.dive.refractive_index_sigma, "Its error");
  app.add_option("--line-time", study.dive.line_time_s, "Of a rolling shutter, s");
  app.add_option("--heading-sigma", study.start.yaw_sigma_deg, "At the start, deg");
  app.add_option("--speed-sigma", study.start.speed_sigma, "At the start, m/s");
  app.add_flag("--mono", is_mono, "One camera");
  app.add_flag("--equidistant", is_equidistant, "Equidistant lenses with the pinholes' view");
  app.add_flag("-v,--verbose", study.is_verbose, "A line per dive");
  CLI11_PARSE(app, argc, argv);
  if (updates > 0) {
    const std::string problem = break_covariance(1, updates);
    fmt::print("{} updates: {}\n", updates, problem.empty() ? "held" : problem);
    return problem.empty() ? 0 : 1;
  }
  if (faults > 0) return report_faults(study, faults);
  study.dive.is_stereo = !is_mono;
  if (is_equidistant) study.dive.lens = LensModel::kEquidistant;
  Figures all;
  for (int i = 0; i < study.runs; ++i) {
    dive_once(study, study.first + static_cast<std::uint64_t>(i), all);
  }
  report(study, all);
  return 0;
}
