#pragma once
// The planner off the control thread. A query is answered a stated time after it was asked, never
// when the machine happens to be ready, so that a simulated dive is the same on every machine.

#include <future>
#include <memory>
#include <optional>
#include <span>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "planning/planner.h"

namespace dive::mission {

class PlannerService {
 public:
  /// `latency`: from query to answer, in dive time.
  PlannerService(const planning::World& world, const planning::RobotHull& hull,
                 planning::PlannerOptions options, Utime latency);

  /// Plans from now on with these in the way as well.
  void add(std::span<const SeenObstacle> seen);

  /// Starts planning. A query that is still open is dropped: its answer is never given.
  void submit(PlanQuery query, Utime now);

  /// The answer once its time has come; waits for the worker if it is late.
  [[nodiscard]] std::optional<PlanReply> poll(Utime now);

  [[nodiscard]] double planning_ms() const {
    return planning_ms_;
  }  ///< Of this machine, all plans.

 private:
  SteadyClock clock_;
  planning::World world_;
  planning::RobotHull hull_;
  planning::PlannerOptions options_;
  std::size_t seen_ = 0;
  std::unique_ptr<planning::Planner> planner_;
  Utime latency_;
  std::int64_t id_ = 0;
  Utime due_ = 0;
  std::future<planning::PlanResult> result_;
  double planning_ms_ = 0.0;
};

}  // namespace dive::mission
