#pragma once
// The executive: a pure step from inputs to outputs. It reads no clock, no file, no socket and no
// random number, so that the same step runs in simulation, on the vehicle, in replay and in
// `dive check`, and a log of its inputs is enough to know all it did.
//
// One step: sensors into the estimator, crumbs onto the trail, failsafes and their rung, time-outs
// and guards into the statechart, the active leaf's behaviour into a command, the command through
// the autopilot into pseudo-rates.

#include <memory>
#include <optional>
#include <string>

#include "behaviors/trail.h"
#include "estimation/primitive.h"
#include "mission/document/mission.h"
#include "mission/executive/committed.h"
#include "mission/executive/io.h"
#include "planning/world/world.h"
#include "vehicle/autopilot.h"
#include "vehicle/model.h"

namespace dive::mission {

struct ExecutiveOptions {
  std::uint64_t seed = 1;  ///< Of the plans asked for.
  std::optional<Resume> resume = {};
  estimation::PrimitiveOptions estimator = {};
  double start_sigma_m = 0.05;  ///< Of the position at which the vehicle is put into the water.
  vehicle::AutopilotOptions autopilot = {};
};

enum class Outcome { kRunning, kSuccess, kAborted };

[[nodiscard]] const char* to_string(Outcome outcome);

struct ExecutiveResult {
  Outcome outcome = Outcome::kRunning;
  std::string final_state;  ///< Innermost active state while running.
  std::string cause;        ///< Of anything but a success.
};

class Executive {
 public:
  /// Keeps references: mission, world and model must outlive it. The mission has passed
  /// load_mission().
  Executive(const Mission& mission, const planning::World& world, const vehicle::Model& model,
            ExecutiveOptions options);
  Executive(Executive&&) noexcept;
  Executive& operator=(Executive&&) noexcept;
  ~Executive();

  /// Control tick at `inputs.now`, which never decreases. Never throws: a failed assertion of our
  /// own is caught, recorded as the failsafe internal_error, and from then on the vehicle is
  /// commanded straight up. What is returned is valid until the next step. A step in which nothing
  /// begins or ends (no plan asked for or answered, no transition, no change of rung) and nothing
  /// new is seen allocates nothing.
  [[nodiscard]] const StepOutputs& step(const StepInputs& inputs);

  [[nodiscard]] ExecutiveResult result() const;

  /// What must be kept before the outputs of the last step reach the vehicle, so that a restart
  /// finds the same state and repeats nothing.
  [[nodiscard]] Committed committed() const;
  [[nodiscard]] const behaviors::Trail& trail() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::mission
