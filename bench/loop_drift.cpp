// Loop closure on dives in closed form: two laps of the 115 m oval, the visual-inertial filter
// alone and with the loop closures of the second lap. Descriptors are random; the rest is the code
// that runs on the vehicle.

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "common/fnv.h"
#include "estimation/visual_inertial/loop_closure/loop_closer.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"

namespace {

using namespace dive;
using bench::quantile;
using dive::testing::AnalyticDive;
using dive::testing::AnalyticDiveOptions;
using dive::testing::ErrorSample;
using estimation::KeyframeView;
using estimation::LoopCloser;
using estimation::LoopCorrection;
using estimation::StateEstimate;

constexpr int kWrongBits = 12;  // bits of 256 that differ between two observations

struct Study {
  AnalyticDiveOptions dive;
  int runs = 20;
  double seconds = 572.0;  // two laps at 0.4 m/s
  estimation::LoopCloserOptions loops;
};

struct Figures {
  std::vector<double> drift, drift_second_lap, nees_position, nees_attitude, depth;
};

struct Total {
  Figures alone, with;
  std::vector<double> closures, wrong;
};

// Two observations of one point have nearly the same descriptor; those of two points are unrelated.
estimation::Descriptor descriptor_of(const Eigen::Vector3d& p_W, Random& random) {
  Fnv1a64 digest;
  digest.add(std::span(reinterpret_cast<const std::uint8_t*>(p_W.data()), sizeof(Eigen::Vector3d)));
  Random own(digest.value());
  estimation::Descriptor descriptor;
  for (std::uint64_t& word : descriptor) word = own.bits();
  for (int i = 0; i < kWrongBits; ++i) {
    const std::uint64_t bit = random.bits() % 256;
    descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

KeyframeView view_of(const AnalyticDive& dive, const estimation::FeatureFrame& frame,
                     Random& random) {
  KeyframeView view;
  view.utime = frame.utime;
  for (const estimation::FeatureObservation& feature : frame.features) {
    estimation::KeyframePoint point{feature.left, feature.right, {}};
    for (std::uint64_t& word : point.descriptor) word = random.bits();
    if (!AnalyticDive::is_snow(feature.id)) {
      point.descriptor = descriptor_of(dive.landmark(feature.id), random);
    }
    view.points.push_back(point);
  }
  return view;
}

void add(const AnalyticDive& dive, const std::vector<StateEstimate>& estimates, double half,
         Figures& figures) {
  double distance = 0.0;
  double depth = 0.0;
  double largest = 0.0;
  for (const StateEstimate& e : estimates) {
    const testing::DiveTruth truth = dive.truth(to_seconds(e.utime));
    distance += truth.v_WB_B.norm() * 0.05;
    const Eigen::Vector3d error = truth.X_WB.p - e.X_WB.p;
    depth += error.z() * error.z() / static_cast<double>(estimates.size());
    if (to_seconds(e.utime) > half) largest = std::max(largest, error.norm());
  }
  const StateEstimate& last = estimates.back();
  const ErrorSample end = testing::compare(last, dive.truth(to_seconds(last.utime)));
  figures.drift.push_back(100.0 * end.position.norm() / distance);
  figures.drift_second_lap.push_back(100.0 * largest / distance);
  figures.nees_position.push_back(end.nees_position);
  figures.nees_attitude.push_back(end.nees_attitude);
  figures.depth.push_back(std::sqrt(depth));
}

void dive_once(const Study& study, std::uint64_t seed, Total& total) {
  AnalyticDive dive(study.dive, seed);
  Random random(seed, 5);
  const double begin = random.uniform(0.0, 100.0);
  estimation::VisualInertialFilter filter(testing::filter_options(dive, study.dive),
                                          testing::known_start(dive, begin, random));
  LoopCloser loops(study.loops, dive.cameras()[0], dive.cameras()[1]);
  std::optional<LoopCorrection> correction;
  std::vector<StateEstimate> alone, with;
  int closures = 0, wrong = 0;
  const Utime tick = from_seconds(1.0 / study.dive.imu_hz);
  const auto ticks = static_cast<std::int64_t>(study.seconds * study.dive.imu_hz);
  for (std::int64_t i = 0; i < ticks; ++i) {
    const Utime now = from_seconds(begin) + i * tick;
    filter.add(dive.imu(now));
    if (i % 20 == 0) filter.add(dive.depth(now));
    if (i % 10 != 4) continue;
    estimation::FeatureFrame frame = dive.frame(now);
    const KeyframeView view = view_of(dive, frame, random);
    filter.add(std::move(frame));
    const StateEstimate estimate = filter.update(now);
    const auto& cameras_B = filter.state().cameras_B;
    loops.calibrate(cameras_B[0], cameras_B[1]);
    if (auto closed = loops.add(view, estimate)) {
      correction = std::move(*closed);
      const estimation::LoopClosure& c = correction->closure;
      const Pose truth = dive.truth(to_seconds(c.utime_old)).X_WB.inverse() *
                         dive.truth(to_seconds(c.utime_new)).X_WB;
      ++closures;
      wrong += (truth.p - c.X_B0B1.p).norm() > 0.2 ? 1 : 0;
    }
    alone.push_back(estimate);
    with.push_back(correction ? correction->apply(estimate) : estimate);
  }
  add(dive, alone, begin + 0.55 * study.seconds, total.alone);
  add(dive, with, begin + 0.55 * study.seconds, total.with);
  total.closures.push_back(closures);
  total.wrong.push_back(wrong);
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

void report(const char* name, const Figures& f) {
  fmt::print(
      "{}: drift at the end {:.3f} % (worst {:.3f}), largest on the second lap {:.3f} % (worst "
      "{:.3f}); NEES of 3 at the end {:.2f}, {:.2f}; depth RMS {:.4f} m\n",
      name, mean(f.drift), quantile(f.drift, 1.0), mean(f.drift_second_lap),
      quantile(f.drift_second_lap, 1.0), mean(f.nees_position), mean(f.nees_attitude),
      mean(f.depth));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What loop closure makes of the filter's drift.");
  Study study;
  app.add_option("--runs", study.runs, "Dives, seeds from 1000");
  app.add_option("--seconds", study.seconds, "Of each dive");
  app.add_option("--snow", study.dive.snow_share, "Share of the features that move");
  app.add_option("--pixels-now", study.loops.pixels_now, "One sigma");
  CLI11_PARSE(app, argc, argv);
  Total total;
  for (int i = 0; i < study.runs; ++i) {
    dive_once(study, static_cast<std::uint64_t>(1000 + i), total);
    fmt::print("seed {}: {:.3f} % alone, {:.3f} % with {} loops, {} wrong; NEES {:.2f} {:.2f}\n",
               1000 + i, total.alone.drift.back(), total.with.drift.back(), total.closures.back(),
               total.wrong.back(), total.with.nees_position.back(),
               total.with.nees_attitude.back());
    std::fflush(stdout);
  }
  report("alone", total.alone);
  report("with loops", total.with);
  fmt::print("{:.0f} loops a dive, {:.0f} wrong in all\n", mean(total.closures),
             mean(total.wrong) * study.runs);
  return 0;
}
