#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/xml.h"
#include "mission/check/check.h"
#include "mission/cli/commands.h"
#include "mission/cli/drawing.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/mesh_report.h"
#include "mission/cli/output.h"
#include "mission/cli/plan_legs.h"
#include "mission/cli/terminal.h"
#include "planning/mapping/cloud_world.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

constexpr double kMaxDepthOnMap = 50.0;   // m
constexpr double kRoomAroundCloud = 5.0;  // m of free space above and below it
constexpr double kFarOff = 10'000.0;      // m: largest distance of a pose from the cloud
// m around start and goal to which a huge cloud is cut
constexpr double kAroundPath = 25.0;
constexpr std::size_t kMaxVoxels = 200'000;  // maximum passed to a planner

void print_plan(const std::string& name, const planning::PlanResult& plan,
                const planning::PlannerStatistics& statistics, bool has_world = true) {
  if (!planning::has_path(plan.status)) {
    print(fmt::format("{}: {}: {}", name, planning::to_string(plan.status), plan.reason));
    return;
  }
  const std::string clearance = has_world
                                    ? "certified clearance " + certified_text(plan.clearance_m, 3)
                                    : fmt::format("straight line, {}", kNotCertified);
  print(fmt::format("{}: {}{:.1f} m, {}, {} waypoints, {} warm start(s)", name,
                    plan.reduced ? "reduced: " : "", plan.length_m, clearance,
                    plan.waypoints.size(), plan.warm_starts));
  if (plan.reduced) {
    const Eigen::Vector3d& p = plan.reduced->place_W;
    print(fmt::format("  {}; narrowest at {:.2f},{:.2f},{:.2f}", plan.reason, p.x(), p.y(), p.z()));
    if (!plan.accepted) {
      print("  not accepted: use --allow-reduced, or reduced_clearance in the mission");
    }
  }
  print(fmt::format("  {:.1f} ms: optimise {:.1f}, warm start {:.1f}, certify {:.1f}",
                    statistics.total_ms, statistics.optimise_ms, statistics.warm_start_ms,
                    statistics.certify_ms));
}

int exit_status(const std::vector<PlannedRouteLeg>& legs) {
  int status = kExitSuccess;
  for (const PlannedRouteLeg& leg : legs) {
    if (leg.plan.status == planning::PlanStatus::kInvalid) return kExitUsage;
    if (!leg.plan.accepted) status = kExitFailed;
  }
  return status;
}

int plan_mission(const PlanArguments& arguments) {
  Diagnostics diagnostics;
  const std::optional<LoadedMission> loaded =
      load(arguments.mission, resources(arguments.allow_outside), diagnostics);
  print_diagnostics(diagnostics);
  if (!loaded) return kExitUsage;
  tl::expected<Result, int> svg = open_result(arguments.svg, arguments.force);
  if (!svg) return svg.error();
  const planning::Scene scene(loaded->world);
  Route route = nominal_route(loaded->mission, scene);
  if (arguments.allow_reduced) {
    for (RouteLeg& leg : route.legs) leg.reduced_clearance = 0.0;
  }
  const std::vector<PlannedRouteLeg> legs =
      plan_legs(*loaded, route, arguments.seed, arguments.json);
  if (arguments.json) {
    nlohmann::ordered_json plans = nlohmann::ordered_json::array();
    for (const PlannedRouteLeg& leg : legs) {
      nlohmann::ordered_json entry = {{"state", leg.state}, {"goal", leg.goal}};
      entry.update(to_json(leg.plan, leg.statistics));
      plans.push_back(std::move(entry));
    }
    print_json({{"plans", std::move(plans)}, {"meshes", meshes_json(loaded->world)}});
  } else {
    print_meshes(loaded->world);
    const bool has_world = has_simulation_map(loaded->mission);
    for (const PlannedRouteLeg& leg : legs) {
      print_plan(leg.goal, leg.plan, leg.statistics, has_world);
    }
  }
  if (*svg) {
    const DiveDrawing drawing =
        drawing_of_plan(loaded->mission.id + ": plan", loaded->world, loaded->model.hull,
                        loaded->mission.limits.clearance.value, legs);
    if (const int status = write_result(*svg, render_svg(drawing))) return status;
  }
  return exit_status(legs);
}

// Start, goal and options, in the axes in which the poses were written. The caller sets depths.
std::optional<planning::PlanRequest> request_of(const PlanArguments& arguments) {
  const std::optional<WrittenPose> start = parse_pose("--start", arguments.start);
  const std::optional<WrittenPose> goal = parse_pose("--goal", arguments.goal);
  if (!start || !goal) return std::nullopt;
  planning::PlanRequest request;
  request.start = start->pose;
  request.goal = goal->pose;
  const Eigen::Vector3d way = goal->pose.p - start->pose.p;
  const Eigen::Quaterniond along = from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()));
  if (!start->has_attitude) request.start.q = along;
  if (!goal->has_attitude) request.goal.q = along;
  request.goal_attitude_fixed = goal->has_attitude;
  request.limits.attitude = attitude_mode(arguments.attitude);
  request.limits.clearance = arguments.clearance_m;
  if (arguments.allow_reduced) request.limits.reduced_clearance = 0.0;
  request.seed = arguments.seed;
  return request;
}

