#include "test/estimation/visual_inertial/filter/analytic_dive.h"

#include <array>
#include <cmath>

namespace dive::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLength = 114.5;  // m, circumference of the ellipse with these half axes
constexpr double kHalfX = 22.0;
constexpr double kHalfY = 14.0;
constexpr double kMiddleDepth = 6.0;
constexpr double kGravity = 9.81;
constexpr int kPoints = 6000;

// amplitude sin(w t + phase), and its derivatives
struct Wave {
  double amplitude;
  double rate;
  double phase;
  [[nodiscard]] double value(double t) const { return amplitude * std::sin(rate * t + phase); }
  [[nodiscard]] double first(double t) const {
    return amplitude * rate * std::cos(rate * t + phase);
  }
  [[nodiscard]] double second(double t) const { return -rate * rate * value(t); }
};

// Per axis of W: the oval, depth that changes three times a lap, the oscillation by the flippers.
std::array<std::array<Wave, 2>, 3> waves(double w) {
  const double is_moving = w > 0.0 ? 1.0 : 0.0;
  return {{{{{kHalfX, w, 0.0}, {0.005 * is_moving, 4.1, 0.3}}},
           {{{kHalfY, w, -M_PI / 2}, {0.008 * is_moving, 3.3, 1.3}}},
           {{{0.8, 3.0 * w, 0.4}, {0.01 * is_moving, 5.2, 2.1}}}}};
}

// Along the tangent of the oval, with a sway; roll and pitch slowly, with the flippers'
// oscillation.
Quaterniond attitude(double t, double w) {
  const double is_moving = w > 0.0 ? 1.0 : 0.0;
  // d/dt of (a sin wt, -b cos wt)
  const double heading = std::atan2(kHalfY * std::sin(w * t), kHalfX * std::cos(w * t));
  const double roll = is_moving * (0.25 * std::sin(0.21 * t) + 0.03 * std::sin(4.4 * t));
  const double pitch = is_moving * (0.12 * std::sin(0.17 * t + 1.0) + 0.03 * std::sin(5.0 * t));
  return from_rpy(roll, pitch, heading + is_moving * 0.05 * std::sin(0.9 * t));
}

CameraModel camera(double y, LensModel lens) {
  CameraModel model;
  model.lens = lens;
  model.width = 752;
  model.height = lens == LensModel::kPinhole ? 480 : 590;
  model.fx = model.fy = lens == LensModel::kPinhole ? 240.0 : 375.0;
  model.cx = 375.5;
  model.cy = 0.5 * (model.height - 1);
  // The optical axis along x of B, then 40 degrees down; x of the image to the right.
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  model.X_BC = {{0.31, y, 0.0}, from_rpy(0.0, deg_to_rad(40.0), 0.0) * Quaterniond(R)};
  return model;
}

}  // namespace

AnalyticDive::AnalyticDive(AnalyticDiveOptions options, std::uint64_t seed)
    : options_(options), random_(seed, 77) {
  nominal_cameras_.push_back(camera(0.07, options_.lens));
  if (options_.is_stereo) nominal_cameras_.push_back(camera(-0.07, options_.lens));
  Random of_optics(seed, 79);
  const double index = options_.refractive_index_sigma * of_optics.normal();
  for (CameraModel& model : nominal_cameras_) {
    model.refractive_index = options_.refractive_index;
    model.line_time_s = options_.line_time_s;
    CameraModel truth = model;
    truth.X_BC = {model.X_BC.p + normal3(options_.extrinsic_sigma_m),
                  model.X_BC.q * so3_exp(normal3(deg_to_rad(options_.extrinsic_sigma_deg)))};
    truth.fx *= 1.0 + options_.focal_sigma * of_optics.normal();
    truth.fy *= 1.0 + options_.focal_sigma * of_optics.normal();
    truth.cx += options_.centre_sigma_px * of_optics.normal();
    truth.cy += options_.centre_sigma_px * of_optics.normal();
    truth.refractive_index += index;
    true_.push_back(truth);
  }
  time_offset_s_ = options_.time_offset_sigma_s * random_.normal();
  gyro_bias_ = normal3(options_.gyro_bias_sigma);
  accel_bias_ = normal3(options_.accel_bias_sigma);
  depth_bias_m_ = options_.depth_bias_sigma_m * Random(seed, 80).normal();
  Random of_scale(seed, 78);
  const auto normal33 = [&of_scale](double sigma) {
    return Eigen::Matrix3d(Eigen::Matrix3d::NullaryExpr([&] { return sigma * of_scale.normal(); }));
  };
  gyro_scale_ = Eigen::Matrix3d::Identity() + normal33(options_.imu_scale_sigma);
  accel_scale_ = Eigen::Matrix3d::Identity() + normal33(options_.imu_scale_sigma);
  gyro_by_accel_ = normal33(options_.gyro_by_accel_sigma);
  const double tilt = deg_to_rad(options_.unit_tilt_deg);
  unit_error_ = so3_exp({tilt * random_.normal(), tilt * random_.normal(),
                         deg_to_rad(options_.unit_heading_deg) * random_.normal()});
  MadeFeatureOptions of_features;
  of_features.features = options_.features;
  of_features.snow_share = options_.snow_share;
  of_features.loss_share = options_.loss_share;
  of_features.pixel_sigma = options_.pixel_sigma;
  features_.emplace(of_features, nominal_cameras_, true_, random_);
  const double lap = kLength / 0.4;
  for (int i = 0; i < kPoints; ++i) {
    const double t = options_.speed > 0.0 ? lap * 0.4 / options_.speed * i / kPoints : 0.0;
    features_->add_point_before(truth(t).X_WB);
  }
}

