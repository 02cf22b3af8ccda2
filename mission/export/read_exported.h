#pragma once
// What `dive export` writes, from the files that it reads.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

#include "mission/check/route_plan.h"
#include "mission/document/mission.h"
#include "mission/export/exported.h"
#include "planning/cloud/cloud_file.h"
#include "planning/world/scene.h"

namespace dive::mission {

/// The places of a mission, with all goals, and the planned legs. `map_origin`: the origin that its
/// map states, for a mission that states none.
[[nodiscard]] Exported exported_mission(const Mission& mission, const planning::World& world,
                                        const std::vector<PlannedRouteLeg>& legs,
                                        const std::optional<GeoPoint>& map_origin);

/// The dive of a log: one sample in a tenth of a second, plans, transitions, rungs. A damaged log
/// gives what is left of it. The error is a sentence with the path: the log cannot be read, its
/// header is damaged, or it contains no tick. `progress` is called with the share that was read; it
/// may be empty.
[[nodiscard]] tl::expected<Exported, std::string> exported_log(
    const std::string& path, const std::function<void(double share)>& progress);

/// The paths of a plan's JSON with its list "plans", without a map. The error is a sentence: a path
/// or a waypoint is not as `dive plan --json` prints it, or there is no path.
[[nodiscard]] tl::expected<Exported, std::string> exported_plan(std::string name,
                                                                const nlohmann::ordered_json& plan);

[[nodiscard]] Exported exported_map(std::string name, const planning::World& world);

[[nodiscard]] Exported exported_cloud(std::string name, planning::CloudFile cloud);

}  // namespace dive::mission
