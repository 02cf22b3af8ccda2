// The visual front end on 752 x 480 images with 200 features, one core: the whole step with one
// camera and with two, then its parts. Images are rendered before the clock starts.

#include <ctime>
#include <numeric>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/quantile.h"
#include "estimation/visual_inertial/front_end/anchor_patch.h"
#include "estimation/visual_inertial/front_end/corners.h"
#include "estimation/visual_inertial/front_end/equalised_image.h"
#include "estimation/visual_inertial/front_end/klt.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"
#include "estimation/visual_inertial/front_end/stereo.h"
#include "estimation/visual_inertial/front_end/tracker.h"
#include "estimation/visual_inertial/tags/tag_detector.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using testing::PaintedRoom;

constexpr Utime kPeriod = 50'000;
constexpr int kImages = 24;

// 0.5 m/s past walls two to four metres away, turning at 12 degrees per second.
Pose X_WB(int k) {
  const double t = to_seconds(k * kPeriod);
  return {{0.4 * t, 0.3 * t, 0.1 * std::sin(t)}, from_rpy(0.1 * t, 0.1 * std::sin(t), 0.2 * t)};
}

struct Recording {
  CameraModel left = testing::test_camera(0.06);
  CameraModel right = testing::test_camera(-0.06);
  std::vector<ImageFrame> lefts;
  std::vector<ImageFrame> rights;

  Recording() {
    PaintedRoom room({4, 3, 2});
    for (int k = 0; k < kImages; ++k) {
      lefts.push_back(room.image(left, X_WB(k) * left.X_BC, k * kPeriod));
      rights.push_back(room.image(right, X_WB(k) * right.X_BC, k * kPeriod));
    }
  }

  [[nodiscard]] Eigen::Quaterniond turn(int from, int to) const {
    return (X_WB(to) * left.X_BC).q.conjugate() * (X_WB(from) * left.X_BC).q;
  }
};

const Recording& recording() {
  static const Recording recorded;
  return recorded;
}

// Plays the recording forwards and backwards.
void step(benchmark::State& state, bool stereo) {
  const Recording& recorded = recording();
  Tracker tracker({}, recorded.left, stereo ? std::optional(recorded.right) : std::nullopt, 1);
  double features = 0.0;
  double matched = 0.0;
  std::vector<double> times;  // processor time
  int last = 0;
  std::int64_t n = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const auto turn = static_cast<int>(n % (2 * kImages - 2));
    const int k = turn < kImages ? turn : 2 * kImages - 2 - turn;
    ImageFrame left = recorded.lefts[static_cast<std::size_t>(k)];
    ImageFrame right = recorded.rights[static_cast<std::size_t>(k)];
    left.utime = right.utime = n * kPeriod;
    state.ResumeTiming();
    const std::clock_t begin = std::clock();
    const TrackedImage tracked = tracker.step(left, stereo ? &right : nullptr,
                                              estimation::CameraTurn{recorded.turn(last, k)});
    times.push_back(static_cast<double>(std::clock() - begin));
    features += static_cast<double>(tracked.frame.features.size());
    matched += tracked.quality.stereo;
    last = k;
    ++n;
  }
  state.counters["features"] = features / static_cast<double>(n);
  state.counters["stereo"] = matched / static_cast<double>(n);
  const double sum = std::accumulate(times.begin(), times.end(), 0.0);
  state.counters["p99_of_mean"] = bench::quantile(times, 0.99) * static_cast<double>(n) / sum;
}
BENCHMARK_CAPTURE(step, mono, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(step, stereo, true)->Unit(benchmark::kMillisecond);

EqualisedImage prepared(const ImageFrame& image) {
  EqualisedImage result(16, 2);
  (void)result.set(image);
  (void)result.prepare();
  return result;
}

std::vector<Eigen::Vector2f> corners_of(const EqualisedImage& image) {
  CornerGrid grid({}, 752, 480, 200, 8);
  return *grid.find(image.half(), {}, 200, grid.cells());
}

void contrast(benchmark::State& state) {
  const ImageFrame& image = recording().lefts[0];
  std::vector<std::uint8_t> full;
  for (auto _ : state) {
    benchmark::DoNotOptimize(even_contrast({image.pixels.data(), image.width, image.height}, full));
  }
}
BENCHMARK(contrast)->Unit(benchmark::kMillisecond);

void track(benchmark::State& state) {
  const EqualisedImage before = prepared(recording().lefts[0]);
  const EqualisedImage after = prepared(recording().lefts[1]);
  const std::vector<Eigen::Vector2f> points = corners_of(before);
  Klt klt(16);
  for (auto _ : state) {
    benchmark::DoNotOptimize(klt.follow(before.for_klt(), after.for_klt(), points, points, 2));
  }
  state.counters["points"] = static_cast<double>(points.size());
}
BENCHMARK(track)->Unit(benchmark::kMillisecond);

void check_anchors(benchmark::State& state) {
  const EqualisedImage before = prepared(recording().lefts[0]);
  const EqualisedImage after = prepared(recording().lefts[1]);
  std::vector<std::pair<AnchorPatch, Eigen::Vector2f>> anchors;
  const std::vector<Eigen::Vector2f> points = corners_of(before);
  const auto followed = *Klt(16).follow(before.for_klt(), after.for_klt(), points, points, 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto anchor = AnchorPatch::cut(before.full(), points[i]);
    if (anchor && followed[i]) anchors.emplace_back(*anchor, *followed[i]);
  }
  for (auto _ : state) {
    for (const auto& [anchor, pixel] : anchors) {
      benchmark::DoNotOptimize(anchor.find(after.full(), {pixel}));
    }
  }
  state.counters["points"] = static_cast<double>(anchors.size());
}
BENCHMARK(check_anchors)->Unit(benchmark::kMillisecond);

void replenish(benchmark::State& state) {
  const EqualisedImage image = prepared(recording().lefts[0]);
  CornerGrid grid({}, 752, 480, 200, 8);
  const auto cells = static_cast<int>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(grid.find(image.half(), {}, 200, cells));
  }
}
BENCHMARK(replenish)->Arg(8)->Arg(1000)->Unit(benchmark::kMillisecond);

// Matching with all depths known, or none.
void match(benchmark::State& state, bool known) {
  const Recording& recorded = recording();
  const EqualisedImage left = prepared(recorded.lefts[0]);
  const EqualisedImage right = prepared(recorded.rights[0]);
  StereoMatcher matcher({}, recorded.left, recorded.right, 16);
  std::vector<StereoQuery> queries;
  for (const Eigen::Vector2f& pixel : corners_of(left)) {
    queries.push_back({pixel, *recorded.left.undistort(pixel.cast<double>())});
  }
  if (known) {
    const auto matches = *matcher.match(left.both(), right.both(), queries);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      queries[i].inverse_depth = matches[i] ? matches[i]->inverse_depth : 0.3;
    }
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(matcher.match(left.both(), right.both(), queries));
  }
}
BENCHMARK_CAPTURE(match, known_depth, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, unknown_depth, false)->Unit(benchmark::kMillisecond);

// No tag in the image: every candidate square is still tested.
void detect_tags(benchmark::State& state) {
  const Recording& recorded = recording();
  TagDetector detector(recorded.left, {});
  std::size_t k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(detector.find(recorded.lefts[k++ % kImages]));
}
BENCHMARK(detect_tags)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::estimation
