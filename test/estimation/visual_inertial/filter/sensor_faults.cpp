#include "test/estimation/visual_inertial/filter/sensor_faults.h"

#include <memory>

#include "common/assert.h"

namespace dive::testing {
namespace {

using Eigen::Vector3d;
using estimation::FeatureFrame;

constexpr double kOnset = 8.0;
constexpr double kEnd = 20.0;
constexpr double kFar2 = 33.0;  // chi^2 of three degrees of freedom with the probability of 5 sigma

Vector3d direction(Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  return Vector3d(x, y, random.normal()).normalized();
}

void turn(Eigen::Vector2d& image, const Eigen::Quaterniond& q) {
  image = (q * image.homogeneous()).hnormalized();
}

void spoil_imu(const std::string& fault, double onset, Random& random, Hooks& hooks) {
  if (fault == "gyro_saturated") {
    const double end = onset + random.uniform(0.3, 3.0);
    hooks.spoil_imu = [=](double t, ImuSample& sample) {
      if (t > onset && t < end) sample.gyro_B.z() = 10.0;
    };
  } else if (fault == "gyro_bias") {
    const Vector3d bias = random.uniform(0.03, 0.3) * direction(random);
    hooks.spoil_imu = [=](double t, ImuSample& sample) {
      if (t > onset) sample.gyro_B += bias;
    };
  } else if (fault == "accelerometer_bias") {
    const Vector3d bias = random.uniform(0.4, 2.0) * direction(random);
    hooks.spoil_imu = [=](double t, ImuSample& sample) {
      if (t > onset) sample.accel_B += bias;
    };
  }
}

void spoil_depth(const std::string& fault, double onset, Random& random, Hooks& hooks) {
  const double size = random.uniform() < 0.5 ? -1.0 : 1.0;
  if (fault == "depth_jump") {
    const double jump = size * random.uniform(0.3, 3.0);
    hooks.spoil_depth = [=](double t, DepthSample& sample) {
      if (t > onset) sample.depth_m += jump;
    };
  } else if (fault == "depth_drift") {
    const double rate = size * random.uniform(0.02, 0.2);
    hooks.spoil_depth = [=](double t, DepthSample& sample) {
      if (t > onset) sample.depth_m += rate * (t - onset);
    };
  }
}

void spoil_frames(const std::string& fault, double onset, Random& random, Hooks& hooks) {
  if (fault == "frozen_camera") {
    auto last = std::make_shared<FeatureFrame>();
    hooks.spoil_frame = [=](double t, FeatureFrame& frame) {
      if (t < onset) {
        *last = frame;
      } else {
        frame.features = last->features;
      }
    };
  } else if (fault == "all_features_wrong") {
    const double size = random.uniform(0.02, 0.3);
    auto draw = std::make_shared<Random>(random.bits(), 8);
    hooks.spoil_frame = [=](double t, FeatureFrame& frame) {
      for (auto& feature : frame.features) {
        if (t < onset) break;
        const double x = size * draw->normal();
        feature.left += Eigen::Vector2d(x, size * draw->normal());
      }
    };
  } else if (fault == "camera_knocked") {
    const double angle = deg_to_rad(random.uniform(2.0, 6.0));
    const Eigen::Quaterniond q = so3_exp(angle * direction(random));
    const bool both = random.uniform() < 0.5;
    hooks.spoil_frame = [=](double t, FeatureFrame& frame) {
      for (auto& feature : frame.features) {
        if (t < onset) break;
        turn(feature.left, q);
        if (both && feature.right) turn(*feature.right, q);
      }
    };
  }
}

bool is_flagged(const estimation::FilterHealth& health) {
  return health.diverged || health.is_blind || health.is_suspect || health.depth_fault;
}

}  // namespace

const std::vector<std::string>& sensor_faults() {
  static const std::vector<std::string> names{
      "gyro_saturated", "gyro_bias",          "accelerometer_bias", "depth_jump",
      "depth_drift",    "all_features_wrong", "frozen_camera",      "camera_knocked"};
  return names;
}

Hooks spoiled_by(const std::string& fault, double onset, Random& random) {
  Hooks hooks;
  spoil_imu(fault, onset, random, hooks);
  spoil_depth(fault, onset, random, hooks);
  spoil_frames(fault, onset, random, hooks);
  return hooks;
}

FaultDive dive_with(const std::string& fault, std::uint64_t seed) {
  const AnalyticDiveOptions options;
  AnalyticDive dive(options, seed);
  Random random(seed, 3);
  const double begin = random.uniform(0.0, 100.0);
  estimation::VisualInertialFilter filter(filter_options(dive, options),
                                          known_start(dive, begin, random));
  FaultDive result;
  Hooks hooks = spoiled_by(fault, begin + kOnset, random);
  hooks.each_second = [&](const ErrorSample& error) {
    if (error.t < begin + kOnset) return;
    const estimation::FilterHealth& health = filter.health();
    const bool is_reported = is_flagged(health);
    ++result.seconds;
    result.flagged += is_reported ? 1 : 0;
    if (is_reported) result.reason = health.diverged ? health.reason : health.suspicion;
    if (error.nees_position < kFar2 && error.nees_attitude < kFar2) return;
    ++result.far;
    result.unreported += is_reported ? 0 : 1;
  };
  static_cast<void>(run(dive, options, filter, begin, begin + kEnd, hooks));
  return result;
}

}  // namespace dive::testing
