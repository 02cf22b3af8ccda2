// Ranges of the stereo pair in the simulated water, against rays traced through the world: how many
// there are, their errors in units of their sigma, how many are too near, and how often occupied
// space is reported free.

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "bench/shipped_map.h"
#include "estimation/visual_inertial/stereo_range/stereo_range.h"
#include "vehicle/simulator/cameras/stereo_camera.h"
#include "vehicle/simulator/ray_tracing/traced_world.h"

namespace {

using namespace dive;
using Eigen::Vector3d;

struct Scene {
  std::string name;
  std::string map;
  vehicle::WaterOptics water;
  Vector3d from;
  Vector3d to;
};

std::vector<Scene> scenes() {
  return {
      {"beside the wreck, coastal sea",
       "wreck",
       vehicle::coastal_sea(),
       {0, 8, -12},
       {-12, 6, -12}},
      {"beside the wreck, green lake", "wreck", vehicle::green_lake(), {0, 8, -12}, {-12, 6, -12}},
      {"inside the wreck, lamps", "wreck", vehicle::dark_wreck(), {4, 0, -12}, {-4, 0, -12}},
      {"pool, clear", "pool1", vehicle::clear_pool(), {0.8, -0.5, -2}, {6, -0.5, -2}},
      {"open water, coastal sea", "wreck", vehicle::coastal_sea(), {60, 60, -8}, {80, 60, -8}}};
}

struct Tally {
  int rays = 0, measured = 0, beyond = 0, within = 0;
  int in_1 = 0, in_2 = 0, in_3 = 0;
  int near_4_sigma = 0, near_10_percent = 0, false_free = 0;
  double chi2 = 0.0;
  std::vector<double> error_near, error_far, sigma, ms;
};

double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void compare(const estimation::StereoScan& result, const vehicle::TracedWorld& world,
             const Pose& X_WB, Tally& tally) {
  const Vector3d sensor_origin_W = X_WB * result.scan.origin_B.cast<double>();
  for (std::size_t i = 0; i < result.scan.points_B.size(); ++i) {
    ++tally.rays;
    const Eigen::Vector3f& p_B = result.scan.points_B[i];
    if (!p_B.allFinite()) continue;
    const Vector3d ray = X_WB * p_B.cast<double>() - sensor_origin_W;
    const double measured = ray.norm();
    const double truth = world.range(sensor_origin_W, ray / measured, 0.0, 100.0);
    if (std::isinf(result.sigma_m[i])) {
      ++tally.beyond;
      if (truth < result.scan.reach) ++tally.false_free;
      continue;
    }
    ++tally.measured;
    const double error = measured - truth;
    const double sigmas = std::abs(error) / result.sigma_m[i];
    tally.in_1 += sigmas < 1.0 ? 1 : 0;
    tally.in_2 += sigmas < 2.0 ? 1 : 0;
    tally.in_3 += sigmas < 3.0 ? 1 : 0;
    tally.near_4_sigma += error < -4.0 * result.sigma_m[i] ? 1 : 0;
    tally.near_10_percent += error < -0.1 * truth ? 1 : 0;
    (truth < 3.0 ? tally.error_near : tally.error_far).push_back(std::abs(error));
    tally.sigma.push_back(result.sigma_m[i] / (measured * measured));
  }
}

void look_at(const Scene& scene, int pairs, bool has_snow,
             const estimation::StereoRangeOptions& options) {
  const planning::World map = bench::shipped_map(scene.map);
  vehicle::StereoCameraOptions camera_options;
  camera_options.water = scene.water;
  if (!has_snow) camera_options.water.snow_per_m3 = 0.0;
  if ((camera_options.water.daylight == 0.0).all()) camera_options.lamps = vehicle::bow_lamps();
  vehicle::StereoCamera camera(map, camera_options, 1);
  const vehicle::TracedWorld world(map);
  auto ranges =
      *estimation::StereoRange::create(options, camera_options.camera(0), camera_options.camera(1));
  Tally tally;
  for (int k = 0; k < pairs; ++k) {
    const double share = (k + 0.5) / pairs;
    const Vector3d along = scene.to - scene.from;
    const Eigen::Quaterniond sway = from_rpy(0.1 * std::sin(3.0 * k), 0.1 * std::sin(2.0 * k), 0);
    const Pose X_WB{scene.from + share * along, heading_along(along) * sway};
    const vehicle::StereoFrames frames = camera.take(from_seconds(0.5 * k), X_WB);
    const double before = cpu_ms();
    const auto result = ranges.measure(*frames[0], *frames[1]);
    tally.ms.push_back(cpu_ms() - before);
    compare(*result, world, X_WB, tally);
  }
  const auto percent = [&](int part, int of) { return 100.0 * part / std::max(1, of); };
  fmt::print("{} (reach {:.1f} m)\n", scene.name, ranges.reach());
  fmt::print(
      "  measured {:.1f} %, beyond {:.1f} % of {} rays; {:.2f} ms a pair (median, processor)\n",
      percent(tally.measured, tally.rays), percent(tally.beyond, tally.rays), tally.rays,
      bench::quantile(tally.ms, 0.5));
  fmt::print("  error, median / p95: {:.3f} / {:.3f} m within 3 m, {:.3f} / {:.3f} m farther\n",
             bench::quantile(tally.error_near, 0.5), bench::quantile(tally.error_near, 0.95),
             bench::quantile(tally.error_far, 0.5), bench::quantile(tally.error_far, 0.95));
  fmt::print(
      "  within 1, 2, 3 sigma: {:.1f}, {:.1f}, {:.1f} %; sigma over range squared, median "
      "{:.4f}\n",
      percent(tally.in_1, tally.measured), percent(tally.in_2, tally.measured),
      percent(tally.in_3, tally.measured), bench::quantile(tally.sigma, 0.5));
  fmt::print(
      "  nearer than the truth by 4 sigma {:.2f} %, by 10 % {:.2f} %; called free and not "
      "{:.3f} %\n",
      percent(tally.near_4_sigma, tally.measured), percent(tally.near_10_percent, tally.measured),
      percent(tally.false_free, tally.beyond));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Ranges of the stereo pair against the truth.");
  int pairs = 20;
  bool is_clean = false;
  estimation::StereoRangeOptions options;
  app.add_option("--pairs", pairs, "A scene");
  app.add_flag("--clean", is_clean, "No marine snow");
  app.add_option("--uniqueness", options.uniqueness_percent, "Per cent");
  app.add_option("--texture", options.texture, "Least sum of gradients");
  app.add_option("--speckle", options.speckle_px, "Pixels of the half picture");
  app.add_option("--optimism", options.optimism, "Errors over what noise says");
  app.add_option("--sigma", options.max_sigma_px, "Most, pixels");
  app.add_option("--calibration", options.calibration_px, "Pixels");
  CLI11_PARSE(app, argc, argv);
  for (const Scene& scene : scenes()) look_at(scene, pairs, !is_clean, options);
  return 0;
}
