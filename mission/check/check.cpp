#include "mission/check/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "behaviors/retrace.h"
#include "behaviors/surface.h"
#include "behaviors/trail.h"
#include "mission/check/reproduce.h"
#include "mission/check/rules.h"
#include "mission/document/state_index.h"
#include "mission/executive/behavior_factory.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "vehicle/aqua2_figures.h"
#include "vehicle/autopilot.h"

namespace dive::mission {
namespace {

constexpr double kSecondsPerHour = 3600.0;

constexpr std::array kDeckRules = {
    Rule{"CHK-UNKNOWN-ENVIRONMENT", Severity::kWarning,
         "In an unknown environment the checks use the simulated world, which the vehicle does not "
         "have."},
    Rule{"CHK-UNKNOWN-NO-SIMULATION-MAP", Severity::kWarning,
         "A mission in an unknown environment names a simulated world; little can be proved "
         "without."},
    Rule{
        "CHK-PLAN", Severity::kError,
        "Every leg of the nominal route has a path that is certified to keep the clearance, or the "
        "reduced_clearance that the mission accepts where the leg starts."},
    Rule{"CHK-NO-EXIT-PATH", Severity::kError,
         "From every point of the route the trail leads back to open water."},
    Rule{"CHK-RETRACE", Severity::kError, "The route can be followed backwards without contact."},
    Rule{"CHK-TIME", Severity::kError, "The route takes no longer than mission_timeout."},
    Rule{"CHK-TIME-MARGIN", Severity::kWarning,
         "The route and the longest exit path together take no longer than mission_timeout."},
    Rule{"CHK-ENERGY", Severity::kError, "The route leaves battery_reserve in the battery."},
    Rule{"CHK-ENERGY-WORST", Severity::kWarning,
         "The battery lasts until mission_timeout, and then for the longest exit path."},
    Rule{"CHK-NO-RETURN", Severity::kError,
         "From every point of the route, time and charge suffice to leave and surface."},
    Rule{"CHK-THIRDS", Severity::kWarning,
         "A penetration uses at most a third of the usable time and charge before it turns back."},
    Rule{"CHK-FENCE", Severity::kError, "The whole vehicle stays within the geofence."},
    Rule{"CHK-DIVE", Severity::kError, "The simulated dive ends as planned, without a collision."},
    Rule{"CHK-DIVE-CLEARANCE", Severity::kWarning,
         "The simulated dive keeps at least half of the required clearance."},
    Rule{"CHK-FAULT", Severity::kError,
         "After any fault in any state the dive ends surfaced or held, without a collision."},
};

double link_of(const Mission& mission) {
  return behaviors::kTrailLinkShare * mission.limits.clearance.value;
}

Span map_span(const Mission& mission) { return mission.map_file.span; }

Span span_of_state(const Mission& mission, const std::string& id) {
  const StateIndex index(mission);
  const int state = index.find(id);
  return state < 0 ? mission.initial.span : index.spec(state).id.span;
}

void report_unknown(const Mission& mission, Diagnostics& diagnostics) {
  if (!mission.unknown) return;
  if (has_simulation_map(mission)) {
    diagnostics.warning("CHK-UNKNOWN-ENVIRONMENT", mission.source, map_span(mission),
                        "all proofs are for the simulated world: the vehicle does not have that "
                        "map, and the real environment may differ");
    return;
  }
  diagnostics.warning(
      "CHK-UNKNOWN-NO-SIMULATION-MAP", mission.source, map_span(mission),
      "the environment is unknown and has no simulated world: whether goals are free "
      "and paths to them and out of overheads exist cannot be proved, distances and "
      "budget assume straight paths, and there is no simulated dive",
      "write simulation_map=\"maps/NAME.sdf\" with a world like the expected one");
}

std::string shown(const Eigen::Vector3d& p_W) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p_W.x(), p_W.y(), p_W.z());
}

void report_reduced(const RouteLeg& leg, const planning::PlanResult& plan, const Mission& mission,
                    Diagnostics& diagnostics) {
  const std::string accepted =
      std::isfinite(leg.reduced_clearance)
          ? fmt::format("the mission accepts {:g} m", leg.reduced_clearance)
          : "the mission accepts no reduced clearance";
  diagnostics.error("CHK-PLAN", mission.source, leg.span,
                    fmt::format("the path to goal '{}' is reduced: {}; narrowest at {}; {}",
                                leg.goal.id, plan.reason, shown(plan.reduced->place_W), accepted),
                    "move the start of the leg, or state the least clearance that is accepted: "
                    "reduced_clearance=\"...\" here or in limits");
}

