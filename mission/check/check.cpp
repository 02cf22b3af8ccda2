#include "mission/check/check.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "behaviors/surface.h"
#include "behaviors/trail.h"
#include "mission/check/rules.h"
#include "mission/document/state_index.h"
#include "mission/executive/leaf_behaviors.h"
#include "planning/world/scene.h"
#include "vehicle/aqua2_figures.h"
#include "vehicle/autopilot.h"

namespace dive::mission {
namespace {

using Progress = std::function<void(const std::string&)>;

constexpr std::array kDeckRules = {
    Rule{"CHK-PLAN", Severity::kError, "Every leg of the nominal route has a certified path."},
    Rule{"CHK-NO-WAY-OUT", Severity::kError,
         "From every point of the route the trail leads back to open water."},
    Rule{"CHK-RETRACE", Severity::kError, "The route can be swum backwards without touching."},
    Rule{"CHK-TIME", Severity::kError, "The route takes no longer than mission_timeout."},
    Rule{"CHK-TIME-MARGIN", Severity::kWarning,
         "The route and the longest way out together take no longer than mission_timeout."},
    Rule{"CHK-ENERGY", Severity::kError, "The route leaves battery_reserve in the battery."},
    Rule{"CHK-DIVE", Severity::kError, "The simulated dive ends as planned."},
    Rule{"CHK-FAULT", Severity::kError,
         "Whatever fails in whatever state, the dive ends surfaced or held, without a collision."},
};

Span map_span(const Mission& mission) { return mission.map_file.span; }

void report_failed_plans(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const planning::PlanResult& plan = legs[i].plan;
    if (plan.status == planning::PlanStatus::kSuccess) continue;
    diagnostics.error("CHK-PLAN", mission.source, route.legs[i].span,
                      fmt::format("no path to goal '{}' ({}): {}", legs[i].goal,
                                  planning::to_string(plan.status), plan.reason),
                      "move the goal, or lower the clearance in limits");
  }
}

// The whole route, each leg level and heading the other way, as a retrace would swim it.
std::vector<Pose> reversed(const std::vector<PlannedRouteLeg>& legs) {
  std::vector<Pose> poses;
  for (auto leg = legs.rbegin(); leg != legs.rend(); ++leg) {
    for (auto pose = leg->plan.waypoints.rbegin(); pose != leg->plan.waypoints.rend(); ++pose) {
      if (!poses.empty() && (poses.back().p - pose->p).norm() < 1e-9) continue;
      poses.push_back(*pose);
    }
  }
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const Eigen::Vector3d way = poses[i + 1].p - poses[i].p;
    poses[i].q = from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()));
  }
  if (poses.size() > 1) poses.back().q = poses[poses.size() - 2].q;
  return poses;
}

WayOutProof prove_way_out(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                          const Mission& mission, const planning::World& world,
                          const planning::RobotHull& hull, const CheckOptions& options) {
  const double radius = hull.radius();
  behaviors::Trail trail;
  WayOutProof proof;
  const auto look = [&](const Eigen::Vector3d& p_W, const std::string& state) {
    trail.add(p_W, !world.overhead(p_W, radius));
    const behaviors::Trail::WayOut way = trail.way_out(p_W, 0.0);
    if (!way.reaches_open_water) proof.exists = false;
    const double up_s = -way.points.back().z() / behaviors::SurfaceOptions{}.ascent_rate;
    const double seconds = way.length_m / mission.speed.value + up_s;
    if (seconds > proof.longest_s) {
      proof.longest_s = seconds;
      proof.longest_m = way.length_m;
      proof.state = state;
    }
  };
  look(route.start.p, "start");
  for (const PlannedRouteLeg& leg : legs) {
    const std::vector<Pose>& waypoints = leg.plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      constexpr int kPieces = 4;  // per segment: crumbs about as dense as the vehicle drops them
      for (int k = 1; k <= kPieces; ++k) {
        const double t = static_cast<double>(k) / kPieces;
        look(interpolate(waypoints[i], waypoints[i + 1], t).p, leg.state);
      }
    }
  }
  const std::vector<Pose> back = reversed(legs);
  if (!back.empty()) {
    planning::Certifier certifier(world, hull, options.dive.planner.certify);
    proof.clearance_m = certifier.certify(back).clearance_m;
  }
  return proof;
}

void report_way_out(const WayOutProof& proof, const Mission& mission, Diagnostics& diagnostics) {
  if (!proof.exists) {
    diagnostics.error("CHK-NO-WAY-OUT", mission.source, mission.start.x.span,
                      "the dive starts under an overhead: an abort on the way would find no open "
                      "water on the trail behind it",
                      "start where there is open water above");
  }
  if (proof.clearance_m <= 0.0) {
    diagnostics.error("CHK-RETRACE", mission.source, map_span(mission),
                      fmt::format("swum backwards the route touches the map (clearance {:.2f} m), "
                                  "so an abort could not retrace it",
                                  proof.clearance_m));
  }
}

Budget nominal_budget(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                      const Mission& mission) {
  Budget budget;
  for (const PlannedRouteLeg& leg : legs) budget.distance_m += leg.plan.length_m;
  budget.duration_s = budget.distance_m / mission.speed.value + route.hold_s +
                      route.ascent_m / behaviors::SurfaceOptions{}.ascent_rate;
  budget.distance_m += route.ascent_m;
  const double fraction = mission.speed.value / vehicle::AutopilotOptions{}.full_speed;
  budget.energy_wh = vehicle::Aqua2Figures{}.cruise_power_w(fraction) * budget.duration_s / 3600.0;
  return budget;
}

