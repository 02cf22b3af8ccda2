#pragma once
// The states of a mission as a flat list in document order, with parents and a way to find them.

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
    int parent = -1;  ///< -1 at the top.
    int last = -1;    ///< The last state inside, itself when there is none.
  };

  /// `mission` must outlive the index.
  explicit StateIndex(const Mission& mission);

  [[nodiscard]] int size() const { return static_cast<int>(entries_.size()); }
  [[nodiscard]] const StateSpec& spec(int state) const { return *at(state).spec; }
  [[nodiscard]] int parent(int state) const { return at(state).parent; }
  /// -1 when there is none; the first one when there are several.
  [[nodiscard]] int find(const std::string& id) const;
  /// Is `state` inside `ancestor`, or it?
  [[nodiscard]] bool is_within(int state, int ancestor) const {
    return state >= ancestor && state <= at(ancestor).last;
  }
  /// States directly inside, in document order; -1 for those at the top.
  [[nodiscard]] std::vector<int> children(int state) const;
  /// The outermost parallel that `state` is in or is; -1 when there is none.
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
/// Has it a behaviour that commands the vehicle?
[[nodiscard]] bool is_behavior(const StateSpec& spec);
/// Does it plan paths?
[[nodiscard]] bool is_planning(const StateSpec& spec);
/// The events that its actions, and those of all others, raise.
[[nodiscard]] std::set<std::string> raised_events(const StateIndex& index);
/// Every event that something may raise while the mission lasts, spelt out.
[[nodiscard]] std::set<std::string> possible_events(const StateIndex& index);
/// Its actions on entry, on exit and in transitions.
[[nodiscard]] std::vector<const ActionSpec*> actions_of(const StateSpec& spec);
/// Its timeout, or nullptr.
[[nodiscard]] const Timeout* state_timeout(const StateSpec& spec);
/// The goals of a goto or goal_sequence, else nothing.
[[nodiscard]] std::vector<const Goal*> goals_of(const StateSpec& spec);

}  // namespace dive::mission