void report_failed_plans(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const planning::PlanResult& plan = legs[i].plan;
    if (plan.accepted) continue;
    if (plan.status == planning::PlanStatus::kReduced) {
      report_reduced(route.legs[i], plan, mission, diagnostics);
      continue;
    }
    diagnostics.error("CHK-PLAN", mission.source, route.legs[i].span,
                      fmt::format("no path to goal '{}' ({}): {}", legs[i].goal,
                                  planning::to_string(plan.status), plan.reason),
                      "move the goal, or lower the clearance in limits");
  }
}

// The whole route with each leg level and in the opposite direction, as a retrace would swim it.
std::vector<Pose> reversed(const std::vector<PlannedRouteLeg>& legs) {
  std::vector<Pose> poses;
  for (auto leg = legs.rbegin(); leg != legs.rend(); ++leg) {
    for (auto pose = leg->plan.waypoints.rbegin(); pose != leg->plan.waypoints.rend(); ++pose) {
      if (!poses.empty() && (poses.back().p - pose->p).norm() < 1e-9) continue;
      poses.push_back(*pose);
    }
  }
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const Eigen::Vector3d direction = poses[i + 1].p - poses[i].p;
    poses[i].q = from_rpy(0.0, 0.0, std::atan2(direction.y(), direction.x()));
  }
  if (poses.size() > 1) poses.back().q = poses[poses.size() - 2].q;
  return poses;
}

