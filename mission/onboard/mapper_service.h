#pragma once
// The map of unknown water off the control thread. A sweep is answered a stated time after it was
// taken, never when the machine happens to be ready, so that a simulated dive is the same on every
// machine.

#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/range_scan.h"
#include "common/timed_buffer.h"
#include "estimation/state_estimate.h"
#include "mission/onboard/delayed_worker.h"
#include "planning/mapping/mapper.h"

namespace dive::mission {

class MapperService {
 public:
  /// `latency`: from submit() to the answer, in dive time, at least.
  MapperService(const planning::RobotHull& hull, const planning::MapperOptions& options,
                Utime latency, OnLate late = OnLate::kBlock);

  /// The published pose, every tick. A scan is placed by the odometry of the moment when it was
  /// taken and by the newest correction of that to the map.
  void observe(const estimation::StateEstimate& estimate);

  /// Starts mapping. With OnLate::kPoll and a worker that is busy the sweep waits; of those that
  /// wait only the newest is kept. A sweep that was not measured while there were estimates is
  /// dropped.
  void submit(RangeScan scan, Utime now);

  /// The next result once its time has come. None is ever left out: the obstacles of each are
  /// changes since the one before.
  [[nodiscard]] std::optional<planning::ScanResult> poll(Utime now);

  /// One point per voxel, in W. Waits for the worker.
  [[nodiscard]] std::vector<Eigen::Vector3f> points();

 private:
  struct Motion {
    Utime utime = 0;
    Pose X_OB;                                      ///< In the odometry frame.
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< m/s
  };
  static constexpr std::size_t kPast = 256;  ///< Ticks, five seconds: no older scan is mapped.

  [[nodiscard]] std::optional<Motion> motion_at(Utime utime) const;
  [[nodiscard]] PlanarTransform map_from_odom() const;
  void launch(RangeScan scan, Utime now);

  SteadyClock clock_;
  planning::Mapper mapper_;
  Utime latency_;
  TimedBuffer<Motion, kPast> past_;
  PlanarTransform map_from_odom_;  ///< Of the newest published pose.
  std::optional<std::pair<RangeScan, Utime>> next_;
  DelayedWorker<std::optional<planning::ScanResult>> worker_;
};

}  // namespace dive::mission