// Prints one path, and draws it if requested. `world` is offset by `origin` from the axes of the
// path, which are those of the drawing.
int show(const PlanArguments& arguments, Result& svg, const std::string& title,
         const planning::World& world, const vehicle::Model& model, planning::PlanResult plan,
         const planning::PlannerStatistics& statistics,
         const Eigen::Vector3d& origin = Eigen::Vector3d::Zero()) {
  std::vector<PlannedRouteLeg> legs{{"", "goal", std::move(plan), statistics}};
  planning::PlanResult& shown = legs.front().plan;
  if (arguments.json) {
    nlohmann::ordered_json json = to_json(shown, statistics);
    json["meshes"] = meshes_json(world);
    print_json(json);
  } else {
    print_meshes(world);
    print_plan("goal", shown, statistics);
  }
  if (svg) {
    for (Pose& pose : shown.waypoints) pose.p -= origin;
    const DiveDrawing drawing =
        drawing_of_plan(title, world, model.hull, arguments.clearance_m, legs);
    if (const int status = write_result(svg, render_svg(drawing))) return status;
  }
  return exit_status(legs);
}

int plan_on_map(const PlanArguments& arguments) {
  std::optional<planning::PlanRequest> request = request_of(arguments);
  if (!request) return kExitUsage;
  Diagnostics diagnostics;
  const std::optional<planning::World> world =
      planning::load_sdf(arguments.map, diagnostics, resources(arguments.allow_outside));
  print_diagnostics(diagnostics);
  if (!world) return kExitUsage;
  tl::expected<Result, int> svg = open_result(arguments.svg, arguments.force);
  if (!svg) return svg.error();
  request->limits.min_z = -arguments.max_depth_m.value_or(kMaxDepthOnMap);

  const vehicle::Model model = load_vehicle();
  SteadyClock clock;
  planning::Planner planner(*world, model.hull, planning::PlannerOptions{}, clock);
  planning::PlanResult plan = planner.plan(*request);
  return show(arguments, *svg, arguments.map, *world, model, std::move(plan), planner.statistics());
}

// --- in a cloud ---

std::optional<double> metres_of(std::string_view unit) {
  static constexpr std::array<std::pair<std::string_view, double>, 7> kUnits{{{"m", 1.0},
                                                                              {"dm", 0.1},
                                                                              {"cm", 0.01},
                                                                              {"mm", 0.001},
                                                                              {"km", 1000.0},
                                                                              {"ft", 0.3048},
                                                                              {"in", 0.0254}}};
  const auto* at = std::ranges::find(kUnits, unit, &std::pair<std::string_view, double>::first);
  return at == kUnits.end() ? std::nullopt : std::optional(at->second);
}

// The request in W. Depths are bounded below and, where there is no surface, above every point.
planning::PlanRequest in_world(planning::PlanRequest request, const planning::CloudWorld& cloud,
                               const std::optional<double>& max_depth_m) {
  request.start.p -= cloud.origin;
  request.goal.p -= cloud.origin;
  Eigen::AlignedBox3d all = cloud.bounds_W;
  all.extend(request.start.p).extend(request.goal.p);
  request.limits.min_z = max_depth_m ? -*max_depth_m : all.min().z() - kRoomAroundCloud;
  request.limits.max_z = cloud.has_surface ? 0.0 : all.max().z() + kRoomAroundCloud;
  return request;
}

// True if nothing omitted from the cloud affects the path.
bool is_known_about(const planning::PlanResult& plan, const planning::CloudWorld& cloud,
                    double reach) {
  if (!cloud.known_W) return true;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(reach);
  const Eigen::AlignedBox3d inner(cloud.known_W->min() + margin, cloud.known_W->max() - margin);
  return std::ranges::all_of(plan.waypoints,
                             [&](const Pose& X_WB) { return inner.contains(X_WB.p); });
}

// Empty, or a message: poses in axes other than the cloud's are mostly far away from it.
std::string far_off(const planning::PlanRequest& request, const planning::CloudFile& cloud) {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& p : cloud.points) bounds.extend(cloud.origin + p.cast<double>());
  for (const auto& [name, pose] : {std::pair("start", request.start), {"goal", request.goal}}) {
    const double distance = bounds.exteriorDistance(pose.p);
    if (distance <= kFarOff) continue;
    return fmt::format(
        "the {} is {:.0f} km away from it: it lies between {:.1f}, {:.1f}, {:.1f} and {:.1f}, "
        "{:.1f}, {:.1f}",
        name, distance / 1000.0, bounds.min().x(), bounds.min().y(), bounds.min().z(),
        bounds.max().x(), bounds.max().y(), bounds.max().z());
  }
  return {};
}

