// One scan of the stereo pair, 752 x 480 each, 100 x 75 rays: beside the wreck, and in water
// without anything to match. One core.

#include <vector>

#include <benchmark/benchmark.h>

#include "bench/shipped_map.h"
#include "estimation/visual_inertial/stereo_range/stereo_range.h"
#include "vehicle/simulator/cameras/stereo_camera.h"

namespace dive::estimation {
namespace {

void measure(benchmark::State& state, const Eigen::Vector3d& from) {
  vehicle::StereoCameraOptions options;
  options.water = vehicle::coastal_sea();
  vehicle::StereoCamera camera(bench::shipped_map("wreck"), options, 1);
  const vehicle::StereoFrames pair = camera.take(0, {from, heading_along({-12, -2, 0})});
  StereoRange ranges = *StereoRange::create({}, options.camera(0), options.camera(1));
  int measured = 0;
  for (auto _ : state) measured = ranges.measure(*pair[0], *pair[1])->measured;
  state.counters["measured"] = measured;
}
BENCHMARK_CAPTURE(measure, beside_wreck, {-6, 7, -12})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, open_water, {60, 60, -8})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::estimation
