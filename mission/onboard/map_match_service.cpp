#include "mission/onboard/map_match_service.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimation/planar.h"
#include "mission/onboard/scan_placement.h"

namespace dive::mission {
namespace {

constexpr Utime kTracked = 3'000'000;  // us after a fix in which the prior is one of fixes
constexpr int kContradictions = 3;
constexpr int kPlaces = 3;  // of a scan that contradict the map
// Sigmas by which a position that scans contradict may be wrong: m, m and rad.
const Eigen::Vector3d kLost(1.0, 1.0, 0.05);

}  // namespace

MapMatchService::MapMatchService(std::shared_ptr<const planning::MapSurface> known,
                                 std::shared_ptr<const planning::ObjectCells> objects,
                                 const RangeNoise& noise, Utime latency, OnLate late)
    : known_(std::move(known)),
      objects_(std::move(objects)),
      matcher_(known_, noise),
      latency_(latency),
      worker_(late) {
  if (objects_) absence_.emplace(objects_);
}

void MapMatchService::observe(const estimation::StateEstimate& estimate) {
  if (!can_place_scans(estimate)) return;
  const Eigen::Vector3d up_B = estimate.X_WB.q.conjugate() * Eigen::Vector3d::UnitZ();
  planning::PosePrior prior;
  prior.X_WB = estimate.X_WB;
  prior.heading_correction = estimate.map_from_odom.yaw;
  prior.odometry_O = estimation::odometry_pose(estimate).p.head<2>();
  prior.height_sigma_m = std::sqrt(std::max(estimate.covariance(2, 2), 0.0));
  prior.covariance = estimation::horizontal_covariance(estimate.covariance, up_B);
  past_.push(estimate.utime, prior);
}

// Between two ticks the vehicle moves by millimetres, but turns.
std::optional<planning::PosePrior> MapMatchService::prior_at(Utime utime) const {
  if (past_.empty() || utime > past_.newest_utime() + kMaxTimeOffset) return std::nullopt;
  const auto around = past_.at(std::min(utime, past_.newest_utime()));
  if (!around) return std::nullopt;
  planning::PosePrior prior = *around->before;
  prior.X_WB = interpolate(around->before->X_WB, around->after->X_WB, around->share);
  return prior;
}

std::optional<MapFix> MapMatchService::poll(Utime now) {
  const std::optional<Result> result = worker_.poll(now);
  if (!result) return std::nullopt;
  const MapFix& fix = result->fix;
  const MapAgreement& seen = fix.agreement;
  const bool contradicts = seen.missing + seen.unmapped >= kPlaces && seen.contradicts();
  contradictions_ = contradicts ? contradictions_ + 1 : 0;
  if (fix.problem == MapFixProblem::kNone) fixed_ = fix.scan_utime;
  if (absence_) absences_ = absence_->add(fix.scan_utime, result->from_W, result->sightings);
  return fix;
}

// On the worker.
MapMatchService::Result MapMatchService::match(const RangeScan& scan,
                                               const planning::PosePrior& prior) {
  const planning::MatchedScan placed = matcher_.place(scan, prior, search_);
  Result result{placed.fix, placed.X_WB * scan.origin_B.cast<double>(), {}};
  if (objects_ && placed.may_show_absence()) {
    result.sightings =
        planning::observe_objects(*known_, *objects_, scan, placed.X_WB, placed.sigma_m);
  }
  return result;
}

void MapMatchService::submit(const RangeScan& scan, Utime now) {
  if (last_ && scan.utime < *last_ + kPeriod) return;
  if (!worker_.may_start()) return;
  std::optional<planning::PosePrior> prior = prior_at(scan.utime);
  if (!prior) return;
  last_ = scan.utime;
  if (contradictions_ >= kContradictions) {
    prior->covariance.diagonal() += kLost.cwiseAbs2();
  } else {
    prior->is_tracked = fixed_ && scan.utime - *fixed_ <= kTracked;
  }
  if (check_.check(scan) != planning::ScanProblem::kNone) {
    MapFix none;
    none.scan_utime = scan.utime;
    none.problem = MapFixProblem::kNoScan;
    return worker_.start(now + latency_, [none] { return Result{none, {}, {}}; });
  }
  worker_.start(now + latency_, [this, scan, prior = *prior] { return match(scan, prior); });
}

}  // namespace dive::mission
