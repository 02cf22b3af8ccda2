#include "estimation/visual_inertial/filter/visual_update.h"

#include <gtest/gtest.h>

#include "test/estimation/visual_inertial/filter/filter_dive.h"

namespace dive::estimation {
namespace {

// A vehicle that hovers: its tracks are as long as the window, and must not be used up at once.
TEST(VisualUpdate, StillUsesFeaturesAfterAMinuteInOnePlace) {
  constexpr Utime kPeriod = 50'000;
  testing::AnalyticDiveOptions of_dive;
  of_dive.speed = 0.0;
  testing::AnalyticDive dive(of_dive, 5);
  const VisualInertialOptions options = testing::filter_options(dive, of_dive);
  const testing::DiveTruth truth = dive.truth(0.0);
  ImuState start;
  start.motion.q_WB = truth.X_WB.q;
  start.motion.p_WB = truth.X_WB.p;
  FilterState state(options);
  state.begin(start, 1e-6 * Matrix15d::Identity());
  VisualUpdate visual(options);
  int used = 0;
  for (int frame = 1; frame <= 1200; ++frame) {
    state.clone(frame, frame * kPeriod, Eigen::Vector3d::Zero());
    const auto report = visual.apply(state, dive.frame(frame * kPeriod), frame, 0.05);
    if (frame > 1000) used += report.used;
  }
  EXPECT_GT(used, 200);
}

}  // namespace
}  // namespace dive::estimation
