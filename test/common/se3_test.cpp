#include "common/se3.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "test/common/arbitrary.h"

namespace dive {
namespace {

using testing::arbitrary_pose;
using testing::arbitrary_rotation_vector;

// Rodrigues' formula, written independently of the quaternion code under test.
Eigen::Matrix3d rodrigues(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  Eigen::Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + W;
  return Eigen::Matrix3d::Identity() + std::sin(angle) / angle * W +
         (1 - std::cos(angle)) / (angle * angle) * W * W;
}

RC_GTEST_PROP(So3, ExpIsRodrigues, ()) {
  const Eigen::Vector3d w = *arbitrary_rotation_vector();
  RC_ASSERT((so3_exp(w).toRotationMatrix() - rodrigues(w)).norm() < 1e-12);
}

RC_GTEST_PROP(So3, LogInvertsExp, ()) {
  const Eigen::Vector3d w = *arbitrary_rotation_vector();
  const Eigen::Vector3d back = so3_log(so3_exp(w));
  RC_ASSERT(back.norm() <= M_PI + 1e-12);
  RC_ASSERT((rodrigues(back) - rodrigues(w)).norm() < 1e-11);
}

TEST(So3, TinyAnglesKeepTheirDigits) {
  for (double angle = 1.0; angle > 1e-14; angle *= 0.1) {
    const Eigen::Vector3d w(angle, 0, 0);
    EXPECT_NEAR(so3_log(so3_exp(w)).x() / angle, 1.0, 1e-12) << angle;
  }
}

TEST(So3, AQuaternionAndItsNegativeAreOneRotation) {
  const Eigen::Quaterniond q = so3_exp({0.3, -0.2, 0.9});
  const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((so3_log(q) - so3_log(negated)).norm(), 1e-14);
  EXPECT_NEAR(angle_between(q, negated), 0.0, 1e-12);
}

RC_GTEST_PROP(Pose, ComposesAsMatricesDoAndInverts, ()) {
  const Pose a = *arbitrary_pose();
  const Pose b = *arbitrary_pose();
  const Eigen::Vector3d x(0.3, -1.0, 2.0);
  RC_ASSERT(((a * b) * x - a * (b * x)).norm() < 1e-9);
  RC_ASSERT((a.inverse() * (a * x) - x).norm() < 1e-9);
}

RC_GTEST_PROP(Interpolate, MeetsItsEndsAndTurnsEvenly, ()) {
  const Pose a = *arbitrary_pose();
  const Pose b = *arbitrary_pose();
  RC_ASSERT(interpolate(a, b, 0.0).p == a.p);
  RC_ASSERT(interpolate(a, b, 1.0).q.coeffs() == b.q.coeffs());
  const Pose third = interpolate(a, b, 1.0 / 3.0);
  RC_ASSERT(std::abs(3 * angle_between(a.q, third.q) - angle_between(a.q, b.q)) < 1e-9);
  RC_ASSERT((third.p - (2 * a.p + b.p) / 3).norm() < 1e-9);
}

RC_GTEST_PROP(Rpy, RoundTrips, ()) {
  const Eigen::Quaterniond q = so3_exp(*arbitrary_rotation_vector());
  const Eigen::Vector3d rpy = to_rpy(q);
  RC_ASSERT(angle_between(q, from_rpy(rpy.x(), rpy.y(), rpy.z())) < 1e-6);
}

RC_GTEST_PROP(Rpy, AHeadingAloneIsTheProductOfThreeTurnsToTheBit, ()) {
  const double yaw =
      (*arbitrary_rotation_vector()).norm() * (*rc::gen::arbitrary<bool>() ? 1.0 : -1.0);
  const Eigen::Quaterniond turns = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(0.0, Eigen::Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(0.0, Eigen::Vector3d::UnitX());
  const Eigen::Vector4d difference = from_rpy(0.0, 0.0, yaw).coeffs() - turns.coeffs();
  RC_ASSERT(difference.isZero(0.0));
  RC_ASSERT(!std::signbit(from_rpy(0.0, 0.0, yaw).x()) && !std::signbit(turns.x()));
}

TEST(Rpy, PositivePitchIsNoseDown) {
  const Eigen::Vector3d nose = from_rpy(0, 0.5, 0) * Eigen::Vector3d::UnitX();
  EXPECT_LT(nose.z(), 0);
}

TEST(HeadingAlong, PointsTheNoseWithoutRoll) {
  const Eigen::Vector3d direction(1.0, -2.0, 0.7);
  const Eigen::Quaterniond q = heading_along(direction);
  EXPECT_LT((q * Eigen::Vector3d::UnitX() - direction.normalized()).norm(), 1e-12);
  EXPECT_NEAR((q * Eigen::Vector3d::UnitY()).z(), 0.0, 1e-12);
  EXPECT_NEAR(to_rpy(heading_along({0, 0, 1}, 1.2)).y(), -M_PI / 2, 1e-12);
}

TEST(WrapAngle, IsInHalfOpenInterval) {
  EXPECT_DOUBLE_EQ(wrap_angle(M_PI), M_PI);
  EXPECT_DOUBLE_EQ(wrap_angle(-M_PI), M_PI);
  EXPECT_NEAR(wrap_angle(7.0), 7.0 - 2 * M_PI, 1e-12);
}

}  // namespace
}  // namespace dive
