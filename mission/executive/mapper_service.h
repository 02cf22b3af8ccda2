#pragma once
// The map of unknown water off the control thread. A sweep is answered a stated time after it was
// taken, never when the machine happens to be ready, so that a simulated dive is the same on every
// machine.

#include <deque>
#include <future>
#include <limits>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/range_scan.h"
#include "estimation/state_estimate.h"
#include "mission/executive/worker.h"
#include "planning/mapping/mapper.h"

namespace dive::mission {

class MapperService {
 public:
  /// `latency`: from submit() to the answer, in dive time, at least.
  MapperService(const planning::RobotHull& hull, const planning::MapperOptions& options,
                Utime latency, Late late = Late::kWait);
  ~MapperService();

  /// Where the vehicle is, every tick: a sweep is put where the vehicle was when it was measured.
  void observe(const estimation::StateEstimate& estimate);

  /// Starts mapping. With Late::kNotYet and a worker that is busy the sweep waits; of those that
  /// wait only the newest is kept. A sweep that was not measured while there were estimates is
  /// dropped.
  void submit(RangeScan scan, Utime now);

  /// The next update once its time has come. None is ever left out: each tells what changed since
  /// the one before.
  [[nodiscard]] std::optional<planning::MapUpdate> poll(Utime now);

  /// One point per voxel, in W. Waits for the worker.
  [[nodiscard]] std::vector<Eigen::Vector3f> points();

 private:
  struct Where {
    Utime utime;
    Pose X_WB;
    Eigen::Vector3d v_W;
  };
  struct Answer {
    Utime due = 0;
    std::optional<planning::MapUpdate> update;
  };

  [[nodiscard]] std::optional<Where> where_at(Utime utime) const;
  void launch(RangeScan scan, Utime now);
  void collect();

  SteadyClock clock_;
  planning::Mapper mapper_;
  Utime latency_;
  Late late_;
  /// What the estimates of a time did not know yet of how far they were off.
  struct Correction {
    Eigen::Vector2d off_W;
    Utime told = std::numeric_limits<Utime>::max();  ///< To the estimator.
  };
  std::deque<Where> track_;
  std::deque<Correction> corrections_;
  std::future<Answer> working_;
  std::deque<Answer> answers_;
  std::optional<std::pair<RangeScan, Utime>> next_;
};

}  // namespace dive::mission
