#pragma once
// The behaviour of the active atomic state, from entry to exit: its requests to the planner, its
// progress, and in unknown environments its speed limit by the free distance ahead. Private to
// mission/executive.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/trail.h"
#include "behaviors/view_speed_limit.h"
#include "mission/executive/behavior_factory.h"
#include "mission/executive/io.h"
#include "mission/executive/machine.h"
#include "mission/executive/map_view.h"
#include "mission/executive/situation.h"
#include "mission/statechart/chart.h"

namespace dive::mission {

class ActiveBehavior {
 public:
  /// All of them must outlive this object.
  ActiveBehavior(const Mission& mission, const Machine& machine, MapView& map,
                 const behaviors::Trail& trail, std::uint64_t seed);

  /// Enters an atomic state without its first `goals_done` goals. A state that only monitors has no
  /// behaviour.
  void enter(statechart::StateId state, int goals_done = 0);
  void leave(statechart::StateId state);

  /// The active state that has a behaviour; a document allows one at a time.
  [[nodiscard]] std::optional<statechart::StateId> state() const;
  /// True while a state of the mission, and not one of the executive's own, has the behaviour.
  [[nodiscard]] bool is_missions() const;
  /// Overhead that the active state declares above its goals; empty if it has no goals.
  [[nodiscard]] std::optional<bool> declared_overhead() const;
  /// Requires an active behaviour.
  [[nodiscard]] behaviors::Behavior& behavior() const;

  // Inputs of the next step.
  void take(const PlanReply& reply) { reply_ = reply; }
  void take_map_change() { map_changed_ = true; }
  /// Time of a mapped scan, and the free distance (m) ahead of the hull in it.
  void take_free_ahead(Utime scan_utime, double free_ahead_m) {
    view_.add_scan(scan_utime, free_ahead_m);
  }
  void advance_view(Utime now, const Eigen::Vector3d& p_W) { view_.advance(now, p_W); }

  /// Steps the behaviour (which must exist) and limits its command by the free distance ahead.
  /// `replan`: a failsafe requests a new plan. A request to the planner is returned in `query`.
  [[nodiscard]] behaviors::BehaviorOutput step(const Situation& situation, bool replan,
                                               std::optional<PlanQuery>& query);

  [[nodiscard]] const behaviors::Progress& progress() const { return progress_; }

  /// Number of plans requested so far. It continues after a restart.
  [[nodiscard]] std::int64_t queries() const { return queries_; }
  void restore(std::int64_t queries) { queries_ = queries; }

 private:
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make(statechart::StateId state,
                                                          int goals_done) const;
  void limit_by_view(const Situation& situation, behaviors::BehaviorOutput& output);

  const Machine& machine_;
  MapView& map_;
  const behaviors::Trail& trail_;
  BehaviorContext context_;
  bool is_in_unknown_;
  behaviors::ViewSpeedLimit view_;
  std::vector<std::optional<bool>> declared_overheads_;          ///< Indexed by StateId.
  std::vector<std::unique_ptr<behaviors::Behavior>> behaviors_;  ///< Indexed by StateId.
  behaviors::Progress progress_;                                 ///< Progress at the last step.
  bool map_changed_ = false;
  std::optional<PlanReply> reply_;
  std::int64_t queries_ = 0;
  std::int64_t asked_id_ = 0;
  statechart::StateId asked_by_ = -1;
};

}  // namespace dive::mission
