#include "behaviors/drift_stop.h"

#include <gtest/gtest.h>

#include "common/se3.h"

namespace dive::behaviors {
namespace {

using Eigen::Vector3d;

Eigen::Quaterniond heading(double yaw) { return from_rpy(0.0, 0.0, yaw); }

TEST(DriftStop, KeepsItsHeadingWhenTheDriftLiesAlongTheHull) {
  DriftStop stop;
  EXPECT_NEAR(stop.heading(heading(0.7), {0.4, 0.01, 0.0}), 0.7, 1e-12);
  EXPECT_NEAR(stop.heading(heading(0.8), {-0.2, 0.0, 0.1}), 0.7, 1e-12) << "that of the beginning";
}

TEST(DriftStop, TurnsBowOrSternIntoTheDrift) {
  DriftStop stop;
  EXPECT_NEAR(stop.heading(heading(1.0), {0.1, 0.1, 0.0}), 1.0 + M_PI / 4, 1e-9);
  EXPECT_NEAR(stop.heading(heading(1.0), {-0.1, 0.1, 0.0}), 1.0 - M_PI / 4, 1e-9)
      << "the stern is nearer";
  EXPECT_NEAR(stop.heading(heading(1.0), {0.0, 0.01, 0.0}), 1.0 - M_PI / 4, 1e-9)
      << "almost at rest it stays as it turned";
  stop.reset();
  EXPECT_NEAR(stop.heading(heading(2.0), Vector3d::Zero()), 2.0, 1e-12);
}

// On its side the drift across the hull may be along z of B.
TEST(DriftStop, MeansTheDriftOverGround) {
  DriftStop stop;
  const Eigen::Quaterniond on_its_side = from_rpy(-M_PI / 2, 0.0, 0.0);
  const Vector3d drift_B = on_its_side.conjugate() * Vector3d(0.1, 0.1, 0.0);
  EXPECT_NEAR(stop.heading(on_its_side, drift_B), M_PI / 4, 1e-9);
}

}  // namespace
}  // namespace dive::behaviors
