#pragma once
// Where the vehicle may be when a state begins, as far as the mission alone tells: at the start, or
// at a goal that was reached before.

#include <set>
#include <string>
#include <vector>

#include "mission/document/flow.h"
#include "mission/document/mission.h"
#include "mission/document/state_index.h"

namespace dive::mission {

/// The start, or a goal; at the surface above it when the vehicle has surfaced since.
struct Place {
  int goal = -1;  ///< Counted through the mission; -1: the start.
  bool surfaced = false;

  auto operator<=>(const Place&) const = default;
};

class Whereabouts {
 public:
  static constexpr std::size_t kMaxPlaces = 32;  ///< Per state; of more it tells none.

  /// Mission, index and flow must outlive it.
  Whereabouts(const Mission& mission, const StateIndex& index, const Flow& flow);

  /// When the leaf or final `state` begins, in the nominal course: everything is done, nothing
  /// fails. Empty when it is never entered so, or when there are too many.
  [[nodiscard]] std::vector<Place> at_begin(int state) const;
  /// When it is done.
  [[nodiscard]] std::vector<Place> at_done(int state) const;

  /// As written; `name` for people.
  [[nodiscard]] const Position& position(const Place& place) const;
  [[nodiscard]] std::string name(const Place& place) const;

  /// Is the arc followed because `state` is done, or what its final completes?
  [[nodiscard]] bool is_nominal(const Flow::Arc& arc, int state) const;

 private:
  [[nodiscard]] std::set<Place> after(int state) const;
  void spread();

  const Mission& mission_;
  const StateIndex& index_;
  const Flow& flow_;
  std::vector<const Goal*> goals_;
  std::vector<int> last_goal_;             ///< By state: of its own goals; -1 where it has none.
  std::vector<std::set<Place>> at_begin_;  ///< By state.
};

}  // namespace dive::mission
