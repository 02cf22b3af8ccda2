#pragma once
// The executive: a pure step from inputs to outputs. It reads no clock, no file, no socket and no
// random number, so that the same step runs in simulation, on the vehicle, in replay and in `dive
// check`, and a log of its inputs determines all its outputs.
//
// One step is a sequence of stages (executive.cpp; drawn in mission/README.md): samples, the
// position, the situation, failsafes, events to the machine, the active behaviour's command, and
// the efforts of the flippers.

#include <memory>
#include <optional>
#include <string>

#include "behaviors/trail.h"
#include "mission/document/mission.h"
#include "mission/executive/checkpoint.h"
#include "mission/executive/io.h"
#include "planning/world/world.h"
#include "vehicle/exit_path.h"
#include "vehicle/model.h"

namespace dive::mission {

struct ExecutiveOptions {
  std::uint64_t seed = 1;  ///< Seed of the requested plans.
  std::optional<Resume> resume = {};
};

enum class Outcome { kRunning, kSuccess, kAborted };

[[nodiscard]] const char* to_string(Outcome outcome);

struct ExecutiveResult {
  Outcome outcome = Outcome::kRunning;
  std::string final_state;  ///< Innermost active state while running.
  std::string cause;        ///< Cause of any outcome except success.
};

class Executive {
 public:
  /// Keeps references: mission, world and model must outlive the executive. The mission has passed
  /// load_mission(). Estimator and autopilot have the model's coefficients of motion.
  Executive(const Mission& mission, const planning::World& world, const vehicle::Model& model,
            ExecutiveOptions options);
  Executive(Executive&&) noexcept;
  Executive& operator=(Executive&&) noexcept;
  ~Executive();

  /// One control tick at `inputs.now`, which never decreases. Never throws: a failed internal
  /// assertion is caught and recorded as the failsafe internal_error, and from then on the vehicle
  /// is brought home by the rules of vehicle::ExitGuidance. After more than 0.2 s without a tick
  /// the vehicle is expected to have stopped. The result is valid until the next step. A step
  /// without changes (no plan requested or answered, no transition, no change of rung, no new
  /// observation) allocates nothing.
  [[nodiscard]] const StepOutputs& step(const StepInputs& inputs);

  [[nodiscard]] ExecutiveResult result() const;

  /// The state to save before the outputs of the last step reach the vehicle, so that a restart
  /// finds the same state and repeats no action.
  [[nodiscard]] Checkpoint checkpoint() const;
  /// What the visual-inertial estimator has found of its IMU, for checkpoint(). It changes no
  /// output.
  void keep_imu_bias(const estimation::ImuBias& bias);
  [[nodiscard]] const behaviors::Trail& trail() const;
  /// How to leave the present place without the executive, after every step.
  [[nodiscard]] const vehicle::ExitPath& exit_path() const;
  /// The poses that the active behaviour means to take within `seconds`, from the last estimate on;
  /// empty if it does not follow a path.
  [[nodiscard]] std::vector<Pose> way_ahead(double seconds) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::mission
