#pragma once
// What the machine's leaf states do: the behaviour of the one that is active, what it asks the
// planner, and how far it has come. Private to mission/executive.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "behaviors/behavior.h"
#include "behaviors/trail.h"
#include "mission/executive/changed_map.h"
#include "mission/executive/io.h"
#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/machine.h"
#include "mission/statechart/chart.h"

namespace dive::mission {

class Leaves {
 public:
  /// All of them must outlive it.
  Leaves(const Mission& mission, const Machine& machine, ChangedMap& map,
         const behaviors::Trail& trail, std::uint64_t seed);

  /// An atomic state is entered, but for its first `goals_done` goals; one that only watches does
  /// nothing.
  void enter(statechart::StateId state, int goals_done = 0);
  void leave(statechart::StateId state);

  /// The active state that has a behaviour; the document allows one at a time.
  [[nodiscard]] std::optional<statechart::StateId> active() const;
  /// As written; null where none is active and for the executive's own.
  [[nodiscard]] const StateSpec* active_spec() const;
  /// Demands that one is active.
  [[nodiscard]] behaviors::Behavior& behavior() const;

  /// Both wait for the next step.
  void take(const PlanReply& reply) { reply_ = reply; }
  void map_changed() { map_changed_ = true; }

  /// Steps the active behaviour (demanded): `input` but for what is known here, which is the plan,
  /// the trail and the map. What it asks the planner comes as `query`.
  [[nodiscard]] behaviors::BehaviorOutput step(behaviors::BehaviorInput input,
                                               std::optional<PlanQuery>& query);

  [[nodiscard]] const behaviors::Progress& progress() const { return progress_; }
  /// Why there is no way, where the behaviour could not know.
  void explain(std::string plan_failure) { progress_.plan_failure = std::move(plan_failure); }

  /// How many plans have been asked for. A new executive of an old dive counts on.
  [[nodiscard]] std::int64_t queries() const { return queries_; }
  void restore(std::int64_t queries) { queries_ = queries; }

 private:
  [[nodiscard]] std::unique_ptr<behaviors::Behavior> make(statechart::StateId state,
                                                          int goals_done) const;

  const Machine& machine_;
  ChangedMap& map_;
  const behaviors::Trail& trail_;
  LeafContext context_;
  std::vector<std::unique_ptr<behaviors::Behavior>> behaviors_;  ///< By StateId.
  behaviors::Progress progress_;                                 ///< Of the last step.
  bool map_changed_ = false;
  std::optional<PlanReply> reply_;
  std::int64_t queries_ = 0;
  std::int64_t asked_id_ = 0;
  statechart::StateId asked_by_ = -1;
};

}  // namespace dive::mission
