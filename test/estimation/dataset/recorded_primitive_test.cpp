#include "estimation/dataset/recorded_primitive.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Sways as a swimming vehicle does: 0.3 m/s^2 at 1.1 Hz, and rolls slowly by 14 degrees.
Quaterniond attitude_at(double t) {
  return from_rpy(0.25 * std::sin(0.2 * t), 0.1 * std::sin(0.13 * t), 0.3 * std::sin(0.1 * t));
}

// The angle of the vertical in B to the true one at the end of so many seconds, deg.
double tilt_error_deg(double seconds, const Vector3d& bias_B, const Vector3d& known_bias_B) {
  constexpr double kStep = 0.005;
  PredictedAttitude predicted(std::nullopt, known_bias_B);
  double error = 0.0;
  for (double t = 0.0; t <= seconds; t += kStep) {
    const Quaterniond q = attitude_at(t);
    const Vector3d rate_B =
        so3_log(attitude_at(t - 1e-4).conjugate() * attitude_at(t + 1e-4)) / 2e-4;
    ImuSample sample;
    sample.utime = from_seconds(t);
    sample.gyro_B = rate_B + bias_B;
    sample.accel_B =
        q.conjugate() * Vector3d(0.3 * std::sin(7.0 * t), 0.2 * std::cos(7.0 * t), 9.81);
    predicted.add_to(sample);
    const Vector3d up = sample.q_WB.conjugate() * Vector3d::UnitZ();
    error = std::acos(std::min(1.0, up.dot(q.conjugate() * Vector3d::UnitZ())));
  }
  return rad_to_deg(error);
}

// Corrected towards gravity alone, a bias of 0.05 rad/s tilts the attitude by 57 degrees.
TEST(PredictedAttitudeOfARecording, FindsTheBiasAcrossTheVertical) {
  const Vector3d bias_B(0.05, -0.08, 0.0);
  for (const double seconds : {10.0, 60.0, 300.0}) {
    EXPECT_LT(tilt_error_deg(seconds, bias_B, Vector3d::Zero()), 3.0) << seconds;
  }
}

TEST(PredictedAttitudeOfARecording, BeginsFromAKnownBias) {
  const Vector3d bias_B(0.05, -0.08, 0.04);
  EXPECT_LT(tilt_error_deg(0.5, bias_B, bias_B), 2.5);
  EXPECT_LT(tilt_error_deg(60.0, bias_B, bias_B), 1.5);
}

}  // namespace
}  // namespace dive::estimation
