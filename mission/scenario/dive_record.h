#pragma once
// What is kept of a dive to judge it by.

#include <set>
#include <string>
#include <vector>

#include "mission/check/simulated_dive.h"
#include "mission/scenario/scenario.h"

namespace dive::mission {

/// Something that happened at a moment of a dive.
struct Occurrence {
  enum class Kind {
    kEntered,  ///< A state, inner or outer.
    kEvent,    ///< A transition was taken on it, or a failsafe raised it.
    kRung,
    kReplan,  ///< Of a path being followed; the name is why.
    kPayload,
    kLine,     ///< Of the mission's, or a note of the executive's.
    kHeading,  ///< For a goal.
    kStep,     ///< Of the script; the name is its id.
  } kind = Kind::kEntered;
  double t_s = 0.0;
  std::string name;
  std::string cause = {};  ///< Of a rung.
  int step = -1;           ///< Of kStep: which.
};

struct DiveRecord {
  std::vector<Occurrence> occurrences;  ///< In order of time.
  std::vector<double> nearest_m;        ///< To the place of each expectation, by ground truth.
  double max_depth_m = 0.0;             ///< By ground truth.
  Eigen::Vector3d end_W = Eigen::Vector3d::Zero();  ///< By ground truth.
  DiveResult result;
};

/// Fills in a record, but for the steps and the result. Keeps references to both.
class DiveWatch {
 public:
  DiveWatch(const Scenario& scenario, DiveRecord& record);

  /// Every tick, before observe().
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
  std::set<std::string> new_;  ///< Of them, entered in this tick.
  std::string leg_;
};

/// kMuted: the steps of the script happen, but do nothing. What a scenario expects should then not
/// be so, or it expects nothing of its script.
enum class Script { kPlayed, kMuted };

/// Dives the scenario, which suits the mission. `observer` may be empty.
[[nodiscard]] DiveRecord dive_scenario(const Scenario& scenario, const Mission& mission,
                                       const planning::World& world, const vehicle::Model& model,
                                       Script script, const DiveObserver& observer);

}  // namespace dive::mission
