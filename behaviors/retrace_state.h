#pragma once
// The states of a retrace, the events that it tells apart, and all transitions between them: what
// each state needs stands in that state and nowhere else. README.md draws the same picture.
//
// Whatever the state: without attitude the vehicle holds its place. With open water above it stops
// and is done, in Stopping, Levelling and Arrived.

#include <optional>
#include <variant>

#include <Eigen/Geometry>

#include "common/assert.h"
#include "common/clock.h"

namespace dive::behaviors::retrace {

/// Why a path is not followed any further.
enum class Loss {
  kBlocked,       ///< Something is on it; in an unknown environment that may go away.
  kUnobservable,  ///< It leads where the sensor cannot observe free space.
  kNoProgress,    ///< It takes too long.
};

/// Stops as it is.
struct Stopping {
  std::optional<Eigen::Quaterniond> q_WB;  ///< Attitude that it had first below an overhead.
};
/// Comes level, before it turns back.
struct Levelling {
  Utime since = 0;
};
/// Follows the trail.
struct FollowingTrail {
  double allowed_s = 0.0;  ///< Time after which it makes no progress, s.
};
/// Follows a planned path around what blocks the trail.
struct FollowingDetour {
  double allowed_s = 0.0;  ///< Time after which it makes no progress, s.
};
/// At the end of the trail, or of a detour.
struct Arrived {};
/// Holds its place with the bow along the trail: the map drops what the sensor no longer observes.
struct ObservingTrail {
  Utime since = 0;
};
/// Holds its place until the planner has found a detour, with less and less clearance.
struct PlanningDetour {
  Loss cause = Loss::kBlocked;
};
/// The trail leads to no open water.
struct NoWayOut {};

using State = std::variant<Stopping, Levelling, FollowingTrail, FollowingDetour, Arrived,
                           ObservingTrail, PlanningDetour, NoWayOut>;

struct Stopped {
  Utime now;
};
/// It is level, at the end of a path, or has observed the trail: what is left of the trail is
/// found.
struct TrailFound {
  double allowed_s;
};
struct TrailEndless {};
struct EndReached {};
struct PathLost {
  Loss cause;
};
/// The path is blocked, or no detour was found: what blocks the trail may go away.
struct ObservationBegun {
  Utime now;
};
struct DetourFound {
  double allowed_s;
};

using Event = std::variant<Stopped, TrailFound, TrailEndless, EndReached, PathLost,
                           ObservationBegun, DetourFound>;

struct Transitions {
  using S = State;
  // clang-format off
  //           in                on                    goes to
  S operator()(Stopping,        Stopped e)          { return Levelling{e.now}; }
  S operator()(Levelling,       TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(Levelling,       TrailEndless)       { return NoWayOut{}; }
  S operator()(FollowingTrail,  EndReached)         { return Arrived{}; }
  S operator()(FollowingTrail,  ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingTrail,  PathLost e)         { return PlanningDetour{e.cause}; }
  S operator()(Arrived,         TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(Arrived,         TrailEndless)       { return NoWayOut{}; }
  S operator()(ObservingTrail,  TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(ObservingTrail,  TrailEndless)       { return NoWayOut{}; }
  S operator()(PlanningDetour,  DetourFound e)      { return FollowingDetour{e.allowed_s}; }
  S operator()(PlanningDetour,  ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingDetour, EndReached)         { return Arrived{}; }
  S operator()(FollowingDetour, ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingDetour, PathLost e)         { return PlanningDetour{e.cause}; }
  // clang-format on
  template <class OtherState, class OtherEvent>
  S operator()(OtherState, OtherEvent) {
    assertion_failed("this event belongs to this state of a retrace", __FILE__, __LINE__);
  }
};

[[nodiscard]] inline State transition(const State& state, const Event& event) {
  return std::visit(Transitions(), state, event);
}

}  // namespace dive::behaviors::retrace
