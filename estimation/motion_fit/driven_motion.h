#pragma once
// A dive as the motion model is driven: at each tick the efforts, the turn rate and the attitude,
// as the primitive estimator uses them, without the gyro's bias; and its windows.

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimation/motion_fit/motion_record.h"

namespace dive::estimation {

/// A tick with what drove the vehicle since the tick before.
struct DrivenTick {
  Utime utime = 0;
  double dt = 0.0;  ///< Since the tick before, s.
  Eigen::Vector2d efforts = Eigen::Vector2d::Zero();
  Eigen::Vector3d omega_B = Eigen::Vector3d::Zero();         ///< Without the gyro's bias, rad/s.
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< In the middle.
};

/// Mean of the depth samples of a fifth of a second.
struct MeanHeight {
  Utime utime = 0;
  double z = 0.0;  ///< m
};

/// Part of a dive that is predicted from one initial state.
struct MotionWindow {
  std::size_t dive = 0;
  std::size_t first = 0;      ///< First tick: its state is the initial one.
  std::size_t last = 0;       ///< Last tick.
  std::vector<MapFix> fixes;  ///< Within it.
  std::vector<MeanHeight> heights;
};

struct WindowOptions {
  double length_s = 10.0;
  double min_depth_m = 0.4;  ///< At the surface other forces act.
  std::size_t min_fixes = 4;
};

/// Ticks of times without attitude are left out, so that the tick after them has a large `dt`.
[[nodiscard]] std::vector<DrivenTick> driven_ticks(const MotionRecord& record);

/// The windows of a dive, one after the other: under water, without a gap, and with fixes over at
/// least half of their time.
[[nodiscard]] std::vector<MotionWindow> windows_of(const MotionRecord& record,
                                                   std::span<const DrivenTick> ticks,
                                                   std::size_t dive, const WindowOptions& options);

/// Number of its windows.
[[nodiscard]] int usable_windows(const MotionRecord& record, const WindowOptions& options);

}  // namespace dive::estimation
