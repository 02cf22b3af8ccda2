// Initialisations of the visual-inertial filter, and what follows them: analytic dives at several
// speeds, at rest, and stretches of recorded flights with a real IMU (folder of RecordedFlight),
// with one camera and two, with and without depth, a known speed, and darkness. Counts the wrong
// ones, and reports when they began and how consistent the estimate is.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"
#include "test/estimation/visual_inertial/filter/recorded_flight.h"

namespace {

using namespace dive;
using namespace dive::testing;
using bench::quantile;
using Eigen::Vector3d;
using estimation::ImageStart;
using estimation::VisualInertialFilter;
using estimation::VisualInertialOptions;

constexpr double kSpeedSigma = 0.1;   // m/s, of a speed that is known
constexpr double kWrongSpeed = 0.25;  // m/s, beyond it an initialisation is wrong
constexpr double kWrongTilt = 5.0;    // deg

struct Settings {
  int runs = 20;
  std::uint64_t first = 1;
  double seconds = 10.0;  // of each
  bool is_mono = false;
  bool has_speed = false;
  bool has_depth = true;  // analytic dives only
  double dark_s = 0.0;    // so long without images, from a third of the stretch on
  double pixel_sigma = 0.7;
  double imu_scale = 0.005;     // of the analytic dives: scale and misalignment of the IMU
  double gyro_by_accel = 3e-5;  // rad/s per m/s^2, g-sensitivity of its gyro
  bool is_verbose = false;
};

struct Figures {
  std::vector<double> began_s;
  std::vector<double> speed_error, tilt_error;  // m/s, deg, where it began
  std::vector<double> nees_speed;
  std::vector<double> nees_position, nees_attitude;  // mean over the rest
  std::vector<double> end_m, drift_percent, frame_ms;
  int runs = 0, never = 0, wrong = 0, diverged = 0;
  std::string waits_for;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

// What is compared, at one time.
struct Truth {
  Pose X_WB;
  Vector3d v_W;
};

// One initialisation and what follows; fed by its owner.
class Run {
 public:
  Run(const Settings& settings, double begin, Figures& all)
      : settings_(settings), begin_(begin), all_(all) {
    ++all_.runs;
  }

  [[nodiscard]] bool has_image(double t) const {
    const double dark = begin_ + settings_.seconds / 3.0;
    return t < dark || t >= dark + settings_.dark_s;
  }

  void compare_at(double t, const VisualInertialFilter& filter,
                  const estimation::StateEstimate& estimate, const Truth& truth) {
    if (last_) length_ += (truth.X_WB.p - *last_).norm();
    last_ = truth.X_WB.p;
    if (!estimate.valid) return;
    const Vector3d v_W = estimate.X_WB.q * estimate.v_WB_B;
    if (!began_) {
      began_ = true;
      all_.began_s.push_back(t - begin_);
      speed_error_ = (v_W - truth.v_W).norm();
      const Vector3d up = estimate.X_WB.q.conjugate() * Vector3d::UnitZ();
      const Vector3d true_up = truth.X_WB.q.conjugate() * Vector3d::UnitZ();
      tilt_error_ = rad_to_deg(std::acos(std::clamp(up.dot(true_up), -1.0, 1.0)));
      all_.speed_error.push_back(speed_error_);
      all_.tilt_error.push_back(tilt_error_);
      const Eigen::Matrix3d P = filter.state().covariance().block<3, 3>(
          estimation::imu_error::kVelocity, estimation::imu_error::kVelocity);
      const Vector3d e = v_W - truth.v_W;
      all_.nees_speed.push_back(e.dot(P.llt().solve(e)));
      all_.wrong += speed_error_ > kWrongSpeed || tilt_error_ > kWrongTilt ? 1 : 0;
    }
    const ErrorSample error = compare(estimate, {truth.X_WB, {}, {}, {}});
    end_m_ = error.position.norm();
    position_.push_back(error.nees_position);
    attitude_.push_back(error.nees_attitude);
  }

