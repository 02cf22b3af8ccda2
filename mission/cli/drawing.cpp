#include "mission/cli/drawing.h"

#include <fmt/format.h>

namespace dive::mission {

DiveDrawing drawing_of_plan(const std::string& title, const planning::World& world,
                            const planning::RobotHull& hull, double clearance_m,
                            const std::vector<PlannedRouteLeg>& legs) {
  DiveDrawing drawing;
  drawing.title = title;
  drawing.world = &world;
  drawing.hull = &hull;
  drawing.clearance_required_m = clearance_m;
  for (const PlannedRouteLeg& leg : legs) {
    drawing.legs.push_back({leg.goal, leg.plan.waypoints, leg.plan.clearance_m,
                            leg.plan.reduced ? leg.plan.reduced->length_m : 0.0});
    if (!leg.plan.waypoints.empty()) {
      if (drawing.goals.empty()) {
        drawing.goals.emplace_back("start", leg.plan.waypoints.front().p);
      }
      drawing.goals.emplace_back(leg.goal, leg.plan.waypoints.back().p);
    }
  }
  return drawing;
}

void DrawingRecorder::observe(const StepInputs& inputs, const StepOutputs& outputs,
                              const vehicle::GroundTruth& truth,
                              std::span<const Collision> collisions) {
  drawing_.collisions.insert(drawing_.collisions.end(), collisions.begin(), collisions.end());
  const Status& status = outputs.status;
  const bool new_waypoint =
      status.segment > 0 && (status.segment != last_segment_ || status.goal != goal_);
  last_segment_ = status.segment;
  goal_ = status.goal;
  if (truth.utime < next_ && !new_waypoint) return;
  next_ = truth.utime + kMicrosecondsPerSecond / 5;
  drawing_.swum.push_back(truth.X_WB.p);
  if (outputs.estimate.valid) drawing_.estimated.push_back(outputs.estimate.X_WB.p);
  if (status.segment > 0) {
    drawing_.errors.push_back({to_seconds(inputs.now), status.cross_track_m, new_waypoint});
  }
}

}  // namespace dive::mission
