#pragma once
// A second implementation of the recommendation's appendix D, transcribed as literally as C++
// allows: ordered sets as lists, recursion, sorting by document order, nothing precomputed. Slow on
// purpose; it shares no code with the interpreter that it verifies.

#include <list>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "mission/statechart/chart.h"
#include "mission/statechart/interpreter.h"  // for Environment only

namespace dive::statechart::testing {

class ReferenceInterpreter {
 public:
  ReferenceInterpreter(const Chart& chart, Environment& environment, int max_microsteps)
      : doc_(chart), environment_(environment), max_microsteps_(max_microsteps) {}

  void interpret();
  void external_event(const std::string& event);
  void enqueue(const std::string& event) { internal_queue_.push_back(event); }

  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] bool livelocked() const { return livelocked_; }
  [[nodiscard]] std::vector<int> configuration() const {
    return {configuration_.begin(), configuration_.end()};
  }

 private:
  using Set = std::vector<int>;  // The recommendation's OrderedSet.

  const State& state(int s) const { return doc_.states.at(static_cast<std::size_t>(s)); }
  const Transition& transition(int t) const {
    return doc_.transitions.at(static_cast<std::size_t>(t));
  }
  bool is_history(int s) const;
  bool is_compound_or_scxml(int s) const;
  bool is_parallel(int s) const;
  Set get_child_states(int s) const;
  bool is_descendant(int s1, int s2) const;
  Set get_proper_ancestors(int s1, int s2) const;
  static void add(Set& set, int element);
  static bool name_match(const std::string& descriptor, const std::string& event);

  void run_to_completion();
  Set select_transitions(const std::string* event);
  Set remove_conflicting(const Set& enabled);
  void microstep(const Set& enabled, const std::string& event);
  std::set<int> compute_exit_set(const Set& transitions);
  void exit_states(const Set& enabled);
  void enter_states(const Set& enabled);
  bool is_in_final_state(int s) const;
  void add_descendants(int s);
  void add_ancestors(int s, int ancestor);
  void add_missing_regions(int s);
  Set get_effective_target_states(int t) const;
  int get_transition_domain(int t) const;
  int find_lcca(const Set& list) const;

  const Chart& doc_;
  Environment& environment_;
  int max_microsteps_;
  bool running_ = false;
  bool livelocked_ = false;
  std::set<int> configuration_;
  std::map<int, Set> history_value_;
  std::list<std::string> internal_queue_;
  std::map<int, int> domain_;  // Domain of each enabled transition.
  std::set<int> states_to_enter_;
  std::set<int> states_for_default_entry_;
  std::map<int, int> default_history_content_;
};

}  // namespace dive::statechart::testing
