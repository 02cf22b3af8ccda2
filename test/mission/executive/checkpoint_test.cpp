// Treatment, by a new executive, of the time without one.

#include "mission/executive/checkpoint.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

TEST(GapOf, IsMeasuredByTheClockUnlessItIsGiven) {
  Resume resume;
  resume.checkpoint.utime = 100'000'000;
  EXPECT_DOUBLE_EQ(gap_of(resume, 107'500'000, 60.0), 7.5);
  resume.gap_s = 2.0;
  EXPECT_DOUBLE_EQ(gap_of(resume, 107'500'000, 60.0), 2.0);
}

TEST(GapOf, IsTooLongWhereTheClockWentBack) {
  Resume resume;
  resume.checkpoint.utime = 100'000'000;
  EXPECT_GT(gap_of(resume, 99'000'000, 60.0), 60.0);
}

// The vehicle keeps its speed for 0.3 s, which then decays at a rate of 1/s.
TEST(DriftIn, IsTheMotionOfAVehicleWithoutCommands) {
  Checkpoint checkpoint;
  const Eigen::Vector3d forward = Eigen::Vector3d(0.6, 0.8, 0.0);
  checkpoint.X_WB.q = from_rpy(0.0, 0.0, std::atan2(0.8, 0.6));
  checkpoint.v_W = 0.4 * forward;
  for (const double gap : {0.0, 0.1, 0.3, 1.0, 5.0, 60.0}) {
    const double dt = 1e-4;
    double speed = 0.4;
    double way = 0.0;
    for (double t = 0.0; t < gap; t += dt) {
      way += speed * dt;
      if (t >= 0.3) speed -= speed * dt;
    }
    const Drift drift = drift_in(gap, checkpoint, Eigen::Vector2d::Zero());
    EXPECT_LT((drift.by_W - way * forward.head<2>()).norm(), 1e-3) << gap;
    EXPECT_NEAR(drift.surge, speed, 1e-3) << gap;
    EXPECT_NEAR(drift.lost, 0.4 - speed, 1e-3) << gap;
    EXPECT_NEAR(drift.sigma_m, 0.2 * std::min(gap, 5.0) + 0.03 * std::max(gap - 5.0, 0.0), 1e-9)
        << gap;
  }
}

}  // namespace
}  // namespace dive::mission
