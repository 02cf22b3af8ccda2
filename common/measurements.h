#pragma once
// What the sensors say. Plain values that several rooms share; each stamped with the time at which
// it was taken, not at which it arrived.

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/clock.h"

namespace dive {

struct ImuSample {
  Utime utime = 0;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< The unit's own attitude filter.
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();          ///< rad/s.
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();         ///< Specific force, m/s^2.
};

struct DepthSample {
  Utime utime = 0;
  double depth_m = 0.0;  ///< Of B's origin, positive down.
};

struct HealthSample {
  Utime utime = 0;
  double battery_fraction = 1.0;
  double temperature_c = 20.0;  ///< Inside the hull.
  bool leak = false;
  double voltage_v = 0.0;  ///< Of the battery; 0 where it is not measured.
  double current_a = 0.0;  ///< Drawn from it; 0 where it is not measured.
};

struct ImageFrame {
  enum class Format { kGray8, kRgb8 };

  Utime utime = 0;  ///< Middle of the exposure.
  int camera = 0;   ///< 0 front left, 1 front right, 2 back.
  Format format = Format::kGray8;
  int width = 0;                     ///< Pixels.
  int height = 0;                    ///< Pixels.
  std::vector<std::uint8_t> pixels;  ///< Row by row from the top, without gaps.
};

}  // namespace dive
