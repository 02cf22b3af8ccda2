#include "estimation/visual_inertial/filter/landmark_cloud.h"

#include <limits>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Utime kSecond = 1'000'000;

StateEstimate estimate_at(Utime utime, double drift_m = 0.0) {
  StateEstimate estimate;
  estimate.utime = utime;
  estimate.valid = true;
  estimate.X_WB = {{10, 0, -5}, from_rpy(0, 0, M_PI / 2)};
  estimate.covariance.topLeftCorner<3, 3>().diagonal().setConstant(drift_m * drift_m);
  return estimate;
}

// A landmark `ahead` metres in front of the vehicle, including the vehicle's own drift.
Landmark landmark(std::int64_t id, double ahead, double sigma, double drift_m = 0.0) {
  const double variance = sigma * sigma + drift_m * drift_m;
  return {id, {10, ahead, -5}, variance * Matrix3d::Identity()};
}

TEST(LandmarkCloud, ReturnsWellPlacedLandmarksInTheVehiclesFrame) {
  LandmarkCloud cloud(LandmarkCloudOptions{});
  // At 4 m a sigma of 0.02 + 0.01 * 16 passes, whatever the vehicle's own error.
  for (const double drift : {0.0, 2.0}) {
    cloud.add(estimate_at(kSecond, drift),
              std::vector{landmark(1, 4.0, 0.17, drift), landmark(2, 4.0, 0.19, drift)});
    const RangeScan scan = cloud.scan(kSecond, estimate_at(kSecond).X_WB, {0.3, 0, 0});
    ASSERT_EQ(scan.points_B.size(), 1U);
    EXPECT_LT((scan.points_B[0] - Eigen::Vector3f(4, 0, 0)).norm(), 1e-5F);
    EXPECT_EQ(scan.utime, kSecond);
  }
}

TEST(LandmarkCloud, HandsOnNoneThatIsOldOrBeyondItsReach) {
  LandmarkCloud cloud(LandmarkCloudOptions{});
  cloud.add(estimate_at(kSecond), std::vector{landmark(1, 3.0, 0.01), landmark(2, 12.0, 0.01)});
  const Pose here = estimate_at(0).X_WB;
  EXPECT_EQ(cloud.scan(2 * kSecond, here, Vector3d::Zero()).points_B.size(), 1U);
  EXPECT_EQ(cloud.scan(4 * kSecond, here, Vector3d::Zero()).points_B.size(), 0U);
  EXPECT_EQ(cloud.scan(kSecond / 2, here, Vector3d::Zero()).points_B.size(), 0U);
  cloud.add(estimate_at(3 * kSecond), std::vector{landmark(1, 3.0, 0.01)});
  EXPECT_EQ(cloud.scan(4 * kSecond, here, Vector3d::Zero()).points_B.size(), 1U);
  EXPECT_EQ(cloud.all().size(), 2U);
}

TEST(LandmarkCloud, StaysBoundedByLeavingOutTheOldest) {
  LandmarkCloudOptions options;
  options.max_landmarks = 3;
  LandmarkCloud cloud(options);
  for (std::int64_t id = 1; id <= 4; ++id) {
    cloud.add(estimate_at(id * kSecond), std::vector{landmark(id, 3.0, 0.01)});
    cloud.add(estimate_at(id * kSecond + 1), std::vector{landmark(1, 3.0, 0.01)});
  }
  ASSERT_EQ(cloud.all().size(), 3U);
  EXPECT_TRUE(cloud.all().contains(1));  // observed repeatedly
  EXPECT_FALSE(cloud.all().contains(2));
}

TEST(LandmarkCloud, MovesWithALoopThatWasClosed) {
  LandmarkCloud cloud(LandmarkCloudOptions{});
  Landmark one = landmark(1, 3.0, 0.0);
  one.covariance.diagonal() << 1.0, 4.0, 9.0;
  cloud.add(estimate_at(kSecond), std::vector{one});
  const Pose turn{{1, 2, 3}, from_rpy(0, 0, M_PI / 2)};
  cloud.move([&](Utime utime) {
    EXPECT_EQ(utime, kSecond);
    return turn;
  });
  const CloudLandmark& moved = cloud.all().at(1);
  EXPECT_LT((moved.p_W - Vector3d(-2, 12, -2)).norm(), 1e-12);
  EXPECT_NEAR(moved.covariance(0, 0), 4.0, 1e-12);
  EXPECT_NEAR(moved.covariance(1, 1), 1.0, 1e-12);
}

TEST(LandmarkCloud, IgnoresWhatIsNotFinite) {
  LandmarkCloud cloud(LandmarkCloudOptions{});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Landmark nowhere = landmark(1, nan, 0.01);
  Landmark unsure = landmark(2, 3.0, nan);
  cloud.add(estimate_at(kSecond), std::vector{nowhere, unsure});
  StateEstimate lost = estimate_at(kSecond);
  lost.covariance(0, 0) = nan;
  cloud.add(lost, std::vector{landmark(3, 3.0, 0.01)});
  EXPECT_TRUE(cloud.all().empty());
}

TEST(LandmarkCloud, IsSavedInTheStatedFormat) {
  LandmarkCloud cloud(LandmarkCloudOptions{});
  cloud.add(estimate_at(kSecond), std::vector{landmark(7, 3.0, 0.01), landmark(8, 3.0, 5.0)});
  const std::string text = cloud.to_ply();
  EXPECT_EQ(text.rfind("ply\nformat ascii 1.0\nelement vertex 1\n", 0), 0U);
  const std::size_t body = text.find("end_header\n");
  ASSERT_NE(body, std::string::npos);
  std::istringstream row(text.substr(body + 11));
  std::vector<double> values(11);
  for (double& value : values) ASSERT_TRUE(row >> value);
  EXPECT_EQ(values, (std::vector<double>{10, 3, -5, 1e-4, 0, 0, 1e-4, 0, 1e-4, 7, 1}));
}

TEST(LandmarkCloud, OptionsOutOfRangeAreNamed) {
  LandmarkCloudOptions options;
  EXPECT_EQ(options.validate(), "");
  options.max_landmarks = 0;
  EXPECT_NE(options.validate().find("max_landmarks"), std::string::npos);
}

}  // namespace
}  // namespace dive::estimation
