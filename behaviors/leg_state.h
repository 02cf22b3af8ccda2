#pragma once
// The states of a leg, its events and all transitions between them. Data that only one state needs
// are members of that state. README.md has the diagram.

#include <variant>

#include "common/assert.h"
#include "common/clock.h"
#include "vehicle/command.h"

namespace dive::behaviors::leg {

/// Holds its place until the planner has found a path, and after a failure until the next plan.
struct Planning {
  vehicle::Command station;
  bool is_to_observe = false;  ///< True if the requested plan leads to a place to observe the goal.
  bool brakes = false;         ///< True if the vehicle was under way.
};
/// Follows a path to the goal while the next one is planned.
struct Following {
  double certified_m = 0.0;  ///< Clearance of the path by the planner, m.
};
/// Follows a path to a place from which it can observe a goal that it cannot reach.
struct Approaching {
  double certified_m = 0.0;  ///< Clearance of the path by the planner, m.
};
/// Backs off along its trail, to plan from there.
struct BackingOff {};
/// Stays at the goal.
struct Dwelling {
  vehicle::Command station;
  Utime since = 0;
};

using State = std::variant<Planning, Following, Approaching, BackingOff, Dwelling>;

struct PathToGoal {
  double certified_m;
};
struct PathToObserve {
  double certified_m;
};
/// The path is cut off, an obstacle is in the way, or it has ended beside the goal or at the place
/// to observe it from.
struct PathEnded {
  vehicle::Command station;
};
struct GoalReached {
  vehicle::Command station;
  Utime now;
};
/// Too near to an obstacle, no clearance to turn onto the path, or an alternative is requested; and
/// there is a path back.
struct BackOffBegun {};
struct BackOffEnded {
  vehicle::Command station;
};

using Event =
    std::variant<PathToGoal, PathToObserve, PathEnded, GoalReached, BackOffBegun, BackOffEnded>;

struct Transitions {
  using S = State;
  // clang-format off
  // NOLINTBEGIN(performance-unnecessary-value-param): a table of small values
  //           in             on                  goes to
  S operator()(Planning,    PathToGoal e)    { return Following{e.certified_m}; }
  S operator()(Planning,    PathToObserve e) { return Approaching{e.certified_m}; }
  S operator()(Planning,    BackOffBegun)    { return BackingOff{}; }
  S operator()(Following,   PathToGoal e)    { return Following{e.certified_m}; }
  S operator()(Following,   PathEnded e)     { return Planning{e.station, false, true}; }
  S operator()(Following,   BackOffBegun)    { return BackingOff{}; }
  S operator()(Following,   GoalReached e)   { return Dwelling{e.station, e.now}; }
  S operator()(Approaching, PathToGoal e)    { return Following{e.certified_m}; }
  S operator()(Approaching, PathEnded e)     { return Planning{e.station, false, true}; }
  S operator()(Approaching, BackOffBegun)    { return BackingOff{}; }
  S operator()(BackingOff,  BackOffEnded e)  { return Planning{e.station}; }
  // clang-format on
  template <class OtherState, class OtherEvent>
  S operator()(OtherState, OtherEvent) {
    assertion_failed("this event belongs to this state of a leg", __FILE__, __LINE__);
  }
  // NOLINTEND(performance-unnecessary-value-param)
};

[[nodiscard]] inline State transition(const State& state, const Event& event) {
  return std::visit(Transitions(), state, event);
}

}  // namespace dive::behaviors::leg
