#include "mission/check/exit_path_proof.h"

#include <cmath>

#include <fmt/format.h>

#include "behaviors/retrace.h"
#include "behaviors/trail.h"
#include "mission/check/route_times.h"
#include "planning/world/overhead.h"

namespace dive::mission {
namespace {

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

}  // namespace

double trail_link(const Mission& mission) {
  return behaviors::kTrailLinkShare * mission.limits.clearance.value;
}

ExitPathProof prove_exit_path(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                              const Mission& mission, const planning::World& world,
                              const planning::RobotHull& hull,
                              const planning::CertifyOptions& options) {
  const double radius = hull.radius();
  planning::OverheadIndex overheads(world);
  behaviors::Trail trail;
  ExitPathProof proof;
  const RouteTimes times = route_times(route, legs, mission);
  const auto visit = [&](const Eigen::Vector3d& p_W, double t, const std::string& state,
                         LegExit& leg) {
    const bool is_open = !overheads.is_above(p_W, radius);
    trail.add(p_W, is_open);
    (is_open ? leg.has_open_water : leg.has_overhead) = true;
    const behaviors::Trail::Path path = trail.exit_path(p_W, trail_link(mission));
    if (!path.arrives) proof.exists = false;
    const double seconds =
        path_time_s(mission, path.points, t) + ascent_time_s(-path.points.back().z());
    if (seconds > leg.longest_s) {
      leg.longest_s = seconds;
      leg.longest_m = path.length_m;
    }
    if (seconds > proof.longest_s) {
      proof.longest_s = seconds;
      proof.longest_m = path.length_m;
      proof.state = state;
    }
  };
  LegExit start;
  visit(route.start.p, 0.0, "start", start);
  for (std::size_t l = 0; l < legs.size(); ++l) {
    LegExit& leg = proof.legs.emplace_back();
    const std::vector<Pose>& waypoints = legs[l].plan.waypoints;
    const std::vector<double>& waypoint_s = times.legs[l].waypoint_s;
    for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
      constexpr int kPieces = 4;  // per segment: breadcrumbs about as dense as the vehicle's
      for (int k = 1; k <= kPieces; ++k) {
        const double share = static_cast<double>(k) / kPieces;
        visit(interpolate(waypoints[i], waypoints[i + 1], share).p,
              waypoint_s[i] + share * (waypoint_s[i + 1] - waypoint_s[i]), legs[l].state, leg);
      }
    }
  }
  const std::vector<Pose> back = reversed(legs);
  if (!back.empty()) {
    planning::Certifier certifier(world, hull, options);
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
    diagnostics.error("CHK-RETRACE", mission.source, mission.map_file.span,
                      fmt::format("an abort cannot retrace the route: swum backwards it has a "
                                  "clearance of {:.2f} m",
                                  proof.clearance_m));
  }
}

}  // namespace dive::mission
