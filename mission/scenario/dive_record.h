#pragma once
// The record of a dive, by which it is evaluated.

#include <set>
#include <string>
#include <vector>

#include "mission/scenario/scenario.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

/// An occurrence at one instant of a dive.
struct Occurrence {
  enum class Kind {
    kEntered,  ///< Entry of a state, inner or outer.
    kEvent,    ///< Event that caused a transition, or that a failsafe raised.
    kRung,
    kReplan,  ///< Replan of a path being followed; the name is the reason.
    kPayload,
    kLine,     ///< Log line of the mission, or a note of the executive.
    kHeading,  ///< Departure for a goal.
    kStep,     ///< Step of the script; the name is its id.
  } kind = Kind::kEntered;
  double t_s = 0.0;
  std::string name;
  std::string cause = {};  ///< Cause of a rung.
  int step = -1;           ///< Index of a kStep.
};

struct DiveRecord {
  std::vector<Occurrence> occurrences;  ///< In order of time.
  /// Smallest distance to the position of each expectation, by ground truth.
  std::vector<double> nearest_m;
  double max_depth_m = 0.0;                         ///< By ground truth.
  Eigen::Vector3d end_W = Eigen::Vector3d::Zero();  ///< By ground truth.
  DiveResult result;
};

/// Fills a record, except for the steps and the result. Keeps references to both.
class DiveWatch {
 public:
  DiveWatch(const Scenario& scenario, DiveRecord& record);

  /// Called every tick, before observe().
  void keep(const Executive& executive, const StepOutputs& outputs);
  void observe(const StepInputs& inputs, const StepOutputs& outputs,
               const vehicle::GroundTruth& truth);

 private:
  void add(Occurrence::Kind kind, std::string name, std::string cause = {});
  void note_states(const StepOutputs& outputs);
  void note_events(const StepOutputs& outputs);
  void note_actions(const StepOutputs& outputs);
  void note_places(const vehicle::GroundTruth& truth);

  const Scenario& scenario_;
  DiveRecord& record_;
  double now_s_ = 0.0;
  std::vector<std::string> active_;
  std::vector<std::string> active_before_;
  std::set<std::string> new_;  ///< Active states entered in this tick.
  std::string goal_;
};

/// kDisabled: the steps of the script occur without effect, and there is no diver. An expectation
/// that still holds does not test the script.
enum class Script { kPlayed, kDisabled };

/// Simulates the scenario, which matches the mission, in the world `simulated` or else in that of
/// the map, `world`. `observer` may be empty.
[[nodiscard]] DiveRecord dive_scenario(const Scenario& scenario, const Mission& mission,
                                       const planning::World& world,
                                       const std::optional<planning::World>& simulated,
                                       const vehicle::Model& model, Script script,
                                       const DiveObserver& observer);

}  // namespace dive::mission
