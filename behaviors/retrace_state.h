#pragma once
// The states of a retrace, its events and all transitions between them. Data that only one state
// needs are members of that state. README.md has the diagram.
//
// In every state: without attitude the vehicle holds station. In Stopping, Levelling and Arrived
// it is done once it has stopped with open water above.

#include <optional>
#include <variant>

#include <Eigen/Geometry>

#include "common/assert.h"
#include "common/clock.h"

namespace dive::behaviors::retrace {

/// Reason why a path is abandoned.
enum class Loss {
  kBlocked,       ///< An obstacle is on it; in an unknown environment it may move.
  kUnobservable,  ///< It leads where the sensor cannot observe free space.
  kNoProgress,    ///< It takes too long.
};

/// Stops in its present attitude.
struct Stopping {
  std::optional<Eigen::Quaterniond> q_WB;  ///< First attitude below an overhead.
};
/// Comes level before it turns back.
struct Levelling {
  Utime since = 0;
};
/// Follows the trail.
struct FollowingTrail {
  double allowed_s = 0.0;  ///< Time after which it makes no progress, s.
};
/// Follows a planned path around the obstacle on the trail.
struct FollowingDetour {
  double allowed_s = 0.0;  ///< Time after which it makes no progress, s.
};
/// Follows the trail whatever the map shows on it: by the map the vehicle is inside an obstacle,
/// and there is no detour. Only what a scan shows in its way stops it.
struct TrustingTrail {
  double allowed_s = 0.0;  ///< Time after which it makes no progress, s.
};
/// At the end of the trail, or of a detour.
struct Arrived {};
/// Holds its place with the bow along the trail: the map drops an obstacle that is no longer there.
struct ObservingTrail {
  Utime since = 0;
};
/// Holds its place until the planner has found a detour; each request has less clearance.
struct PlanningDetour {
  Loss cause = Loss::kBlocked;
};
/// End: the trail leads to no open water.
struct NoWayOut {};

using State = std::variant<Stopping, Levelling, FollowingTrail, FollowingDetour, TrustingTrail,
                           Arrived, ObservingTrail, PlanningDetour, NoWayOut>;

struct Stopped {
  Utime now;
};
/// The rest of the trail was found, after it came level, reached the end of a path, observed the
/// trail, or a loop closure moved it.
struct TrailFound {
  double allowed_s;
};
struct TrailEndless {};
struct EndReached {};
struct PathLost {
  Loss cause;
};
/// The path is blocked, or there is no detour, and the obstacle may move.
struct ObservationBegun {
  Utime now;
};
struct DetourFound {
  double allowed_s;
};

/// No detour, even with the least clearance, from inside an obstacle.
struct NoDetour {
  double allowed_s;
};

using Event = std::variant<Stopped, TrailFound, TrailEndless, EndReached, PathLost,
                           ObservationBegun, DetourFound, NoDetour>;

struct Transitions {
  using S = State;
  // clang-format off
  // NOLINTBEGIN(performance-unnecessary-value-param): a table of small values
  //           in                on                    goes to
  S operator()(Stopping,        Stopped e)          { return Levelling{e.now}; }
  S operator()(Levelling,       TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(Levelling,       TrailEndless)       { return NoWayOut{}; }
  S operator()(FollowingTrail,  TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(FollowingTrail,  TrailEndless)       { return NoWayOut{}; }
  S operator()(FollowingTrail,  EndReached)         { return Arrived{}; }
  S operator()(FollowingTrail,  ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingTrail,  PathLost e)         { return PlanningDetour{e.cause}; }
  S operator()(Arrived,         TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(Arrived,         TrailEndless)       { return NoWayOut{}; }
  S operator()(ObservingTrail,  TrailFound e)       { return FollowingTrail{e.allowed_s}; }
  S operator()(ObservingTrail,  TrailEndless)       { return NoWayOut{}; }
  S operator()(PlanningDetour,  DetourFound e)      { return FollowingDetour{e.allowed_s}; }
  S operator()(PlanningDetour,  ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(PlanningDetour,  NoDetour e)         { return TrustingTrail{e.allowed_s}; }
  S operator()(PlanningDetour,  TrailEndless)       { return NoWayOut{}; }
  S operator()(TrustingTrail,   EndReached)         { return Arrived{}; }
  S operator()(TrustingTrail,   ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingDetour, EndReached)         { return Arrived{}; }
  S operator()(FollowingDetour, ObservationBegun e) { return ObservingTrail{e.now}; }
  S operator()(FollowingDetour, PathLost e)         { return PlanningDetour{e.cause}; }
  // clang-format on
  template <class OtherState, class OtherEvent>
  S operator()(OtherState, OtherEvent) {
    assertion_failed("this event belongs to this state of a retrace", __FILE__, __LINE__);
  }
  // NOLINTEND(performance-unnecessary-value-param)
};

[[nodiscard]] inline State transition(const State& state, const Event& event) {
  return std::visit(Transitions(), state, event);
}

}  // namespace dive::behaviors::retrace