Vector3d AnalyticDive::normal3(double sigma) {
  const double x = random_.normal();
  const double y = random_.normal();
  return sigma * Vector3d(x, y, random_.normal());
}

DiveTruth AnalyticDive::truth(double t) const {
  constexpr double kStep = 1e-4;  // s, of the difference that gives the turn rate
  const double w = 2.0 * M_PI * options_.speed / kLength;
  DiveTruth truth;
  Vector3d v_W = Vector3d::Zero();
  truth.X_WB.p = {0.0, 0.0, -kMiddleDepth};
  truth.acceleration_W.setZero();
  const auto all = waves(w);
  for (int axis = 0; axis < 3; ++axis) {
    for (const Wave& wave : all[static_cast<std::size_t>(axis)]) {
      truth.X_WB.p[axis] += wave.value(t);
      v_W[axis] += wave.first(t);
      truth.acceleration_W[axis] += wave.second(t);
    }
  }
  truth.X_WB.q = attitude(t, w);
  truth.v_WB_B = truth.X_WB.q.conjugate() * v_W;
  const Eigen::AngleAxisd turn(attitude(t - kStep, w).conjugate() * attitude(t + kStep, w));
  truth.omega_WB_B = turn.angle() / (2.0 * kStep) * turn.axis();
  return truth;
}

ImuSample AnalyticDive::imu(Utime utime) {
  const DiveTruth now = truth(to_seconds(utime));
  const double dt = 1.0 / options_.imu_hz;
  gyro_bias_ += normal3(options_.gyro_walk * std::sqrt(dt));
  accel_bias_ += normal3(options_.accel_walk * std::sqrt(dt));
  ImuSample sample;
  sample.utime = utime;
  sample.q_WB = now.X_WB.q * unit_error_;
  const Vector3d force_B = now.X_WB.q.conjugate() * (now.acceleration_W + Vector3d(0, 0, kGravity));
  sample.gyro_B = gyro_scale_ * now.omega_WB_B + gyro_by_accel_ * force_B + gyro_bias_ +
                  normal3(options_.gyro_noise / std::sqrt(dt));
  sample.accel_B =
      accel_scale_ * force_B + accel_bias_ + normal3(options_.accel_noise / std::sqrt(dt));
  return sample;
}

DepthSample AnalyticDive::depth(Utime utime) {
  const double depth_m = -truth(to_seconds(utime)).X_WB.p.z() + depth_bias_m_;
  return {utime, depth_m + options_.depth_sigma_m * random_.normal()};
}

estimation::FeatureFrame AnalyticDive::frame(Utime utime) {
  estimation::FeatureFrame frame;
  frame.utime = utime - from_seconds(time_offset_s_);
  const auto motion = [this, utime](double seconds) {
    return truth(to_seconds(utime) + seconds).X_WB;
  };
  frame.features = features_->observe(motion, utime);
  return frame;
}

}  // namespace dive::testing
