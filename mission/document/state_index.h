#pragma once
// The states of a mission as a flat list in document order, with their parents and search
// functions.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "mission/document/mission.h"

namespace dive::mission {

class StateIndex {
 public:
  struct Entry {
    const StateSpec* spec = nullptr;
    int parent = -1;  ///< -1 at the top level.
    int last = -1;    ///< The last descendant; the state itself if it has none.
  };

  /// `mission` must outlive the index.
  explicit StateIndex(const Mission& mission);

  [[nodiscard]] int size() const { return static_cast<int>(entries_.size()); }
  [[nodiscard]] const StateSpec& spec(int state) const { return *at(state).spec; }
  [[nodiscard]] int parent(int state) const { return at(state).parent; }
  /// -1 if there is none; the first one if there are several.
  [[nodiscard]] int find(const std::string& id) const;
  /// True if `state` is `ancestor` or inside it.
  [[nodiscard]] bool is_within(int state, int ancestor) const {
    return state >= ancestor && state <= at(ancestor).last;
  }
  /// Child states in document order; the top-level states for -1.
  [[nodiscard]] std::vector<int> children(int state) const;
  /// The outermost parallel that is or contains `state`; -1 if there is none.
  [[nodiscard]] int outermost_parallel(int state) const;
  [[nodiscard]] std::vector<std::string> ids() const;

 private:
  [[nodiscard]] const Entry& at(int state) const {
    return entries_[static_cast<std::size_t>(state)];
  }
  void add(const StateSpec& spec, int parent);

  std::vector<Entry> entries_;
  std::map<std::string, int, std::less<>> by_id_;
};

[[nodiscard]] bool is_history(const StateSpec& spec);
/// True if the state has a behaviour that commands the vehicle.
[[nodiscard]] bool is_behavior(const StateSpec& spec);
/// True if the state plans paths.
[[nodiscard]] bool is_planning(const StateSpec& spec);
/// The events raised by the actions of all states.
[[nodiscard]] std::set<std::string> raised_events(const StateIndex& index);
/// Full names of all events that can be raised during the mission.
[[nodiscard]] std::set<std::string> possible_events(const StateIndex& index);
/// The actions on entry, on exit and in transitions.
[[nodiscard]] std::vector<const ActionSpec*> actions_of(const StateSpec& spec);
/// The timeout, or nullptr.
[[nodiscard]] const Timeout* state_timeout(const StateSpec& spec);
/// Span of the state's id in the mission file; span of the mission's `initial` if no state has this
/// id.
[[nodiscard]] Span span_of_state(const Mission& mission, const std::string& id);
/// The goals of a state in the order in which they are visited; empty for a state without.
[[nodiscard]] std::vector<const Goal*> goals_of(const StateSpec& spec);

}  // namespace dive::mission
