#include "mission/onboard/mapper_service.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "common/assert.h"
#include "mission/onboard/scan_placement.h"

namespace dive::mission {
namespace {

planning::IsKnown is_known(std::shared_ptr<const planning::MapSurface> known,
                           std::shared_ptr<const planning::AbsentObjects> absent) {
  if (!known) return nullptr;
  return [known = std::move(known), absent = std::move(absent)](const Eigen::Vector3f& p_W,
                                                                double tolerance) {
    return known->is_near(p_W.cast<double>(), tolerance,
                          [&](int object) { return absent->contains(object); });
  };
}

}  // namespace

MapperService::MapperService(const planning::RobotHull& hull,
                             const planning::MapperOptions& options,
                             std::shared_ptr<const planning::MapSurface> known, Utime latency,
                             OnLate late)
    : absent_on_worker_(std::make_shared<planning::AbsentObjects>()),
      mapper_(hull, options, clock_, is_known(std::move(known), absent_on_worker_)),
      latency_(latency),
      worker_(late) {}

void MapperService::observe(const estimation::StateEstimate& estimate) {
  if (!can_place_scans(estimate)) return;
  map_from_odom_ = estimate.map_from_odom;
  past_.push(estimate.utime,
             {estimate.utime, odometry_pose(estimate), estimate.X_WB.q * estimate.v_WB_B,
              estimation::horizontal_sigma(estimate), attitude_sigma(estimate)});
  if (worker_.has_finished()) launch_waiting();
}

// A move comes first: what has been submitted since is placed in the moved map.
void MapperService::launch_waiting() {
  if (!moves_.empty()) {
    Move move = std::move(moves_.front());
    moves_.pop_front();
    worker_.start(move.at + latency_, [this, correction = std::move(move.correction)] {
      planning::ObstacleUpdate obstacles = mapper_.move(correction);
      return MapperResult{std::nullopt, MovedMap{correction, std::move(obstacles)}};
    });
  } else if (next_) {
    launch(*std::exchange(next_, std::nullopt));
  }
}

void MapperService::move(MapCorrection correction, Utime now) {
  DIVE_DEMAND(is_well_formed(correction));
  moves_.push_back({std::move(correction), now});
  if (worker_.may_start()) launch_waiting();
}

// The nearer of two neighbours in time: there may be a gap between them.
std::optional<MapperService::Motion> MapperService::motion_at(Utime utime) const {
  if (past_.empty()) return std::nullopt;
  const auto around = past_.at(std::min(utime, past_.newest_utime()));
  if (!around) return std::nullopt;
  const Motion& nearest = around->share <= 0.5 ? *around->before : *around->after;
  if (std::abs(nearest.utime - utime) > kMaxTimeOffset) return std::nullopt;
  return nearest;
}

// With the alignments and moves that the mapper has made and the published pose does not contain
// yet.
PlanarTransform MapperService::map_from_odom() const {
  PlanarTransform correction = map_from_odom_;
  for (const auto& waiting : worker_.waiting()) {
    const auto& [scan, moved] = waiting.result;
    if (moved) correction = moved->correction.newest() * correction;
    if (scan && scan->correction) correction.translation += scan->correction->correction_W;
  }
  return correction;
}

void MapperService::submit(RangeScan scan, Utime now,
                           const std::optional<planning::ObstacleAhead>& ahead) {
  Submitted submitted{std::move(scan), now, ahead};
  if (moves_.empty() && worker_.may_start()) {
    launch(std::move(submitted));
  } else {
    next_ = std::move(submitted);
  }
}

void MapperService::launch(Submitted submitted) {
  worker_.collect();
  const std::optional<Motion> motion = motion_at(submitted.scan.utime);
  if (!motion) return;
  const planning::ScanPose pose{map_from_odom() * motion->X_OB, motion->v_W,
                                motion->position_sigma_m, motion->attitude_sigma, submitted.ahead};
  worker_.start(submitted.at + latency_,
                [this, scan = std::move(submitted.scan), pose, absent = absent_] {
                  *absent_on_worker_ = absent;
                  return MapperResult{mapper_.add(scan, pose), std::nullopt};
                });
}

MapperResult MapperService::poll(Utime now) { return worker_.poll(now).value_or(MapperResult{}); }

std::vector<Eigen::Vector3f> MapperService::points() {
  worker_.collect();
  return mapper_.points();
}

}  // namespace dive::mission
