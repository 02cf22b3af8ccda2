#pragma once
// What the uncertainty of the position leaves of the clearance where the vehicle is about to pass.
// Private to mission/executive.

#include <span>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/certify/position_margin.h"
#include "planning/world/scene.h"

namespace dive::mission {

class MarginMonitor {
 public:
  /// Time ahead for which the covariance of now is taken: farther ahead, fixes will have changed
  /// it, s.
  static constexpr double kAhead = 10.0;

  /// Grows the scratch memory of `known`, that of later updates.
  MarginMonitor(const planning::RobotHull& hull, planning::Scene& known) : meter_(hull) {
    meter_.reserve(known);
  }

  [[nodiscard]] bool is_due(Utime now) const { return now >= next_; }
  /// The least margin at X_WB and along `way` (either empty, or from X_WB on) in the known map.
  /// `P_W` (m^2): covariance of the horizontal position among the mapped obstacles. Allocates
  /// nothing.
  void update(Utime now, planning::Scene& known, const Pose& X_WB, std::span<const Pose> way,
              const Eigen::Matrix2d& P_W);
  /// That of the last update(); infinite before the first.
  [[nodiscard]] const planning::PositionMargin& least() const { return least_; }

 private:
  planning::PositionMarginMeter meter_;
  planning::PositionMargin least_;
  Utime next_ = 0;
};

}  // namespace dive::mission
