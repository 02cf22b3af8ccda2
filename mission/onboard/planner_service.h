#pragma once
// The planner on a worker thread. The answer to a query is delivered a stated time after the query,
// not when the machine is ready, so that a simulated dive is the same on every machine.

#include <cstdint>
#include <memory>
#include <optional>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "mission/onboard/delayed_worker.h"
#include "planning/planner.h"
#include "planning/world/observed_map.h"

namespace dive::mission {

class PlannerService {
 public:
  /// `latency`: least time from query to answer, in dive time, us.
  PlannerService(const planning::World& world, const planning::RobotHull& hull,
                 const planning::PlannerOptions& options, Utime latency,
                 OnLate late = OnLate::kBlock);

  /// Sets the obstacles, besides the known map, for plans that start from now on.
  void set_map(const planning::ObservedMap& map) { map_ = map; }

  /// Submits a query. With OnLate::kPoll it waits for the worker. An earlier query without an
  /// answer is dropped.
  void submit(PlanQuery query, Utime now);

  /// The answer once it is due.
  [[nodiscard]] std::optional<PlanReply> poll(Utime now);

 private:
  void launch(PlanQuery query, Utime now);
  void renew_planner(const planning::PlanRequest& request, const planning::ObservedMap& map);
  [[nodiscard]] PlanReply answer(const PlanQuery& query, const planning::ObservedMap& map);

  SteadyClock clock_;
  planning::RobotHull hull_;
  planning::PlannerOptions options_;
  // Used by the worker only.
  planning::World known_;  ///< The known map.
  planning::World world_;  ///< What is there of it, then the observed obstacles planned with.
  std::unique_ptr<planning::Planner> planner_;
  std::int64_t revision_ = 0;         ///< Revision of the observed map in world_.
  Eigen::AlignedBox3d added_within_;  ///< Region of the observed map in world_.

  planning::ObservedMap map_;
  Utime latency_;
  std::optional<PlanQuery> next_;  ///< Query that waits for the worker.
  DelayedWorker<PlanReply> worker_;
};

}  // namespace dive::mission
