#include "mission/check/simulated_dive.h"

#include <cmath>

#include <fmt/format.h>

#include "mission/executive/leaf_behaviors.h"
#include "mission/executive/planner_service.h"
#include "planning/world/scene.h"
#include "vehicle/simulator/ground_truth.h"

namespace dive::mission {
namespace {

constexpr double kGraceSeconds = 120.0;  // for an abort that starts when the time is up

Pose start_pose(const Mission& mission, const planning::World& world) {
  const planning::Scene scene(world);
  return Pose{mission.start.in_world(ground_height(scene, mission.start)),
              from_rpy(0.0, 0.0, heading_to_yaw(mission.start_heading_deg))};
}

void finish(DiveResult& result, const ExecutiveResult& executive, const StepOutputs& last,
            const vehicle::GroundTruth& truth, const vehicle::ClearanceMeter& meter) {
  result.outcome = to_string(executive.outcome);
  result.final_state = executive.final_state;
  result.cause = executive.cause;
  result.duration_s = to_seconds(truth.utime);
  result.distance_m = truth.distance_swum_m;
  result.energy_wh = truth.energy_used_wh;
  result.final_depth_m = -truth.X_WB.p.z();
  result.min_clearance_m = meter.min_clearance_m();
  result.collisions = meter.collisions();
  result.estimate_error_m = (last.estimate.X_WB.p - truth.X_WB.p).norm();
  result.estimate_sigma_m = std::sqrt(last.estimate.covariance.topLeftCorner<3, 3>().trace());
  if (executive.outcome == Outcome::kRunning) {
    result.outcome = "failure";
    result.cause =
        fmt::format("still in state {} after {:.0f} s", executive.final_state, result.duration_s);
  }
  if (result.collisions > 0) {
    result.outcome = "failure";
    result.cause = fmt::format("{} collision(s) with the map", result.collisions);
  }
}

}  // namespace

std::string DiveSettings::validate() const {
  if (planner_latency_ticks < 1) return "planner_latency_ticks must be at least 1";
  if (std::string problem = conditions.validate(); !problem.empty()) return problem;
  return planner.validate();
}

DiveResult simulate_dive(const Mission& mission, const planning::World& world,
                         const vehicle::Model& model, const DiveSettings& settings,
                         const DiveObserver& observer) {
  const Utime tick = from_seconds(vehicle::Simulator::kTick);
  vehicle::Simulator simulator(model, start_pose(mission, world), settings.conditions,
                               settings.seed);
  vehicle::ClearanceMeter meter(world, model.hull);
  PlannerService planner(world, model.hull, settings.planner,
                         settings.planner_latency_ticks * tick);
  Executive executive(mission, world, model, ExecutiveOptions{.seed = settings.seed});

  DiveResult result;
  StepOutputs outputs;
  const double longest = 1.5 * mission.limits.mission_timeout.value + kGraceSeconds;
  bool leaking = false;
  while (to_seconds(simulator.truth().utime) < longest &&
         executive.result().outcome == Outcome::kRunning) {
    if (!leaking && settings.leak_at_s >= 0.0 &&
        to_seconds(simulator.truth().utime) >= settings.leak_at_s) {
      simulator.inject_leak();
      leaking = true;
    }
    const vehicle::SensorSamples samples = simulator.step(outputs.rates);
    const vehicle::GroundTruth& truth = simulator.truth();
    meter.observe(truth.X_WB);
    StepInputs inputs{truth.utime, samples.imu, samples.depth, samples.health,
                      planner.poll(truth.utime)};
    outputs = executive.step(inputs);
    if (outputs.plan_query) {
      ++result.plans;
      if (!outputs.plan_query->request.previous.empty()) ++result.replans;
      planner.submit(*outputs.plan_query, truth.utime);
    }
    for (const TransitionRecord& record : outputs.transitions) {
      result.transitions.push_back({to_seconds(truth.utime), record});
    }
    if (observer) observer(inputs, outputs, truth);
  }
  finish(result, executive.result(), outputs, simulator.truth(), meter);
  return result;
}

}  // namespace dive::mission
