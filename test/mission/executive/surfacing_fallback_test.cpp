#include "mission/executive/surfacing_fallback.h"

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

// The other values of an exit path change from tick to tick while its waypoints stay.
TEST(SurfacingFallback, FollowsTheExitPathAsItWasKeptLast) {
  SurfacingFallback fallback{MotionModel{}};
  vehicle::ExitPath path;
  path.revision = 1;
  path.X_WB.p = {0, 0, -5};
  path.waypoints = {Pose{{5, 0, -5}}, Pose{{10, 0, -5}}};
  path.speed = 0.2;
  fallback.keep(path);
  path.speed = 0.4;
  fallback.keep(path);
  StepInputs inputs;
  inputs.now = 20'000;
  inputs.imu = ImuSample{.utime = inputs.now};
  inputs.depth = DepthSample{inputs.now, 5.0};
  EXPECT_DOUBLE_EQ(fallback.step(inputs, "a test").command.v, 0.4);
}

}  // namespace
}  // namespace dive::mission
