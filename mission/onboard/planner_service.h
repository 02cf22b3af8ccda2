#pragma once
// The planner off the control thread. A query is answered a stated time after it was asked, never
// when the machine happens to be ready, so that a simulated dive is the same on every machine.

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
  /// `latency`: from query to answer, in dive time, at least.
  PlannerService(const planning::World& world, const planning::RobotHull& hull,
                 planning::PlannerOptions options, Utime latency, OnLate late = OnLate::kBlock);

  /// Plans that are started from now on avoid the obstacles of this snapshot, too.
  void set_map(const planning::ObservedMap& map) { map_ = map; }

  /// Starts planning, or with OnLate::kPoll begins when the worker is free. A query that is still
  /// open is dropped: its answer is never given.
  void submit(PlanQuery query, Utime now);

  /// The answer once its time has come.
  [[nodiscard]] std::optional<PlanReply> poll(Utime now);

 private:
  void launch(PlanQuery query, Utime now);
  void renew_planner(const planning::PlanRequest& request, const planning::ObservedMap& map);
  [[nodiscard]] PlanReply answer(const PlanQuery& query, const planning::ObservedMap& map);

  SteadyClock clock_;
  planning::RobotHull hull_;
  planning::PlannerOptions options_;
  // Used by the worker only.
  planning::World world_;  ///< The known map, then the observed obstacles planned with.
  std::size_t known_ = 0;  ///< Number of obstacles of the known map in world_.
  std::unique_ptr<planning::Planner> planner_;
  std::int64_t revision_ = 0;         ///< Revision of the observed map in world_ ...
  Eigen::AlignedBox3d added_within_;  ///< ... and the region of it that was added.

  planning::ObservedMap map_;
  Utime latency_;
  std::optional<PlanQuery> next_;  ///< For when the worker is free.
  DelayedWorker<PlanReply> worker_;
};

}  // namespace dive::mission
