#include "estimation/visual_inertial/filter/landmark_points.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;

constexpr RangeNoise kLimit{0.02, 0.0, 0.01};  // 0.18 m at 4 m

StateEstimate estimate_with(double drift_m) {
  StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB = {{10, 0, -5}, from_rpy(0, 0, M_PI / 2)};
  estimate.covariance.topLeftCorner<3, 3>().diagonal().setConstant(drift_m * drift_m);
  return estimate;
}

// A landmark `ahead` metres in front of the vehicle, including the vehicle's own drift.
Landmark landmark(double ahead, double sigma, double drift_m) {
  const double variance = sigma * sigma + drift_m * drift_m;
  return {1, {10, ahead, -5}, variance * Matrix3d::Identity()};
}

TEST(LandmarkPoints, AreTheAccurateOnesInTheVehiclesFrameWhateverItsOwnError) {
  for (const double drift : {0.0, 2.0}) {
    const std::vector<Eigen::Vector3f> points = landmark_points_B(
        estimate_with(drift), std::vector{landmark(4.0, 0.17, drift), landmark(4.0, 0.19, drift)},
        kLimit);
    ASSERT_EQ(points.size(), 1U) << drift;
    EXPECT_LT((points[0] - Eigen::Vector3f(4, 0, 0)).norm(), 1e-5F);
  }
}

TEST(LandmarkPoints, AFartherOneMayBeLessCertain) {
  const std::vector landmarks{landmark(2.0, 0.1, 0.0), landmark(6.0, 0.1, 0.0)};
  const std::vector<Eigen::Vector3f> points =
      landmark_points_B(estimate_with(0.0), landmarks, kLimit);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_NEAR(points[0].x(), 6.0F, 1e-5F);
}

TEST(LandmarkPoints, WhatIsNotFiniteGivesNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector landmarks{landmark(4.0, 0.1, 0.0), landmark(4.0, 0.1, 0.0)};
  landmarks[0].p_W.x() = kNan;
  landmarks[1].covariance(0, 0) = kNan;
  EXPECT_TRUE(landmark_points_B(estimate_with(0.0), landmarks, kLimit).empty());
  StateEstimate lost = estimate_with(0.0);
  lost.X_WB.p.x() = kNan;
  EXPECT_TRUE(landmark_points_B(lost, std::vector{landmark(4.0, 0.1, 0.0)}, kLimit).empty());
}

}  // namespace
}  // namespace dive::estimation
