#include "mission/executive/mapper_service.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "common/priority.h"

namespace dive::mission {
namespace {

constexpr std::size_t kCorrections = 64;
constexpr std::size_t kTrack = 256;  // estimates, five seconds: an older sweep has no place
constexpr Utime kNotThen = 100'000;  // us off every estimate: a sweep of another time

}  // namespace

MapperService::MapperService(const planning::RobotHull& hull,
                             const planning::MapperOptions& options, Utime latency, Late late)
    : mapper_(hull, options, clock_), latency_(latency), late_(late) {}

MapperService::~MapperService() {
  if (working_.valid()) working_.wait();
}

void MapperService::observe(const estimation::StateEstimate& estimate) {
  if (!estimate.valid) return;
  if (track_.size() == kTrack) track_.pop_front();
  track_.push_back({estimate.utime, estimate.X_WB, estimate.X_WB.q * estimate.v_WB_B});
}

std::optional<MapperService::Where> MapperService::where_at(Utime utime) const {
  std::optional<Where> nearest;
  for (const Where& where : track_) {
    if (!nearest || std::abs(where.utime - utime) < std::abs(nearest->utime - utime)) {
      nearest = where;
    }
  }
  if (nearest && std::abs(nearest->utime - utime) > kNotThen) nearest.reset();
  return nearest;
}

void MapperService::submit(RangeScan scan, Utime now) {
  if (late_ == Late::kNotYet && is_busy(working_)) {
    next_.emplace(std::move(scan), now);
  } else {
    launch(std::move(scan), now);
  }
}

void MapperService::launch(RangeScan scan, Utime now) {
  collect();
  std::optional<Where> where = where_at(scan.utime);
  if (!where) return;
  for (const Correction& correction : corrections_) {
    if (correction.told >= where->utime) where->X_WB.p.head<2>() += correction.off_W;
  }
  working_ = std::async(std::launch::async,
                        [this, scan = std::move(scan), where = *where, due = now + latency_] {
                          run_as_others();  // a map may come late, a command may not
                          return Answer{due, mapper_.add(scan, where.X_WB, where.v_W)};
                        });
}

// Waits for the worker, if there is one.
void MapperService::collect() {
  if (!working_.valid()) return;
  answers_.push_back(working_.get());
  if (!answers_.back().update) return;
  if (corrections_.size() == kCorrections) corrections_.pop_front();
  corrections_.push_back({answers_.back().update->off_W});
}

std::optional<planning::MapUpdate> MapperService::poll(Utime now) {
  if (late_ == Late::kWait || !is_busy(working_)) collect();
  if (next_ && !is_busy(working_)) {
    auto [scan, asked] = *std::exchange(next_, std::nullopt);
    launch(std::move(scan), asked);
  }
  if (answers_.empty() || now < answers_.front().due) return std::nullopt;
  std::optional<planning::MapUpdate> update = std::move(answers_.front().update);
  answers_.pop_front();
  if (update) {
    const auto untold = std::find_if(
        corrections_.begin(), corrections_.end(),
        [](const Correction& c) { return c.told == std::numeric_limits<Utime>::max(); });
    if (untold != corrections_.end()) untold->told = now;
  }
  return update;
}

std::vector<Eigen::Vector3f> MapperService::points() {
  collect();
  return mapper_.points();
}

}  // namespace dive::mission
