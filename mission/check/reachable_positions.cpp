#include "mission/check/reachable_positions.h"

#include <algorithm>

#include "mission/states/atomic_state.h"

namespace dive::mission {

ReachablePositions::ReachablePositions(const Mission& mission, const StateIndex& index,
                                       const Flow& flow)
    : mission_(mission),
      index_(index),
      flow_(flow),
      at_begin_(static_cast<std::size_t>(index.size())) {
  for (int state = 0; state < index.size(); ++state) {
    const std::vector<const Goal*> goals = goals_of(index.spec(state));
    goals_.insert(goals_.end(), goals.begin(), goals.end());
    last_goal_.push_back(goals.empty() ? -1 : static_cast<int>(goals_.size()) - 1);
  }
  for (const int state : flow.first())
    at_begin_[static_cast<std::size_t>(state)].insert(NamedPosition{});
  spread();
}

const Position& ReachablePositions::position(const NamedPosition& place) const {
  return place.goal < 0 ? mission_.start : goals_[static_cast<std::size_t>(place.goal)]->position;
}

std::string ReachablePositions::name(const NamedPosition& place) const {
  if (place.goal < 0) return "the start";
  return "'" + goals_[static_cast<std::size_t>(place.goal)]->id.value + "'";
}

bool ReachablePositions::is_nominal(const Flow::Arc& arc, int state) const {
  const bool is_final = index_.spec(state).type == StateType::kFinal;
  const int done = is_final ? index_.parent(state) : state;
  return std::any_of(arc.triggers.begin(), arc.triggers.end(),
                     [done](const Flow::Trigger& trigger) {
                       return trigger.kind == Flow::Trigger::Kind::kDone && trigger.state == done;
                     });
}

// Terminates: the sets of positions only grow, and each state has at most kMaxPlaces + 1.
void ReachablePositions::spread() {
  std::vector<int> pending(flow_.first());
  while (!pending.empty()) {
    const int state = pending.back();
    pending.pop_back();
    const std::set<NamedPosition> places = after(state);
    for (const int a : flow_.arcs_from(state)) {
      const Flow::Arc& arc = flow_.arcs()[static_cast<std::size_t>(a)];
      if (!is_nominal(arc, state)) continue;
      for (const int to : arc.lands) {
        std::set<NamedPosition>& known = at_begin_[static_cast<std::size_t>(to)];
        const std::size_t before = known.size();
        for (const NamedPosition& place : places) {
          if (known.size() <= kMaxPlaces) known.insert(place);
        }
        if (known.size() != before) pending.push_back(to);
      }
    }
  }
}

std::set<NamedPosition> ReachablePositions::after(int state) const {
  const int last_goal = last_goal_[static_cast<std::size_t>(state)];
  if (last_goal >= 0) return {NamedPosition{last_goal, false}};
  if (is_retracing(index_.spec(state))) return {};  // in open water
  const std::set<NamedPosition>& places = at_begin_[static_cast<std::size_t>(state)];
  if (!is_surfacing(index_.spec(state))) return places;
  std::set<NamedPosition> surfaced;
  for (const NamedPosition& place : places) surfaced.insert(NamedPosition{place.goal, true});
  return surfaced;
}

std::vector<NamedPosition> ReachablePositions::at_begin(int state) const {
  const std::set<NamedPosition>& places = at_begin_[static_cast<std::size_t>(state)];
  if (places.size() > kMaxPlaces) return {};
  return {places.begin(), places.end()};
}

std::vector<NamedPosition> ReachablePositions::at_done(int state) const {
  const std::set<NamedPosition> places = after(state);
  if (places.size() > kMaxPlaces) return {};
  return {places.begin(), places.end()};
}

}  // namespace dive::mission
