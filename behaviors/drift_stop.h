#pragma once
// Stops a drift by thrust. The flippers cannot push sideways, and a hull that slips sideways coasts
// for half a minute: it is turned until the drift lies along it, bow or stern ahead, and surge
// stops it.

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dive::behaviors {

class DriftStop {
 public:
  /// Heading (yaw, rad) for this tick, with no forward speed commanded: that of the first call
  /// until the vehicle slips sideways. `v_B` is its velocity in B, m/s.
  [[nodiscard]] double heading(const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& v_B);
  void reset() { yaw_.reset(); }

 private:
  std::optional<double> yaw_;
};

}  // namespace dive::behaviors