void check_budget(const Budget& budget, const WayOutProof& way_out, const Mission& mission,
                  const vehicle::Conditions& conditions, Diagnostics& diagnostics) {
  const Located<double>& timeout = mission.limits.mission_timeout;
  if (budget.duration_s > timeout.value) {
    diagnostics.error("CHK-TIME", mission.source, timeout.span,
                      fmt::format("the route takes {:.0f} s at {:g} m/s, longer than the mission "
                                  "may last ({:g} s)",
                                  budget.duration_s, mission.speed.value, timeout.value),
                      "raise mission_timeout or shorten the route");
  } else if (budget.duration_s + way_out.longest_s > timeout.value) {
    diagnostics.warning("CHK-TIME-MARGIN", mission.source, timeout.span,
                        fmt::format("the route takes {:.0f} s and the longest way out {:.0f} s: "
                                    "together longer than mission_timeout",
                                    budget.duration_s, way_out.longest_s));
  }
  const double usable = conditions.battery_capacity_wh *
                        (conditions.battery_fraction - mission.limits.battery_reserve.value);
  if (budget.energy_wh > usable) {
    diagnostics.error("CHK-ENERGY", mission.source, mission.limits.battery_reserve.span,
                      fmt::format("the route takes {:.1f} Wh, and the battery has {:.1f} Wh above "
                                  "its reserve",
                                  budget.energy_wh, usable),
                      "shorten the route or lower battery_reserve");
  }
}

void report_dive(const DiveResult& dive, const Mission& mission, Diagnostics& diagnostics) {
  if (dive.outcome == "success") return;
  diagnostics.error("CHK-DIVE", mission.source, mission.initial.span,
                    fmt::format("the simulated dive ended in {} ({}): {}", dive.final_state,
                                dive.outcome, dive.cause));
}

Span span_of_state(const Mission& mission, const std::string& id) {
  const StateIndex index(mission);
  const int state = index.find(id);
  return state < 0 ? mission.initial.span : index.spec(state).id.span;
}

void report_faults(const std::vector<FaultVerdict>& verdicts, const Mission& mission,
                   Diagnostics& diagnostics) {
  for (const FaultVerdict& verdict : verdicts) {
    if (verdict.is_safe()) continue;
    std::string what;
    for (const Fault& fault : verdict.fault.faults) {
      what += fmt::format("{}{} at {:.1f} s", what.empty() ? "" : " and ", to_string(fault.kind),
                          fault.at_s);
    }
    diagnostics.error(
        "CHK-FAULT", mission.source, span_of_state(mission, verdict.fault.state),
        fmt::format("{} in '{}' ends in {} at {:.1f} m depth with {} collision(s): {}", what,
                    verdict.fault.state, verdict.dive.final_state, verdict.dive.final_depth_m,
                    verdict.dive.collisions, verdict.dive.cause),
        fmt::format("see it with: dive run {} --seed N --fault NAME@SECONDS",
                    mission.source.path()));
  }
}

}  // namespace

std::vector<PlannedRouteLeg> plan_route(const Route& route, const planning::World& world,
                                        const planning::RobotHull& hull,
                                        const planning::PlannerOptions& options,
                                        std::uint64_t seed) {
  SteadyClock clock;
  planning::Planner planner(world, hull, options, clock);
  std::vector<PlannedRouteLeg> legs;
  behaviors::LegSettings settings = route.settings;
  settings.seed = seed;
  Pose at = route.start;
  for (const RouteLeg& leg : route.legs) {
    at.p = leg.from_W;
    const planning::PlanRequest request = behaviors::leg_request(settings, leg.goal, at);
    legs.push_back({leg.state, leg.goal.id, planner.plan(request)});
    const std::vector<Pose>& waypoints = legs.back().plan.waypoints;
    at = waypoints.empty() ? request.goal : waypoints.back();
  }
  return legs;
}

std::span<const Rule> deck_rules() { return kDeckRules; }

CheckReport check_mission(const Mission& mission, const planning::World& world,
                          const vehicle::Model& model, const CheckOptions& options,
                          Diagnostics& diagnostics, const Progress& progress) {
  CheckReport report;
  progress("checking the mission against its map");
  check_against_world(mission, world, model.hull, diagnostics);
  if (!diagnostics.ok()) return report;

  const planning::Scene scene(world);
  const Route route = nominal_route(mission, scene);
  progress(fmt::format("planning {} legs", route.legs.size()));
  report.legs = plan_route(route, world, model.hull, options.dive.planner, options.dive.seed);
  report_failed_plans(route, report.legs, mission, diagnostics);
  if (!diagnostics.ok()) return report;

  progress("proving the way out");
  report.way_out = prove_way_out(route, report.legs, mission, world, model.hull, options);
  report_way_out(report.way_out, mission, diagnostics);
  report.budget = nominal_budget(route, report.legs, mission);
  check_budget(report.budget, report.way_out, mission, options.dive.conditions, diagnostics);
  if (!options.simulate || !diagnostics.ok()) return report;

  progress("diving it in simulation");
  report.dive = simulate_dive(mission, world, model, options.dive, nullptr);
  report_dive(*report.dive, mission, diagnostics);
  if (!options.faults || !diagnostics.ok()) return report;

  const std::vector<FaultCase> cases = every_fault_in_every_state(*report.dive);
  progress(fmt::format("diving {} faults", cases.size()));
  report.faults = dive_with_faults(cases, mission, world, model, options.dive, options.threads,
                                   [&](std::size_t done) {
                                     if (done % 50 == 0)
                                       progress(fmt::format("{} of {} dives", done, cases.size()));
                                   });
  report_faults(report.faults, mission, diagnostics);
  return report;
}

}  // namespace dive::mission