  void end(std::uint64_t seed, const std::string& name, const VisualInertialFilter& filter) {
    all_.never += began_ ? 0 : 1;
    if (!began_) all_.waits_for = filter.health().waits_for;
    all_.diverged += filter.health().diverged ? 1 : 0;
    if (began_) {
      all_.nees_position.push_back(mean(position_));
      all_.nees_attitude.push_back(mean(attitude_));
      all_.end_m.push_back(end_m_);
      if (length_ > 1.0) all_.drift_percent.push_back(100.0 * end_m_ / length_);
    }
    if (!settings_.is_verbose) return;
    fmt::print(
        "{} seed {}: began {:.2f} s, speed {:.3f} m/s and tilt {:.2f} deg off, end {:.3f} m "
        "of {:.1f}, NEES {:.1f} {:.1f}{}{}\n",
        name, seed, began_ ? all_.began_s.back() : -1.0, speed_error_, tilt_error_, end_m_, length_,
        mean(position_), mean(attitude_), began_ ? "" : "; waits for " + filter.health().waits_for,
        filter.health().diverged ? "; " + filter.health().reason : "");
  }

 private:
  Settings settings_;
  double begin_;
  Figures& all_;
  bool began_ = false;
  double speed_error_ = 0.0, tilt_error_ = 0.0, end_m_ = 0.0, length_ = 0.0;
  std::optional<Vector3d> last_;
  std::vector<double> position_, attitude_;
};

ImageStart start_at(const Settings& settings, double t, const Truth& truth, Random& random) {
  ImageStart start;
  start.utime = from_seconds(t);
  const double x = random.normal();
  const double y = random.normal();
  start.position_W = truth.X_WB.p + start.position_sigma_m * Vector3d(x, y, random.normal());
  start.heading =
      so3_exp(deg_to_rad(start.heading_sigma_deg) * random.normal() * Vector3d::UnitZ()) *
      truth.X_WB.q;
  if (settings.has_speed) {
    const Vector3d v_B = truth.X_WB.q.conjugate() * truth.v_W;
    const double a = random.normal();
    const double b = random.normal();
    start.speed = ImageStart::Speed{v_B + kSpeedSigma * Vector3d(a, b, random.normal()),
                                    kSpeedSigma, start.utime};
  }
  return start;
}

void dive_once(const Settings& settings, double speed, std::uint64_t seed, Figures& all) {
  AnalyticDiveOptions options;
  options.speed = speed;
  options.is_stereo = !settings.is_mono;
  options.pixel_sigma = settings.pixel_sigma;
  options.imu_scale_sigma = settings.imu_scale;
  options.gyro_by_accel_sigma = settings.gyro_by_accel;
  AnalyticDive dive(options, seed);
  Random random(seed, 6);
  const double begin = random.uniform(0.0, 100.0);
  const auto truth_at = [&](double t) {
    const DiveTruth truth = dive.truth(t);
    return Truth{truth.X_WB, truth.X_WB.q * truth.v_WB_B};
  };
  const VisualInertialOptions of_filter = filter_options(dive, options);
  VisualInertialFilter filter(of_filter, start_at(settings, begin, truth_at(begin), random));
  Run run(settings, begin, all);
  double next = begin;
  for (Utime utime = from_seconds(begin); to_seconds(utime) <= begin + settings.seconds;
       utime += 5000) {
    const double t = to_seconds(utime);
    const bool is_image = t >= next;
    if (is_image) next += 0.05;
    filter.add(dive.imu(utime));
    if (settings.has_depth && is_image) filter.add(dive.depth(utime));
    if (is_image && run.has_image(t)) filter.add(dive.frame(utime));
    const auto& estimate = filter.update(utime);
    if (is_image) run.compare_at(t, filter, estimate, truth_at(t));
  }
  run.end(seed, fmt::format("{} m/s", speed), filter);
}

void fly_once(const Settings& settings, const RecordedFlight& flight, const std::string& name,
              std::uint64_t seed, Figures& all) {
  Random random(seed, 7);
  std::vector<CameraModel> cameras = RecordedFlight::rig();
  if (settings.is_mono) cameras.resize(1);
  MadeFeatureOptions of_features;
  of_features.pixel_sigma = settings.pixel_sigma;
  of_features.near_m = 1.5;
  of_features.far_m = 8.0;
  MadeFeatures features(of_features, cameras, cameras, random);
  const auto images = static_cast<std::size_t>(settings.seconds * 20.0);
  const auto& truth = flight.truth();
  std::size_t first = random.bits() % (truth.size() - images - 1);
  while (!flight.is_smooth(first, images)) first = random.bits() % (truth.size() - images - 1);
  for (std::size_t i = first; i < first + images; ++i) {
    for (int k = 0; k < 12; ++k) features.add_point_before(truth[i].X_WB);
  }
  VisualInertialOptions of_filter;
  of_filter.cameras = cameras;
  of_filter.pixel_sigma = settings.pixel_sigma;
  const auto truth_at = [&](std::size_t i) { return Truth{truth[i].X_WB, flight.velocity_W(i)}; };
  const double begin = to_seconds(truth[first].utime);
  VisualInertialFilter filter(of_filter, start_at(settings, begin, truth_at(first), random));
  Run run(settings, begin, all);
  auto sample = std::lower_bound(flight.imu().begin(), flight.imu().end(), truth[first].utime,
                                 [](const ImuSample& s, Utime t) { return s.utime < t; });
  for (std::size_t i = first; i < first + images; ++i) {
    const Utime utime = truth[i].utime;
    for (; sample != flight.imu().end() && sample->utime <= utime; ++sample) filter.add(*sample);
    if (sample != flight.imu().end()) filter.add(*sample++);
    if (run.has_image(to_seconds(utime))) {
      const auto motion = [&](double /*seconds*/) { return truth[i].X_WB; };
      filter.add(estimation::FeatureFrame{utime, features.observe(motion, utime)});
    }
    run.compare_at(to_seconds(utime), filter, filter.update(utime), truth_at(i));
  }
  run.end(seed, name, filter);
}

void report(const std::string& name, const Figures& all) {
  fmt::print(
      "{:<10} {:3d} runs: {} wrong, {} never, {} diverged; began {:.2f} s (median), {:.2f} (last); "
      "speed {:.3f} / {:.3f} m/s off (median, most), NEES {:.2f}; tilt {:.2f} / {:.2f} deg; "
      "NEES {:.2f} {:.2f}; end {:.3f} / {:.3f} m, drift {:.2f} %{}\n",
      name, all.runs, all.wrong, all.never, all.diverged, quantile(all.began_s, 0.5),
      quantile(all.began_s, 1.0), quantile(all.speed_error, 0.5), quantile(all.speed_error, 1.0),
      mean(all.nees_speed), quantile(all.tilt_error, 0.5), quantile(all.tilt_error, 1.0),
      mean(all.nees_position), mean(all.nees_attitude), quantile(all.end_m, 0.5),
      quantile(all.end_m, 1.0), mean(all.drift_percent),
      all.waits_for.empty() ? "" : "; waited for " + all.waits_for);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Initialisations of the visual-inertial filter.");
  Settings settings;
  std::string folder;
  std::vector<std::string> flights;
  std::vector<double> speeds{0.0, 0.1, 0.2, 0.4};
  bool has_no_depth = false;
  app.add_option("--runs", settings.runs, "Of each kind");
  app.add_option("--first", settings.first, "Seed of the first");
  app.add_option("--seconds", settings.seconds, "Of each");
  app.add_option("--speeds", speeds, "Analytic dives at these, m/s")->expected(0, 10);
  app.add_option("--flights", folder, "Folder with recorded flights");
  app.add_option("--names", flights, "NAME of each: NAME_imu.txt and NAME_truth.txt");
  app.add_option("--dark", settings.dark_s, "s without images, after a third");
  app.add_option("--pixels", settings.pixel_sigma, "Noise of a feature");
  app.add_option("--imu-scale", settings.imu_scale, "Scale and misalignment of an analytic IMU");
  app.add_option("--g-sensitivity", settings.gyro_by_accel, "Of its gyro, rad/s per m/s^2");
  app.add_flag("--mono", settings.is_mono, "One camera");
  app.add_flag("--speed-known", settings.has_speed, "To 0.1 m/s");
  app.add_flag("--no-depth", has_no_depth, "No depth in the analytic dives");
  app.add_flag("-v,--verbose", settings.is_verbose, "A line per run");
  CLI11_PARSE(app, argc, argv);
  settings.has_depth = !has_no_depth;
  for (const double speed : speeds) {
    Figures all;
    for (int i = 0; i < settings.runs; ++i) {
      dive_once(settings, speed, settings.first + static_cast<std::uint64_t>(i), all);
    }
    report(fmt::format("{} m/s", speed), all);
  }
  for (const std::string& name : flights) {
    const auto flight = RecordedFlight::read(folder, name);
    if (!flight) {
      fmt::print("{}: no flight {} there\n", folder, name);
      return 2;
    }
    Figures all;
    for (int i = 0; i < settings.runs; ++i) {
      fly_once(settings, *flight, name, settings.first + static_cast<std::uint64_t>(i), all);
    }
    report(name, all);
  }
  return 0;
}
