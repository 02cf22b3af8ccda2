// The visual-inertial estimator on images: stretches of simulated dives of the shipped missions in
// several kinds of water, rendered on the fly. Drift, consistency, and the distance of the features
// from their true positions.

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/camera_dive.h"
#include "bench/quantile.h"
#include "bench/track_truth.h"
#include "common/random.h"
#include "estimation/dataset/trajectory_error.h"
#include "estimation/visual_inertial/filter/visual_inertial_filter.h"
#include "estimation/visual_inertial/front_end/gyro_turn.h"
#include "estimation/visual_inertial/front_end/tracker.h"
#include "mission/record/dataset_recorder.h"
#include "mission/simulation/simulated_cameras.h"
#include "vehicle/simulator/water/named_waters.h"

namespace {

using namespace dive;
using bench::DiveTick;
using bench::quantile;
using Eigen::Vector3d;
using estimation::VisualInertialFilter;

constexpr double kCameraSigma_deg = 0.05;  // calibration error of the rig
constexpr double kCameraSigma_m = 0.001;

struct Where {
  std::string mission;
  std::string water;
};

struct Study {
  int runs = 5;
  std::uint64_t first = 1;
  double seconds = 20.0;
  bool is_mono = false;
  bool is_wide = false;
  bool with_tracks = false;
  bool is_verbose = false;
  double white_px = 0.0;
  std::string folder;
  double pixel_sigma = estimation::VisualInertialOptions{}.pixel_sigma;
};

// One entry per dive.
struct Figures {
  std::vector<double> drift, ate;
  std::vector<double> nees_position, nees_attitude;
  std::vector<double> end_position, end_attitude;
  std::vector<double> ratio, features;
  int diverged = 0;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

Vector3d normal3(double sigma, Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  return sigma * Vector3d(x, y, random.normal());
}

// The cameras of the water; wide: equidistant lenses of 120 x 90 degrees.
vehicle::StereoCameraOptions camera_in(const std::string& water, const Study& study) {
  vehicle::StereoCameraOptions camera = *vehicle::stereo_camera_in(water);
  if (!study.is_wide) return camera;
  camera.lens = LensModel::kEquidistant;
  camera.height = camera.width * 3 / 4;
  camera.fx = camera.fy = 0.5 * camera.width / deg_to_rad(60.0);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

// Options of the estimator: every parameter with a sigma differs from the truth by a random error
// of that sigma.
estimation::VisualInertialOptions filter_options(const Study& study,
                                                 const vehicle::StereoCameraOptions& camera,
                                                 Random& random) {
  estimation::VisualInertialOptions options = mission::vision_options(camera, {}).filter;
  options.cameras.clear();
  options.extrinsic_sigma_deg = kCameraSigma_deg;
  options.extrinsic_sigma_m = kCameraSigma_m;
  for (int k = 0; k < (study.is_mono ? 1 : 2); ++k) {
    CameraModel model = camera.camera(k);
    model.X_BC.p += normal3(options.extrinsic_sigma_m, random);
    model.X_BC.q = model.X_BC.q * so3_exp(normal3(deg_to_rad(options.extrinsic_sigma_deg), random));
    options.cameras.push_back(model);
  }
  options.depth_sigma_m = vehicle::Conditions{}.depth_noise_m;
  options.depth_bias_sigma_m = vehicle::Conditions{}.depth_bias_sigma_m;
  options.pixel_sigma = study.pixel_sigma;
  return options;
}

estimation::KnownStart start_at(const vehicle::GroundTruth& truth, Random& random) {
  estimation::KnownStart start;
  start.utime = truth.utime;
  start.X_WB.p = truth.X_WB.p + normal3(start.position_sigma_m, random);
  start.X_WB.q = so3_exp(normal3(deg_to_rad(start.tilt_sigma_deg), random)) * truth.X_WB.q;
  start.v_WB_B = truth.v_WB_B + normal3(start.speed_sigma, random);
  return start;
}

// Tracker and filter as on the vehicle.
class VisionRun {
 public:
  VisionRun(const Study& study, const estimation::VisualInertialOptions& options,
            const estimation::KnownStart& start, std::uint64_t seed, bench::TrackTruth& truth)
      : study_(study),
        offset_(from_seconds(options.time_offset_sigma_s * Random(seed, 6).normal())),
        filter(options, start),
        tracker_({}, options.cameras[0],
                 study.is_mono ? std::nullopt : std::optional(options.cameras[1]), seed),
        q_BC_(options.cameras[0].X_BC.q),
        random_(seed, 9),
        truth_(truth) {}

  void see(const DiveTick& tick, const bench::Images* images) {
    if (tick.samples.depth) filter.add(*tick.samples.depth);
    for (const ImuSample& sample : tick.samples.inertial.list()) {
      filter.add(sample);
      imu_.push_back(sample);
    }
    // An image is tracked when the gyro samples up to its time have arrived.
    if (waiting_) track();
    if (images == nullptr) return;
    waiting_ = *images;
    for (ImageFrame& image : *waiting_) image.utime -= offset_;
    waiting_X_WB_ = tick.truth.X_WB;
  }

 private:
  void track() {
    const bench::Images images = *std::exchange(waiting_, std::nullopt);
    std::optional<estimation::CameraTurn> turn;
    if (const auto last = tracker_.utime()) {
      turn = estimation::turn_by_gyro(imu_, *last, images[0].utime, filter.gyro_bias(), q_BC_);
    }
    std::erase_if(imu_, [&](const ImuSample& s) { return s.utime < images[0].utime - 100'000; });
    auto tracked = tracker_.step(images[0], study_.is_mono ? nullptr : &images[1], turn);
    if (tracked.frame.features.empty()) return;
    features.push_back(static_cast<double>(tracked.frame.features.size()));
    if (study_.with_tracks || study_.white_px > 0.0) truth_.add(tracked.frame, waiting_X_WB_);
    if (study_.white_px > 0.0) {
      tracked.frame = truth_.moved_to_truth(tracked.frame, waiting_X_WB_, study_.white_px, random_);
    }
    filter.add(std::move(tracked.frame));
  }

  const Study& study_;
  Utime offset_;  // IMU's clock minus the cameras'

 public:
  VisualInertialFilter filter;
  std::vector<double> features;

 private:
  estimation::Tracker tracker_;
  Eigen::Quaterniond q_BC_;
  Random random_;
  bench::TrackTruth& truth_;
  std::vector<ImuSample> imu_;
  std::optional<bench::Images> waiting_;
  Pose waiting_X_WB_;
};

void dive_once(const Study& study, const bench::StudySetup& setup, const std::string& water,
               std::uint64_t seed, bench::TrackTruth& truth, Figures& all) {
  const vehicle::StereoCameraOptions camera = camera_in(water, study);
  const std::vector<DiveTick> stretch =
      bench::stretch_of(bench::swim(setup, seed), study.seconds, seed);
  Random random(seed, 5);
  truth.begin_dive();
  VisionRun run(study, filter_options(study, camera, random),
                start_at(stretch.front().truth, random), seed, truth);
  std::vector<estimation::StateEstimate> estimates;
  estimation::Trajectory estimated, true_path;
  bench::render(setup, stretch, camera, water, seed, study.folder,
                [&](const DiveTick& tick, const bench::Images* images) {
                  true_path.push_back({tick.truth.utime, tick.truth.X_WB});
                  run.see(tick, images);
                  const auto& estimate = run.filter.update(tick.truth.utime);
                  if (!estimate.valid) return;
                  estimates.push_back(estimate);
                  estimated.push_back({estimate.utime, estimate.X_WB});
                });
  const auto pairs = estimation::pair_up(estimated, true_path);
  const auto X = estimation::align(pairs, estimation::Alignment::kYawAndTranslation);
  const estimation::Nees nees = estimation::nees(estimates, true_path);
  const estimation::Nees end = estimation::nees({estimates.back()}, true_path);
  all.drift.push_back(estimation::drift_percent(pairs));
  all.ate.push_back(X ? estimation::absolute_error(pairs, *X).rmse_m : 0.0);
  all.nees_position.push_back(nees.position);
  all.nees_attitude.push_back(nees.orientation);
  all.end_position.push_back(end.position);
  all.end_attitude.push_back(end.orientation);
  all.ratio.push_back(run.filter.health().visual_innovation_ratio);
  all.features.push_back(mean(run.features));
  all.diverged += run.filter.health().diverged ? 1 : 0;
  if (!study.is_verbose) return;
  fmt::print(
      "  seed {}: {:.1f} m, drift {:.2f} %, ATE {:.3f} m, NEES {:.2f} {:.2f}, at the end {:.2f} "
      "{:.2f}, ratio {:.2f}, features {:.0f} {}\n",
      seed, estimation::length_of(true_path), all.drift.back(), all.ate.back(),
      all.nees_position.back(), all.nees_attitude.back(), all.end_position.back(),
      all.end_attitude.back(), all.ratio.back(), all.features.back(), run.filter.health().reason);
  std::fflush(stdout);
}

void report(const Where& where, const Figures& all) {
  const double runs = static_cast<double>(all.drift.size());
  const double band = 1.96 * std::sqrt(6.0 / runs);
  fmt::print(
      "{} in {}: drift mean {:.2f}, worst {:.2f} %; ATE mean {:.3f}, worst {:.3f} m; diverged {}\n",
      where.mission, where.water, mean(all.drift), quantile(all.drift, 1.0), mean(all.ate),
      quantile(all.ate, 1.0), all.diverged);
  fmt::print(
      "  NEES of 3, {:.2f} to {:.2f} expected: position {:.2f}, attitude {:.2f} at the end; "
      "{:.2f}, "
      "{:.2f} on the way; innovation ratio {:.2f}; {:.0f} features\n",
      3.0 - band, 3.0 + band, mean(all.end_position), mean(all.end_attitude),
      mean(all.nees_position), mean(all.nees_attitude), mean(all.ratio), mean(all.features));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The visual-inertial estimator on pictures of simulated dives.");
  Study study;
  Where only;
  app.add_option("--runs", study.runs, "Dives in each water");
  app.add_option("--first", study.first, "Seed of the first");
  app.add_option("--seconds", study.seconds, "Of each dive");
  app.add_option("--mission", only.mission, "One of missions/, and no other");
  app.add_option("--water", only.water, "clear_pool, coastal_sea, green_lake or dark_wreck");
  app.add_option("--keep", study.folder, "Keep the pictures in this folder, and take them from it");
  app.add_option("--sigma", study.pixel_sigma,
                 "Standard deviation of a feature given to the filter, px");
  app.add_option("--white", study.white_px,
                 "The features tracked, where they truly are, with white noise of so many px");
  app.add_flag("--tracks", study.with_tracks, "Also how far the features are from the truth");
  app.add_flag("--mono", study.is_mono, "One camera");
  app.add_flag("--wide", study.is_wide, "Equidistant lenses of 120 x 90 degrees");
  app.add_flag("-v,--verbose", study.is_verbose, "A line per dive");
  CLI11_PARSE(app, argc, argv);
  std::vector<Where> all{
      {"pool3", "clear_pool"}, {"wreck", "coastal_sea"}, {"wreck", "dark_wreck"}};
  if (!only.mission.empty()) all = {only};
  for (const Where& where : all) {
    const bench::StudySetup setup = bench::load_shipped_setup(where.mission);
    const vehicle::StereoCameraOptions camera = camera_in(where.water, study);
    bench::TrackTruth truth(setup.world, camera.camera(0), camera.camera(1));
    Figures figures;
    for (int i = 0; i < study.runs; ++i) {
      dive_once(study, setup, where.water, study.first + static_cast<std::uint64_t>(i), truth,
                figures);
    }
    report(where, figures);
    if (study.with_tracks) truth.print();
  }
  return 0;
}
