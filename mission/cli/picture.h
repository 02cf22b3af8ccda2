#pragma once
// Collects the contents of the drawing of a plan or a dive.

#include <span>
#include <string>

#include "mission/check/check.h"
#include "mission/picture/svg.h"
#include "vehicle/simulator/simulator.h"

namespace dive::mission {

/// Map, goals and legs of a planned route.
[[nodiscard]] DivePicture picture_of_plan(const std::string& title, const planning::World& world,
                                          const planning::RobotHull& hull, double clearance_m,
                                          const std::vector<PlannedRouteLeg>& legs);

/// Called every tick of a dive; adds tracks and errors a few times per second, and collisions.
class PictureRecorder {
 public:
  explicit PictureRecorder(DivePicture& picture) : picture_(picture) {}

  void observe(const StepInputs& inputs, const StepOutputs& outputs,
               const vehicle::GroundTruth& truth, std::span<const Collision> collisions);

 private:
  DivePicture& picture_;
  Utime next_ = 0;
  int last_segment_ = 0;
  std::string leg_;
};

}  // namespace dive::mission
