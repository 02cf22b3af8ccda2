#pragma once
// The planner off the control thread. A query is answered a stated time after it was asked, never
// when the machine happens to be ready, so that a simulated dive is the same on every machine.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "mission/onboard/delayed_worker.h"
#include "planning/planner.h"
#include "planning/world/seen.h"

namespace dive::mission {

class PlannerService {
 public:
  /// `latency`: from query to answer, in dive time, at least.
  PlannerService(const planning::World& world, const planning::RobotHull& hull,
                 planning::PlannerOptions options, Utime latency, Late late = Late::kWait);

  /// Plans that are submitted from now on have these in the way as well.
  void add(std::span<const SeenObstacle> seen);
  /// The same of unknown water. An update that is not well-formed or not newer than the last
  /// changes nothing.
  void apply(const planning::MapUpdate& update);

  /// Starts planning, or with Late::kNotYet begins when the worker is free. A query that is still
  /// open is dropped: its answer is never given.
  void submit(PlanQuery query, Utime now);

  /// The answer once its time has come.
  [[nodiscard]] std::optional<PlanReply> poll(Utime now);

 private:
  void launch(PlanQuery query, Utime now);
  void take_updates();
  void renew_planner(const planning::PlanRequest& request);
  [[nodiscard]] PlanReply answer(const PlanQuery& query);

  SteadyClock clock_;
  planning::World world_;  ///< The worker's: what was known, what has appeared, what was seen.
  planning::RobotHull hull_;
  planning::PlannerOptions options_;
  std::size_t seen_ = 0;
  std::vector<planning::Obstacle> added_;     ///< Not in world_ yet.
  std::vector<planning::MapUpdate> updates_;  ///< Not in seen_map_ yet: the worker is at it.
  planning::SeenMap seen_map_;                ///< The worker's while it is busy.
  bool is_renewed_ = true;                    ///< planner_ knows all of seen_map_ ...
  Eigen::AlignedBox3d renewed_within_;        ///< ... that lies in here.
  std::size_t known_ = 0;  ///< Obstacles of world_ that were not seen by a mapper; they come first.
  std::unique_ptr<planning::Planner> planner_;
  Utime latency_;
  std::optional<PlanQuery> next_;  ///< For when the worker is free.
  DelayedWorker<PlanReply> worker_;
};

}  // namespace dive::mission
