// Rules about the space between goals: time, and the ascent.

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "mission/check/check_context.h"
#include "mission/states/atomic_state.h"

namespace dive::mission {
namespace {

// Upper bound of the speed over ground at any time, m/s.
double fastest(const Mission& mission) {
  double current = 0.0;
  for (const DeclaredCurrent::Sample& sample : mission.current.value.samples()) {
    current = std::max(current, sample.velocity_W.norm());
  }
  return mission.speed.value + current;
}

// Shortest time (s) to swim the goals from `p_W`, in straight lines at the mission's speed and with
// the current, with every corner cut by the capture radius. Empty without positions in W.
std::optional<double> shortest_time(const CheckContext& context, std::optional<Eigen::Vector3d> p_W,
                                    const std::vector<const Goal*>& goals) {
  double distance = 0.0;
  double dwell = 0.0;
  double cut = 0.0;  // largest possible distance from the last goal
  for (const Goal* goal : goals) {
    const std::optional<Eigen::Vector3d> goal_W = context.in_world(goal->position);
    if (!goal_W) return std::nullopt;
    const double radius = goal->capture_radius.value;
    if (p_W) distance += std::max(0.0, (*goal_W - *p_W).norm() - radius - cut);
    dwell += goal->dwell_s.value;
    cut = radius;
    p_W = goal_W;
  }
  return distance / fastest(context.mission) + dwell;
}

std::optional<Eigen::Vector3d> place_in_world(const CheckContext& context,
                                              const NamedPosition& place) {
  std::optional<Eigen::Vector3d> p_W = context.in_world(context.reachable.position(place));
  if (p_W && place.surfaced) p_W->z() = 0.0;
  return p_W;
}

// Possible positions when `arc` is followed from `state`: those where the state began or ended, and
// every goal between.
std::vector<std::pair<std::string, Eigen::Vector3d>> places_on_leaving(const CheckContext& context,
                                                                       int state,
                                                                       const Flow::Arc& arc) {
  std::vector<std::pair<std::string, Eigen::Vector3d>> places;
  const auto add = [&](const NamedPosition& place) {
    const auto p_W = place_in_world(context, place);
    if (p_W) places.emplace_back(context.reachable.name(place), *p_W);
  };
  for (const NamedPosition& place : context.reachable.at_done(state)) add(place);
  if (context.reachable.is_nominal(arc, state)) return places;
  for (const NamedPosition& place : context.reachable.at_begin(state)) add(place);
  for (const Goal* goal : goals_of(context.index.spec(state))) {
    const auto p_W = context.in_world(goal->position);
    if (p_W) places.emplace_back("'" + goal->id.value + "'", *p_W);
  }
  return places;
}

Span span_of(const CheckContext& context, const Flow::Arc& arc, int surface) {
  if (arc.spec == nullptr) return state_timeout(context.index.spec(arc.owner))->on_timeout.span;
  for (const Located<std::string>& target : arc.spec->targets) {
    if (target.value == context.index.spec(surface).id.value) return target.span;
  }
  return arc.spec->span;
}

bool contains(const std::vector<int>& states, int state) {
  return std::find(states.begin(), states.end(), state) != states.end();
}

// Reports the first position under an overhead from which `arc` leads to `surface`.
void check_ascent(CheckContext& context, const Flow::Arc& arc, int state, int surface) {
  for (const auto& [name, p_W] : places_on_leaving(context, state, arc)) {
    const int obstacle = context.overhead(p_W);
    if (obstacle < 0) continue;
    context.error(
        "CHK-SURFACE-OVERHEAD", span_of(context, arc, surface),
        fmt::format("'{}' may begin at {}, but '{}' is above that",
                    context.index.spec(surface).id.value, name, context.obstacle_name(obstacle)),
        "leave the overhead first");
    return;
  }
}

}  // namespace

void legs_fit_their_timeouts(CheckContext& context) {
  for (int state = 0; state < context.index.size(); ++state) {
    const StateSpec& spec = context.index.spec(state);
    const Timeout* timeout = state_timeout(spec);
    if (timeout == nullptr || !is_planning(spec)) continue;
    // From the nearest possible start; from the first goal if no start is known.
    std::optional<double> time;
    for (const NamedPosition& place : context.reachable.at_begin(state)) {
      const auto from_here = shortest_time(context, place_in_world(context, place), goals_of(spec));
      if (from_here) time = std::min(time.value_or(*from_here), *from_here);
    }
    if (!time) time = shortest_time(context, std::nullopt, goals_of(spec));
    if (!time || *time <= timeout->seconds.value) continue;
    context.error(
        "CHK-TIMEOUT", timeout->seconds.span,
        fmt::format("'{}' needs at least {:.0f} s in a straight line at {:g} m/s, more than "
                    "its timeout of {:g} s",
                    spec.id.value, *time, context.mission.speed.value, timeout->seconds.value));
  }
}

void surfacing_is_unobstructed(CheckContext& context) {
  for (int surface = 0; surface < context.index.size(); ++surface) {
    if (!is_surfacing(context.index.spec(surface))) continue;
    for (int state = 0; state < context.index.size(); ++state) {
      if (!context.flow.entered(state)) continue;
      for (const int a : context.flow.arcs_from(state)) {
        const Flow::Arc& arc = context.flow.arcs()[static_cast<std::size_t>(a)];
        if (contains(arc.lands, surface)) check_ascent(context, arc, state, surface);
      }
    }
  }
}

void states_obey_their_own_rules(CheckContext& context) {
  for (int state = 0; state < context.index.size(); ++state) {
    const StateSpec& spec = context.index.spec(state);
    if (spec.atomic) spec.atomic->check_in_map(context.mission, spec, context);
  }
}

}  // namespace dive::mission