ExitPathProof prove_exit_path(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                              const Mission& mission, const planning::World& world,
                              const planning::RobotHull& hull, const CheckOptions& options) {
  const double radius = hull.radius();
  planning::OverheadIndex overheads(world);
  behaviors::Trail trail;
  ExitPathProof proof;
  const auto visit = [&](const Eigen::Vector3d& p_W, const std::string& state) {
    trail.add(p_W, !overheads.is_above(p_W, radius));
    const behaviors::Trail::Path path = trail.exit_path(p_W, link_of(mission));
    if (!path.arrives) proof.exists = false;
    const double up_s = -path.points.back().z() / behaviors::SurfaceOptions{}.ascent_rate;
    const double seconds = path.length_m / mission.speed.value + up_s;
    if (seconds > proof.longest_s) {
      proof.longest_s = seconds;
      proof.longest_m = path.length_m;
      proof.state = state;
    }
  };
  visit(route.start.p, "start");
  for (const PlannedRouteLeg& leg : legs) {
    const std::vector<Pose>& waypoints = leg.plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      constexpr int kPieces = 4;  // per segment: breadcrumbs about as dense as the vehicle's
      for (int k = 1; k <= kPieces; ++k) {
        const double t = static_cast<double>(k) / kPieces;
        visit(interpolate(waypoints[i], waypoints[i + 1], t).p, leg.state);
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

void report_exit_path(const ExitPathProof& proof, const Mission& mission,
                      Diagnostics& diagnostics) {
  if (!proof.exists) {
    diagnostics.error("CHK-NO-EXIT-PATH", mission.source, mission.start.x.span,
                      "the dive starts under an overhead: an abort would find no open water on "
                      "the trail",
                      "start where there is open water above");
  }
  if (proof.clearance_m <= 0.0) {
    diagnostics.error("CHK-RETRACE", mission.source, map_span(mission),
                      fmt::format("an abort cannot retrace the route: swum backwards it has a "
                                  "clearance of {:.2f} m",
                                  proof.clearance_m));
  }
}

double power_w(const Mission& mission) {
  const double fraction = mission.speed.value / vehicle::AutopilotOptions{}.full_speed;
  return vehicle::Aqua2Figures{}.cruise_power_w(fraction);
}

/// Resources that a dive of this mission may use.
struct Usable {
  double time_s = 0.0;
  double energy_wh = 0.0;
};

Usable usable(const Mission& mission, const vehicle::Conditions& conditions) {
  return {mission.limits.mission_timeout.value,
          conditions.battery_capacity_wh *
              (conditions.battery_fraction - mission.limits.battery_reserve.value)};
}

// Walks the route point by point, as the vehicle drops its breadcrumbs, and tests at each whether
// turning back is still possible.
void find_turning_points(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                         const Mission& mission, const planning::World& world, double radius,
                         const Usable& limit, Budget& budget) {
  planning::OverheadIndex overheads(world);
  behaviors::Trail trail;
  const double power = power_w(mission) / kSecondsPerHour;  // Wh per s
  double distance = 0.0;
  double entered_s = 0.0;  // when the vehicle was last in open water
  double last_out_m = 0.0;
  const auto visit = [&](const Eigen::Vector3d& p_W, const std::string& state) {
    const double t = distance / mission.speed.value;
    const bool open = !overheads.is_above(p_W, radius);
    trail.add(p_W, open);
    if (open) entered_s = t;
    const behaviors::Trail::Path path = trail.exit_path(p_W, link_of(mission));
    const double out_s = path.length_m / mission.speed.value -
                         path.points.back().z() / behaviors::SurfaceOptions{}.ascent_rate;
    if (!budget.no_return && (t + out_s > limit.time_s || (t + out_s) * power > limit.energy_wh)) {
      budget.no_return = Budget::NoReturn{distance, state};
    }
    const double time_left = limit.time_s - entered_s;
    const double energy_left = limit.energy_wh - entered_s * power;
    const bool inward = !open && path.length_m > last_out_m;
    last_out_m = path.length_m;
    if (!inward || time_left <= 0.0 || energy_left <= 0.0) return;
    const double used =
        std::max((t - entered_s) / time_left, (t - entered_s) * power / energy_left);
    if (used <= budget.budget_used_under_overhead) return;
    budget.budget_used_under_overhead = used;
    budget.worst_overhead_state = state;
  };
  visit(route.start.p, "start");
  for (const PlannedRouteLeg& leg : legs) {
    const std::vector<Pose>& waypoints = leg.plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      distance += (waypoints[i + 1].p - waypoints[i].p).norm();
      visit(waypoints[i + 1].p, leg.state);
    }
  }
}

Budget make_budget(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                   const Mission& mission, const planning::World& world, double radius,
                   const ExitPathProof& exit_path, const vehicle::Conditions& conditions) {
  Budget budget;
  for (const PlannedRouteLeg& leg : legs) budget.distance_m += leg.plan.length_m;
  budget.duration_s = budget.distance_m / mission.speed.value + route.hold_s +
                      route.ascent_m / behaviors::SurfaceOptions{}.ascent_rate;
  budget.distance_m += route.ascent_m;
  const double power = power_w(mission) / kSecondsPerHour;
  budget.energy_wh = power * budget.duration_s;
  budget.worst_duration_s = mission.limits.mission_timeout.value + exit_path.longest_s;
  budget.worst_energy_wh = power * budget.worst_duration_s;
  find_turning_points(route, legs, mission, world, radius, usable(mission, conditions), budget);
  return budget;
}

void check_budget(const Budget& budget, const ExitPathProof& exit_path, const Mission& mission,
                  const vehicle::Conditions& conditions, Diagnostics& diagnostics) {
  const Located<double>& timeout = mission.limits.mission_timeout;
  const Usable limit = usable(mission, conditions);
  if (budget.duration_s > limit.time_s) {
    diagnostics.error("CHK-TIME", mission.source, timeout.span,
                      fmt::format("the route takes {:.0f} s at {:g} m/s, longer than "
                                  "mission_timeout ({:g} s)",
                                  budget.duration_s, mission.speed.value, timeout.value),
                      "raise mission_timeout or shorten the route");
  } else if (budget.duration_s + exit_path.longest_s > limit.time_s) {
    diagnostics.warning("CHK-TIME-MARGIN", mission.source, timeout.span,
                        fmt::format("the route takes {:.0f} s and the longest exit path {:.0f} s: "
                                    "together longer than mission_timeout",
                                    budget.duration_s, exit_path.longest_s));
  }
  if (budget.energy_wh > limit.energy_wh) {
    diagnostics.error("CHK-ENERGY", mission.source, mission.limits.battery_reserve.span,
                      fmt::format("the route takes {:.1f} Wh, and the battery has {:.1f} Wh above "
                                  "its reserve",
                                  budget.energy_wh, limit.energy_wh),
                      "shorten the route or lower battery_reserve");
  } else if (budget.no_return) {
    diagnostics.error("CHK-NO-RETURN", mission.source,
                      span_of_state(mission, budget.no_return->state),
                      fmt::format("from {:.0f} m along the route, in '{}', time or charge no "
                                  "longer suffice to leave and surface",
                                  budget.no_return->distance_m, budget.no_return->state),
                      "shorten the route, or raise mission_timeout");
  }
  const double charge = conditions.battery_capacity_wh * conditions.battery_fraction;
  if (budget.worst_energy_wh > charge) {
    diagnostics.warning(
        "CHK-ENERGY-WORST", mission.source, timeout.span,
        fmt::format("a dive until mission_timeout and the exit path take {:.1f} Wh, "
                    "and the battery has {:.1f} Wh",
                    budget.worst_energy_wh, charge),
        "lower mission_timeout");
  }
  if (budget.budget_used_under_overhead > 1.0 / 3.0) {
    diagnostics.warning(
        "CHK-THIRDS", mission.source, span_of_state(mission, budget.worst_overhead_state),
        fmt::format("{:.0f} % of the usable time or charge are used in '{}' "
                    "before the return begins, more than a third",
                    100.0 * budget.budget_used_under_overhead, budget.worst_overhead_state));
  }
}

// Distance (m) from p to the fence's edge, negative outside.
double inside_fence(const std::vector<Eigen::Vector2d>& fence, const Eigen::Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (std::size_t i = 0; i < fence.size(); ++i) {
    const Eigen::Vector2d& a = fence[i];
    const Eigen::Vector2d& b = fence[(i + 1) % fence.size()];
    const Eigen::Vector2d edge = b - a;
    const double along =
        std::clamp((p - a).dot(edge) / std::max(edge.squaredNorm(), 1e-12), 0.0, 1.0);
    nearest = std::min(nearest, (p - a - along * edge).norm());
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * edge.x()) {
      inside = !inside;
    }
  }
  return inside ? nearest : -nearest;
}

// Samples a straight piece: it lies within a polygon with margin if points at this spacing do.
void check_fence(const std::vector<PlannedRouteLeg>& legs, const Route& route,
                 const Mission& mission, double radius, Diagnostics& diagnostics) {
  std::vector<Eigen::Vector2d> fence;
  for (const auto& [x, y] : mission.failsafes.fence) fence.emplace_back(x.value, y.value);
  if (fence.empty()) return;
  constexpr double kStep = 0.2;  // m
  for (std::size_t l = 0; l < legs.size(); ++l) {
    const std::vector<Pose>& waypoints = legs[l].plan.waypoints;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      const Eigen::Vector3d step = waypoints[i + 1].p - waypoints[i].p;
      const int pieces = std::max(1, static_cast<int>(std::ceil(step.norm() / kStep)));
      for (int k = 0; k <= pieces; ++k) {
        const Eigen::Vector3d p = waypoints[i].p + static_cast<double>(k) / pieces * step;
        if (inside_fence(fence, p.head<2>()) >= radius + 0.5 * kStep) continue;
        diagnostics.error("CHK-FENCE", mission.source, route.legs[l].span,
                          fmt::format("on the path to '{}' the vehicle crosses the geofence at "
                                      "({:.1f}, {:.1f})",
                                      legs[l].goal, p.x(), p.y()));
        return;
      }
    }
  }
}

