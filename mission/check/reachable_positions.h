#pragma once
// Possible positions of the vehicle when a state begins, from the mission alone: the start, or a
// goal reached before.

#include <set>
#include <string>
#include <vector>

#include "mission/document/flow.h"
#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {

/// The start, or a goal; at the surface above it if the vehicle has surfaced since.
struct NamedPosition {
  int goal = -1;  ///< Index of the goal in the mission; -1: the start.
  bool surfaced = false;

  auto operator<=>(const NamedPosition&) const = default;
};

class ReachablePositions {
 public:
  /// Maximum per state; a state with more has none listed.
  static constexpr std::size_t kMaxPlaces = 32;

  /// Mission, index and flow must outlive this object.
  ReachablePositions(const Mission& mission, const StateIndex& index, const Flow& flow);

  /// Positions at entry of the atomic or final `state` in the nominal course, without failures.
  /// Empty if it is never entered in that course, or if there are too many.
  [[nodiscard]] std::vector<NamedPosition> at_begin(int state) const;
  /// Positions when the state is done.
  [[nodiscard]] std::vector<NamedPosition> at_done(int state) const;

  /// Position as written; `name` is for messages.
  [[nodiscard]] const Position& position(const NamedPosition& place) const;
  [[nodiscard]] std::string name(const NamedPosition& place) const;

  /// True if the arc is followed because `state` is done, or because of what its final state
  /// completes.
  [[nodiscard]] bool is_nominal(const Flow::Arc& arc, int state) const;

 private:
  [[nodiscard]] std::set<NamedPosition> after(int state) const;
  void spread();

  const Mission& mission_;
  const StateIndex& index_;
  const Flow& flow_;
  std::vector<const Goal*> goals_;
  std::vector<int> last_goal_;  ///< Last goal of each state; -1 where it has none.
  std::vector<std::set<NamedPosition>> at_begin_;  ///< Indexed by state.
};

}  // namespace dive::mission
