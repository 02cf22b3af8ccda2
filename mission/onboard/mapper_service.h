#pragma once
// The mapper on a worker thread, for unknown environments and for what a known map lacks. The
// result of a scan is delivered a stated time after its submission, not when the machine is ready,
// so that a simulated dive is the same on every machine.

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/range_scan.h"
#include "common/timed_buffer.h"
#include "estimation/state_estimate.h"
#include "mission/onboard/delayed_worker.h"
#include "planning/map_matching/map_surface.h"
#include "planning/mapping/mapper.h"
#include "planning/world/absent_objects.h"

namespace dive::mission {

/// The observed map after a loop closure: `obstacles` has all of it.
struct MovedMap {
  MapCorrection correction;
  planning::ObstacleUpdate obstacles;
};

/// One of the two.
struct MapperResult {
  std::optional<planning::ScanResult> scan;
  std::optional<MovedMap> moved;
};

class MapperService {
 public:
  /// `latency`: least time from submit() to the result, in dive time, us.
  /// `known`: surface of the known map; null in an unknown environment.
  MapperService(const planning::RobotHull& hull, const planning::MapperOptions& options,
                std::shared_ptr<const planning::MapSurface> known, Utime latency,
                OnLate late = OnLate::kBlock);

  /// Sets the objects of the known map that are gone: what is there is mapped, from the next scan
  /// on.
  void set_absent(const planning::AbsentObjects& absent) { absent_ = absent; }

  /// Records the published pose of this tick. A scan is placed by the odometry at its time and the
  /// newest map <- odom correction.
  void observe(const estimation::StateEstimate& estimate);

  /// Submits a scan. With OnLate::kPoll it waits for the worker; of the waiting scans only the
  /// newest is kept. A scan without an estimate at its time is dropped. `ahead`: obstacle that the
  /// scan shows in the vehicle's way.
  void submit(RangeScan scan, Utime now,
              const std::optional<planning::ObstacleAhead>& ahead = std::nullopt);

  /// Moves the observed map after a loop closure, as soon as the worker may start. Scans are placed
  /// accordingly from then on. Demands a well-formed correction, and an unknown environment.
  void move(MapCorrection correction, Utime now);

  /// The next result once it is due; empty if it is none of use. No result is skipped: the
  /// obstacles of each are changes since the last one.
  [[nodiscard]] MapperResult poll(Utime now);
  /// DelayedWorker::take_failure()
  [[nodiscard]] std::optional<std::string> take_failure() { return worker_.take_failure(); }

  /// One point per voxel, in W. Waits for the worker.
  [[nodiscard]] std::vector<Eigen::Vector3f> points();

 private:
  struct Motion {
    Utime utime = 0;
    Pose X_OB;                                      ///< Pose in the odometry frame.
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< m/s
    // One sigma:
    double position_sigma_m = 0.0;
    double attitude_sigma = 0.0;  ///< rad
  };
  static constexpr std::size_t kPast = 256;  ///< Ticks stored, 5 s; older scans are dropped.

  [[nodiscard]] std::optional<Motion> motion_at(Utime utime) const;
  [[nodiscard]] PlanarTransform map_from_odom() const;
  struct Submitted {
    RangeScan scan;
    Utime at = 0;
    std::optional<planning::ObstacleAhead> ahead;
  };
  void launch_waiting();
  void launch(Submitted submitted);

  SteadyClock clock_;
  /// Objects absent when the scan being mapped was taken; used by the worker only.
  std::shared_ptr<planning::AbsentObjects> absent_on_worker_;
  planning::Mapper mapper_;
  planning::AbsentObjects absent_;
  Utime latency_;
  TimedBuffer<Motion, kPast> past_;
  PlanarTransform map_from_odom_;  ///< Correction in the newest published pose.
  struct Move {
    MapCorrection correction;
    Utime at = 0;
  };
  std::deque<Move> moves_;  ///< That wait for the worker.
  std::optional<Submitted> next_;
  DelayedWorker<MapperResult> worker_;
};

}  // namespace dive::mission
