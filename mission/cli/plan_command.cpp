#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/xml.h"
#include "mission/check/check.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/picture.h"
#include "mission/cli/terminal.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

void print_plan(const std::string& name, const planning::PlanResult& plan) {
  if (plan.status != planning::PlanStatus::kSuccess) {
    print(fmt::format("{}: {}: {}", name, planning::to_string(plan.status), plan.reason));
    return;
  }
  print(fmt::format("{}: {:.1f} m, certified clearance {:.3f} m, {} waypoints, {} warm start(s)",
                    name, plan.length_m, plan.clearance_m, plan.waypoints.size(),
                    plan.warm_starts));
  const planning::StageTimes& times = plan.times;
  print(fmt::format("  {:.1f} ms: optimise {:.1f}, warm start {:.1f}, certify {:.1f}",
                    times.total_ms, times.optimise_ms, times.warm_start_ms, times.certify_ms));
}

int exit_status(const std::vector<PlannedRouteLeg>& legs) {
  int status = kExitSuccess;
  for (const PlannedRouteLeg& leg : legs) {
    if (leg.plan.status == planning::PlanStatus::kInvalid) return kExitUsage;
    if (leg.plan.status == planning::PlanStatus::kNoPath) status = kExitFailed;
  }
  return status;
}

int plan_mission(const PlanArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded = load(arguments.mission, diagnostics);
  if (!loaded) {
    print_diagnostics(diagnostics);
    return kExitUsage;
  }
  const planning::Scene scene(loaded->world);
  const std::vector<PlannedRouteLeg> legs =
      plan_route(nominal_route(loaded->mission, scene), loaded->world, loaded->model.hull,
                 planning::PlannerOptions{}, arguments.seed);
  if (arguments.json) {
    nlohmann::ordered_json plans = nlohmann::ordered_json::array();
    for (const PlannedRouteLeg& leg : legs) {
      nlohmann::ordered_json entry = {{"state", leg.state}, {"goal", leg.goal}};
      entry.update(to_json(leg.plan));
      plans.push_back(std::move(entry));
    }
    print_json({{"plans", std::move(plans)}});
  } else {
    for (const PlannedRouteLeg& leg : legs) print_plan(leg.goal, leg.plan);
  }
  if (!arguments.svg.empty()) {
    const DivePicture picture =
        picture_of_plan(loaded->mission.id + ": plan", loaded->world, loaded->model.hull,
                        loaded->mission.limits.clearance.value, legs);
    if (!write_file(arguments.svg, render_svg(picture))) return kExitUsage;
  }
  return exit_status(legs);
}

int plan_on_map(const PlanArguments& arguments) {
  const std::optional<WrittenPose> start = parse_pose("--start", arguments.start);
  const std::optional<WrittenPose> goal = parse_pose("--goal", arguments.goal);
  if (!start || !goal) return kExitUsage;
  Diagnostics diagnostics;
  const std::optional<planning::World> world = planning::load_sdf(arguments.map, diagnostics);
  print_diagnostics(diagnostics);
  if (!world) return kExitUsage;

  planning::PlanRequest request;
  request.start = start->pose;
  request.goal = goal->pose;
  const Eigen::Vector3d way = goal->pose.p - start->pose.p;
  const Eigen::Quaterniond along = from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()));
  if (!start->has_attitude) request.start.q = along;
  if (!goal->has_attitude) request.goal.q = along;
  request.goal_attitude_fixed = goal->has_attitude;
  request.attitude = attitude_mode(arguments.attitude);
  request.clearance = arguments.clearance_m;
  request.min_z = -arguments.max_depth_m;
  request.seed = arguments.seed;

  const vehicle::Model model = load_vehicle();
  SteadyClock clock;
  planning::Planner planner(*world, model.hull, planning::PlannerOptions{}, clock);
  const std::vector<PlannedRouteLeg> legs{{"", "goal", planner.plan(request)}};
  const planning::PlanResult& plan = legs.front().plan;
  if (arguments.json) {
    print_json(to_json(plan));
  } else {
    print_plan("goal", plan);
  }
  if (!arguments.svg.empty()) {
    const DivePicture picture =
        picture_of_plan(arguments.map, *world, model.hull, arguments.clearance_m, legs);
    if (!write_file(arguments.svg, render_svg(picture))) return kExitUsage;
  }
  return exit_status(legs);
}

}  // namespace

int run_plan(const PlanArguments& arguments) {
  const bool on_map = !arguments.map.empty();
  if (on_map == !arguments.mission.empty() ||
      (on_map && (arguments.start.empty() || arguments.goal.empty()))) {
    complain("plan needs either a mission or all of --map, --start and --goal");
    return kExitUsage;
  }
  return on_map ? plan_on_map(arguments) : plan_mission(arguments);
}

}  // namespace dive::mission
