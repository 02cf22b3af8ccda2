#pragma once
// Plays the script of a scenario: every step once, when its trigger has come and its time is up.

#include <deque>
#include <optional>
#include <vector>

#include "common/random.h"
#include "mission/scenario/dive_record.h"
#include "mission/scenario/scenario.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

/// Keeps references to both: it triggers on what is in the record, and writes its steps there.
class ScriptPlayer {
 public:
  ScriptPlayer(const Scenario& scenario, DiveRecord& record, Script script);

  /// Every tick before the step.
  void play(const DiveHands& hands);

 private:
  struct Loss {
    LossAction action;
    double until_s = 0.0;
  };
  struct Heartbeat {
    HeartbeatAction action;
    double next_s = 0.0;
    double until_s = 0.0;
  };
  void arm();
  [[nodiscard]] static bool triggers(const Occurrence& occurrence, const Trigger& trigger);
  void act(const ScriptAction& action, const DiveHands& hands);
  void lose(StepInputs& inputs);
  void speak(StepInputs& inputs);

  const Scenario& scenario_;
  DiveRecord& record_;
  bool is_disabled_;
  Random random_;
  std::vector<std::optional<double>>
      due_s_;                  ///< Time at which each step is due, s; empty before its trigger.
  std::vector<bool> done_;     ///< True for steps that were executed.
  std::size_t processed_ = 0;  ///< Number of occurrences tested by the triggers.
  std::vector<Loss> losses_;
  std::vector<Heartbeat> heartbeats_;
  std::deque<OperatorCommand> to_send_;  ///< Commands of topside, sent one per tick.
  double now_s_ = 0.0;
};

}  // namespace dive::mission
