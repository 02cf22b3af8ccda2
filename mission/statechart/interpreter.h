#pragma once
// The SCXML algorithm (W3C Recommendation, appendix D), procedure by procedure: selection by
// document order with preemption of conflicting transitions, exit and entry sets by the transition
// domain (least common compound ancestor), run to completion, done.state.ID events, history.

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mission/statechart/chart.h"

namespace dive::statechart {

/// What a chart does to the world, given by whoever runs it.
class Environment {
 public:
  virtual ~Environment() = default;
  [[nodiscard]] virtual bool evaluate(GuardId guard) = 0;
  virtual void execute(ActionId action) = 0;
  /// After on_entry actions of the state.
  virtual void entered(StateId state) = 0;
  /// Before on_exit actions of the state.
  virtual void exited(StateId state) = 0;
  /// A transition was selected in a microstep, told before any state is exited. `event` is empty
  /// for eventless ones.
  virtual void taken(int transition, const std::string& event) = 0;
};

class Interpreter {
 public:
  /// `chart` must outlive the interpreter and be valid (demanded).
  Interpreter(const Chart& chart, Environment& environment);

  /// Enters the initial configuration and runs to completion.
  void start();
  /// One external event, run to completion. Ignored once not running.
  void dispatch(const std::string& event);
  /// Queues an internal event from within execute(), entered() or exited() (<raise>).
  void raise(std::string event);
  /// Eventless transitions whose guards may have become true since, run to completion.
  void settle();

  [[nodiscard]] bool running() const { return running_; }
  /// Active states in document order, the root excluded.
  [[nodiscard]] std::vector<StateId> configuration() const;
  [[nodiscard]] bool is_active(StateId state) const {
    return active_[static_cast<std::size_t>(state)];
  }
  /// Event descriptor matching (SCXML 3.12.1): token-wise prefix, "*" matches all.
  [[nodiscard]] static bool matches(const std::string& descriptor, const std::string& event);

  /// A macrostep that takes more microsteps than this is a loop in the chart: running stops and
  /// livelocked() says so.
  static constexpr int kMaxMicrosteps = 1000;
  [[nodiscard]] bool livelocked() const { return livelocked_; }

 private:
  const Chart& chart_;
  Environment& environment_;
  std::vector<bool> active_;
  std::vector<std::vector<StateId>> history_;
  std::deque<std::string> internal_queue_;
  bool running_ = false;
  bool livelocked_ = false;
};

}  // namespace dive::statechart
