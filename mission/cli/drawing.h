#pragma once
// Collects the contents of the drawing of a plan or a dive.

#include <span>
#include <string>

#include "mission/check/check.h"
#include "mission/drawing/svg.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// Map, goals and legs of a planned route.
[[nodiscard]] DiveDrawing drawing_of_plan(const std::string& title, const planning::World& world,
                                          const planning::RobotHull& hull, double clearance_m,
                                          const std::vector<PlannedRouteLeg>& legs);

/// Called every tick of a dive; adds tracks and errors a few times per second, and collisions.
class DrawingRecorder {
 public:
  explicit DrawingRecorder(DiveDrawing& drawing) : drawing_(drawing) {}

  void observe(const StepInputs& inputs, const StepOutputs& outputs,
               const vehicle::GroundTruth& truth, std::span<const Collision> collisions);

 private:
  DiveDrawing& drawing_;
  Utime next_ = 0;
  int last_segment_ = 0;
  std::string goal_;
};

}  // namespace dive::mission
