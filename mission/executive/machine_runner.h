#pragma once
// Runs a mission's machine: takes events, reports entered and exited states and the mission's
// actions. Keeps the data of states outside the chart: entry times, timeouts, and the actions
// already executed once. Private to mission/executive.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mission/executive/checkpoint.h"
#include "mission/executive/io.h"
#include "mission/executive/machine.h"
#include "mission/statechart/interpreter.h"

namespace dive::mission {

struct Event {
  std::string name;
  std::string cause;  ///< Cause, for messages.
};

class MachineRunner final : private statechart::Environment {
 public:
  /// Receives the changes of active states; called while the machine runs.
  class Observer {
   public:
    virtual ~Observer() = default;
    virtual void on_entered_atomic(statechart::StateId state) = 0;
    virtual void on_exited(statechart::StateId state) = 0;
  };

  /// All of them must outlive the runner, which appends to transitions and actions of `outputs`.
  MachineRunner(const Machine& machine, Observer& observer, StepOutputs& outputs);

  /// Sets the behaviours' clock for the following calls, and the values of guards at that time.
  void set_time(Utime mission_now) { mission_now_ = mission_now; }
  void set_variables(const GuardVariables& variables) { variables_ = variables; }

  void start() { interpreter_.start(); }
  /// Processes one event and runs to completion. An event that was considered without a transition
  /// is recorded.
  void dispatch(const Event& event);
  /// The first state whose timeout has passed and was not reported yet.
  [[nodiscard]] std::optional<Event> next_timeout();
  /// Takes eventless transitions and runs to completion.
  void settle();

  [[nodiscard]] bool is_running() const { return interpreter_.running(); }
  /// Innermost active state; the final state once the machine has ended.
  [[nodiscard]] const std::string& innermost() const;
  /// Time since the innermost active state was entered, s.
  [[nodiscard]] double state_elapsed_s() const;

  /// Cause of a mission that is not a success; empty otherwise. The last cause counts, except that
  /// a timeout does not replace another.
  [[nodiscard]] const std::string& abort_cause() const { return abort_cause_; }
  void set_abort_cause(std::string cause) { abort_cause_ = std::move(cause); }
  [[nodiscard]] bool has_aborted() const {
    return !abort_cause_.empty() || final_state_ == kAbortedState;
  }

  void save(Checkpoint& checkpoint) const;
  /// Continues where another runner ended: enters no state, executes no action. `observer` is
  /// called for the active atomic states.
  void restore(const Checkpoint& checkpoint);

 private:
  [[nodiscard]] bool evaluate(statechart::GuardId guard) override;
  void execute(statechart::ActionId id) override;
  void entered(statechart::StateId state) override;
  void exited(statechart::StateId state) override { observer_.on_exited(state); }
  void taken(int transition, const std::string& event) override;
  void refuse_to_surface_under_an_overhead(statechart::StateId state);
  [[nodiscard]] std::string describe_guards() const;

  const Machine& machine_;
  Observer& observer_;
  StepOutputs& outputs_;
  statechart::Interpreter interpreter_;
  GuardVariables variables_;
  Utime mission_now_ = 0;
  std::vector<Utime> entered_at_;       ///< Indexed by StateId, us.
  std::vector<char> timeout_reported_;  ///< Indexed by StateId.
  std::vector<char> done_once_;         ///< Indexed by ActionId.
  /// Guards evaluated since the last transition.
  std::vector<std::pair<statechart::GuardId, bool>> evaluated_;
  std::string event_cause_;
  std::string abort_cause_;
  std::string final_state_;
};

}  // namespace dive::mission
