#include "mission/report/plan_report.h"

#include <filesystem>

#include <fmt/format.h>

#include "mission/report/sha256.h"

namespace dive::mission {

Report report_of_plan(const Mission& mission, std::string_view map, const planning::World& world,
                      const vehicle::Model& model, const std::vector<PlannedRouteLeg>& legs,
                      std::uint64_t seed) {
  Report report;
  report.title = fmt::format("{}: plan", mission.id);
  report.mission = mission.id;
  report.description = mission.description;
  report.seed = seed;
  report.map_is_simulated = mission.unknown.has_value();
  report.files.push_back({"mission",
                          std::filesystem::path(mission.source.path()).filename().string(),
                          sha256(mission.source.content())});
  if (!map.empty()) report.files.push_back({"map", mission.map_file.value, sha256(map)});
  report.files.push_back({"vehicle", model.name, sha256(vehicle::aqua2_urdf().content())});
  report.clearance_required_m = mission.limits.clearance.value;
  report.max_depth_m = mission.limits.max_depth.value;
  // In a current the length does not give the time.
  if (mission.current.value.is_still()) report.speed_mps = mission.speed.value;
  report.world = world;
  report.hull = model.hull;
  for (const PlannedRouteLeg& leg : legs) {
    ReportPath path;
    path.id = static_cast<std::int64_t>(report.paths.size()) + 1;
    path.state = leg.state;
    path.goal = leg.goal;
    path.time_ms = leg.statistics.total_ms;
    path.plan = leg.plan;
    report.paths.push_back(std::move(path));
  }
  return report;
}

}  // namespace dive::mission