std::string hint_for(const Mission& mission, const DiveSettings& settings) {
  return "reproduce it with: " + run_command_for(mission.source.path(), settings);
}

void report_dive(const DiveResult& dive, const Mission& mission, const DiveSettings& settings,
                 Diagnostics& diagnostics) {
  if (dive.outcome != "success") {
    diagnostics.error("CHK-DIVE", mission.source, mission.initial.span,
                      fmt::format("the simulated dive ended in {} ({}): {}", dive.final_state,
                                  dive.outcome, dive.cause),
                      hint_for(mission, settings));
  }
  const Located<double>& asked = mission.limits.clearance;
  if (dive.collisions.empty() && dive.nearest.clearance_m < 0.5 * asked.value) {
    diagnostics.warning("CHK-DIVE-CLEARANCE", mission.source, asked.span,
                        fmt::format("the simulated dive passes {}, less than half of the "
                                    "required clearance ({:g} m)",
                                    describe(dive.nearest), asked.value),
                        hint_for(mission, settings));
  }
}

DiveSettings settings_of(const FaultResult& result, DiveSettings settings) {
  settings.faults = result.fault.faults;
  return settings;
}

void report_faults(const std::vector<FaultResult>& results, const Mission& mission,
                   const DiveSettings& settings, Diagnostics& diagnostics) {
  for (const FaultResult& result : results) {
    if (result.is_safe()) continue;
    diagnostics.error("CHK-FAULT", mission.source, span_of_state(mission, result.fault.state),
                      describe(result), hint_for(mission, settings_of(result, settings)));
  }
}

