#include "mission/cli/picture.h"

#include <fmt/format.h>

namespace dive::mission {

DivePicture picture_of_plan(const std::string& title, const planning::World& world,
                            const planning::RobotHull& hull, double clearance_m,
                            const std::vector<PlannedRouteLeg>& legs) {
  DivePicture picture;
  picture.title = title;
  picture.world = &world;
  picture.hull = &hull;
  picture.clearance_required_m = clearance_m;
  for (const PlannedRouteLeg& leg : legs) {
    picture.legs.push_back({leg.goal, leg.plan.waypoints, leg.plan.clearance_m,
                            leg.plan.reduced ? leg.plan.reduced->length_m : 0.0});
    if (!leg.plan.waypoints.empty()) {
      if (picture.goals.empty()) {
        picture.goals.emplace_back("start", leg.plan.waypoints.front().p);
      }
      picture.goals.emplace_back(leg.goal, leg.plan.waypoints.back().p);
    }
  }
  return picture;
}

void PictureRecorder::observe(const StepInputs& inputs, const StepOutputs& outputs,
                              const vehicle::GroundTruth& truth,
                              std::span<const Collision> collisions) {
  picture_.collisions.insert(picture_.collisions.end(), collisions.begin(), collisions.end());
  const Status& status = outputs.status;
  const bool new_waypoint =
      status.segment > 0 && (status.segment != last_segment_ || status.leg != leg_);
  last_segment_ = status.segment;
  leg_ = status.leg;
  if (truth.utime < next_ && !new_waypoint) return;
  next_ = truth.utime + kMicrosecondsPerSecond / 5;
  picture_.swum.push_back(truth.X_WB.p);
  if (outputs.estimate.valid) picture_.estimated.push_back(outputs.estimate.X_WB.p);
  if (status.segment > 0) {
    picture_.errors.push_back({to_seconds(inputs.now), status.cross_track_m, new_waypoint});
  }
}

}  // namespace dive::mission
