#pragma once
// Map fixes from scans of the range camera, or of the stereo pair, in a known map, on a worker
// thread. The fix of a
// scan is delivered a stated time after its submission, not when the machine is ready, so that a
// simulated dive is the same on every machine. What it finds enters the log, so that a replay needs
// no scans.

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/clock.h"
#include "common/map_fix.h"
#include "common/range_scan.h"
#include "common/timed_buffer.h"
#include "estimation/state_estimate.h"
#include "mission/onboard/delayed_worker.h"
#include "planning/map_matching/absence_tracker.h"
#include "planning/map_matching/map_matcher.h"
#include "planning/map_matching/object_scan.h"
#include "planning/mapping/scan_check.h"

namespace dive::mission {

class MapMatchService {
 public:
  /// Least time between two scans that are matched, us: neighbours in time say the same.
  static constexpr Utime kPeriod = 450'000;

  /// `latency`: least time from submit() to the fix, in dive time, us. `objects`: those whose
  /// absence is to be found; null: none.
  MapMatchService(std::shared_ptr<const planning::MapSurface> known,
                  std::shared_ptr<const planning::ObjectCells> objects, const RangeNoise& noise,
                  Utime latency, OnLate late = OnLate::kBlock);

  /// Records the published pose of this tick, by which a scan is placed.
  void observe(const estimation::StateEstimate& estimate);
  /// After some scans that contradict the map the position may be another than believed: the next
  /// are matched within metres of it. A scan that comes too early, while the worker is busy on a
  /// vehicle, or without an estimate at its time is dropped.
  void submit(const RangeScan& scan, Utime now);
  [[nodiscard]] std::optional<MapFix> poll(Utime now);
  /// DelayedWorker::take_failure()
  [[nodiscard]] std::optional<std::string> take_failure() { return worker_.take_failure(); }
  /// Objects of the map that the scan of the last fix has shown to be gone, or back.
  [[nodiscard]] std::optional<planning::ObstacleUpdate> take_absences() {
    return std::exchange(absences_, std::nullopt);
  }

 private:
  struct Result {
    MapFix fix;
    Eigen::Vector3d from_W = Eigen::Vector3d::Zero();  ///< Origin of the rays, m.
    std::vector<planning::CellSighting> sightings;
  };

  static constexpr std::size_t kPast = 256;  ///< Ticks stored, 5 s; older scans are dropped.

  [[nodiscard]] std::optional<planning::PosePrior> prior_at(Utime utime) const;

  [[nodiscard]] Result match(const RangeScan& scan, const planning::PosePrior& prior);

  std::shared_ptr<const planning::MapSurface> known_;
  std::shared_ptr<const planning::ObjectCells> objects_;
  planning::MapMatcher matcher_;
  planning::PlaceSearch search_;  ///< Of the worker alone, which has one scan at a time.
  std::optional<planning::AbsenceTracker> absence_;
  std::optional<planning::ObstacleUpdate> absences_;
  Utime latency_;
  planning::ScanCheck check_;
  std::optional<Utime> last_;   ///< Time of the last scan that was matched, us.
  std::optional<Utime> fixed_;  ///< Time of the last scan that gave a position, us.
  int contradictions_ = 0;      ///< Scans in a row that contradict the map.
  TimedBuffer<planning::PosePrior, kPast> past_;
  DelayedWorker<Result> worker_;
};

}  // namespace dive::mission
