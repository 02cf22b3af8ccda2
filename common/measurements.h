#pragma once
// Sensor measurements: plain values that several modules share, stamped with the time of
// measurement, not of arrival.

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/clock.h"

namespace dive {

struct ImuSample {
  Utime utime = 0;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< Attitude by the unit's own filter.
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();          ///< Angular rate, rad/s.
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();         ///< Specific force, m/s^2.
};

struct DepthSample {
  Utime utime = 0;
  double depth_m = 0.0;  ///< Depth of B's origin, m, positive down.
};

struct HealthSample {
  Utime utime = 0;
  double battery_fraction = 1.0;
  double temperature_c = 20.0;  ///< Temperature inside the hull.
  bool leak = false;
  double voltage_v = 0.0;  ///< Battery voltage; 0 if not measured.
  double current_a = 0.0;  ///< Battery current; 0 if not measured.
};

struct ImageFrame {
  enum class Format { kGray8, kRgb8 };
  static constexpr Format kLastFormat = Format::kRgb8;

  Utime utime = 0;  ///< Middle of the exposure.
  int camera = 0;   ///< 0 front left, 1 front right, 2 back.
  Format format = Format::kGray8;
  int width = 0;                     ///< Pixels.
  int height = 0;                    ///< Pixels.
  std::vector<std::uint8_t> pixels;  ///< Row by row from the top, without gaps.
};

}  // namespace dive