// Period of progress reports to the observer, s of dive time.
constexpr double kDiveProgressPeriod = 1.0;

NominalDive dive_nominally(const Mission& mission, const planning::World& world,
                           const vehicle::Model& model, const DiveSettings& settings,
                           double expected_s, CheckObserver& observer) {
  NominalDive nominal;
  planning::OverheadIndex overheads(world);
  const double radius = model.hull.radius();
  double next_s = kDiveProgressPeriod;
  nominal.under_overhead.push_back(false);  // tick 0 is before the first step
  nominal.result =
      simulate_dive(mission, world, model, settings,
                    [&](const StepInputs& inputs, const StepOutputs&,
                        const vehicle::GroundTruth& truth, std::span<const Collision>) {
                      nominal.under_overhead.push_back(overheads.is_above(truth.X_WB.p, radius));
                      const double now_s = to_seconds(inputs.now);
                      if (now_s < next_s) return;
                      next_s += kDiveProgressPeriod;
                      observer.on_progress(now_s, expected_s, "s of the dive", now_s / expected_s);
                    });
  return nominal;
}

std::vector<FaultResult> dive_faults(const NominalDive& nominal, const Mission& mission,
                                     const planning::World& world, const vehicle::Model& model,
                                     const CheckOptions& options, CheckObserver& observer) {
  const std::vector<FaultCase> cases = draw_fault_cases(
      mission, nominal, {options.dive.seed, options.instants, options.pair_instants});
  observer.on_step(fmt::format("{} simulated dives with faults", cases.size()));
  const auto total = static_cast<double>(cases.size());
  FaultProgress work(cases);
  const auto follow = [&](std::size_t done, const FaultResult& result) {
    work.add(result);
    if (!result.is_safe()) {
      const DiveSettings settings = settings_of(result, options.dive);
      observer.on_finding(result, run_command_for(mission.source.path(), settings));
    }
    observer.on_progress(static_cast<double>(done), total, "dives", work.share());
  };
  return dive_with_faults(cases, mission, world, model, options.dive, options.threads, follow);
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
    settings.limits.reduced_clearance = leg.reduced_clearance;
    const planning::PlanRequest request = behaviors::leg_request(settings, leg.goal, at);
    planning::PlanResult plan = planner.plan(request);
    legs.push_back({leg.state, leg.goal.id, std::move(plan), planner.statistics()});
    const std::vector<Pose>& waypoints = legs.back().plan.waypoints;
    at = waypoints.empty() ? request.goal : waypoints.back();
  }
  return legs;
}

std::span<const Rule> deck_rules() { return kDeckRules; }

CheckReport check_mission(const Mission& mission, const planning::World& world,
                          const vehicle::Model& model, const CheckOptions& options,
                          Diagnostics& diagnostics, CheckObserver& observer) {
  CheckReport report;
  report_unknown(mission, diagnostics);
  observer.on_step("checking the mission against its map");
  check_against_world(mission, world, model.hull, diagnostics);
  if (!diagnostics.ok()) return report;

  const planning::Scene scene(world);
  const Route route = nominal_route(mission, scene);
  observer.on_step(fmt::format("planning {} legs", route.legs.size()));
  report.legs = plan_route(route, world, model.hull, options.dive.planner, options.dive.seed);
  report_failed_plans(route, report.legs, mission, diagnostics);
  if (!diagnostics.ok()) return report;

  observer.on_step("proving the exit paths");
  report.exit_path = prove_exit_path(route, report.legs, mission, world, model.hull, options);
  report_exit_path(report.exit_path, mission, diagnostics);
  report.budget = make_budget(route, report.legs, mission, world, model.hull.radius(),
                              report.exit_path, options.dive.conditions);
  check_fence(report.legs, route, mission, model.hull.radius(), diagnostics);
  check_budget(report.budget, report.exit_path, mission, options.dive.conditions, diagnostics);
  if (!options.simulate || !diagnostics.ok() || !has_simulation_map(mission)) return report;

  observer.on_step("simulated dive");
  NominalDive nominal =
      dive_nominally(mission, world, model, options.dive, report.budget.duration_s, observer);
  report_dive(nominal.result, mission, options.dive, diagnostics);
  if (options.faults && diagnostics.ok()) {
    report.faults = dive_faults(nominal, mission, world, model, options, observer);
    report_faults(report.faults, mission, options.dive, diagnostics);
  }
  report.dive = std::move(nominal.result);
  return report;
}

}  // namespace dive::mission