int plan_in_cloud(const PlanArguments& arguments) {
  const std::optional<planning::PlanRequest> request = request_of(arguments);
  if (!request) return kExitUsage;
  const auto refuse = [&](const std::string& why) {
    complain(fmt::format("{}: {}", arguments.cloud, why));
    return kExitUsage;
  };
  planning::CloudOptions file;
  if (!arguments.unit.empty()) file.unit_m = metres_of(arguments.unit);
  const auto cloud = planning::read_cloud(arguments.cloud, file);
  if (!cloud) return refuse(cloud.error());

  if (const std::string why = far_off(*request, *cloud); !why.empty()) return refuse(why);
  tl::expected<Result, int> svg = open_result(arguments.svg, arguments.force);
  if (!svg) return svg.error();
  const vehicle::Model model = load_vehicle();
  const double reach = model.hull.radius() + arguments.clearance_m;
  SteadyClock clock;
  // Distant points are omitted only as long as the path stays away from them.
  for (double around_m = kAroundPath;; around_m *= 2.0) {
    planning::CloudWorldOptions options;
    options.max_voxels = kMaxVoxels;
    options.region = Eigen::AlignedBox3d(request->start.p).extend(request->goal.p);
    options.region.min().array() -= around_m;
    options.region.max().array() += around_m;
    auto made = planning::world_from_cloud(*cloud, options);
    if (!made) return refuse(made.error());
    if (!made->has_surface && arguments.max_depth_m) {
      return refuse("it reaches above z = 0: there is no surface for --max-depth to count from");
    }
    planning::Planner planner(made->world, model.hull, planning::PlannerOptions{}, clock);
    planning::PlanResult plan = planner.plan(in_world(*request, *made, arguments.max_depth_m));
    if (!is_known_about(plan, *made, reach)) continue;

    for (const std::string& warning : made->warnings) {
      note(fmt::format("dive: {}: {}", arguments.cloud, warning));
    }
    note(fmt::format("dive: {}: {} points, {} pieces; z = 0 is {}", arguments.cloud, made->points,
                     made->world.obstacles.size(),
                     made->has_surface ? "the surface of the water"
                                       : "not taken for the surface: the cloud reaches above it"));
    for (Pose& pose : plan.waypoints) pose.p += made->origin;
    if (plan.reduced) plan.reduced->place_W += made->origin;
    std::string title = arguments.cloud;
    if (!made->origin.isZero()) {
      title += fmt::format(" (drawn about {:.0f}, {:.0f}, {:.0f})", made->origin.x(),
                           made->origin.y(), made->origin.z());
    }
    return show(arguments, *svg, title, made->world, model, std::move(plan), planner.statistics(),
                made->origin);
  }
}

// Prints an error if the file is clearly of another kind than the argument requires.
bool is_of_its_kind(const PlanArguments& arguments) {
  struct Way {
    FileKind kind;
    const std::string& path;
    const char* instead;
  };
  const Way ways[] = {
      {FileKind::kMission, arguments.mission, "give it without an option"},
      {FileKind::kMap, arguments.map, "give it with --map, --start and --goal"},
      {FileKind::kCloud, arguments.cloud, "give it with --cloud, --start and --goal"}};
  const auto* given = std::ranges::find_if(ways, [](const Way& way) { return !way.path.empty(); });
  const FileKind kind = kind_of_file(given->path);
  const auto* meant = std::ranges::find(ways, kind, &Way::kind);
  if (meant == given) return true;
  if (meant == std::end(ways)) {
    Diagnostics diagnostics;
    const bool is_text = is_text_of(given->kind, given->path, diagnostics);
    print_diagnostics(diagnostics);
    return is_text;
  }
  complain(fmt::format("{}: this is {}, not {}: {}", given->path, in_words(kind),
                       in_words(given->kind), meant->instead));
  return false;
}

// Checks that there is a world to plan in; prints an error otherwise.
bool is_usable(const PlanArguments& arguments) {
  const auto places = static_cast<int>(!arguments.mission.empty()) +
                      static_cast<int>(!arguments.map.empty()) +
                      static_cast<int>(!arguments.cloud.empty());
  const bool has_poses = !arguments.start.empty() && !arguments.goal.empty();
  if (places > 1 && !arguments.cloud.empty()) {
    complain("plan takes one of a mission, --map and --cloud, not several");
    return false;
  }
  if (!arguments.unit.empty() && arguments.cloud.empty()) {
    complain("--unit applies to a point cloud: give --cloud FILE");
    return false;
  }
  if (places == 1 && !is_of_its_kind(arguments)) return false;
  if (places != 1 || (arguments.mission.empty() && !has_poses)) {
    complain("plan needs either a mission or all of --map (or --cloud), --start and --goal");
    return false;
  }
  return true;
}

}  // namespace

int run_plan(const PlanArguments& arguments) {
  if (!is_usable(arguments)) return kExitUsage;
  if (!arguments.cloud.empty()) return plan_in_cloud(arguments);
  return arguments.map.empty() ? plan_mission(arguments) : plan_on_map(arguments);
}

}  // namespace dive::mission
