#include "mission/export/read_exported.h"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "estimation/state_estimate.h"
#include "mission/document/state_index.h"
#include "mission/record/log.h"
#include "mission/record/replay.h"
#include "mission/states/atomic_state.h"
#include "planning/world/sdf.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMaxTriangles = 200'000;
constexpr Utime kPeriod = kMicrosecondsPerSecond / 10;

Eigen::Vector3d place_of(const Position& position, const planning::Scene& scene) {
  return position.in_world(ground_height(scene, position));
}

// What mission and map say, without a plan.
Exported described(const Mission& mission, const planning::World& world,
                   const std::optional<GeoPoint>& map_origin) {
  Exported exported;
  exported.name = mission.id;
  exported.origin = mission.origin ? std::optional(mission.origin->place) : map_origin;
  const planning::Scene scene(world);
  exported.places.push_back({"start", "start", place_of(mission.start, scene)});
  const StateIndex index(mission);
  for (int state = 0; state < index.size(); ++state) {
    for (const Goal* goal : goals_of(index.spec(state))) {
      exported.places.push_back({"goal", goal->id.value, place_of(goal->position, scene)});
    }
  }
  for (const TagSpec& tag : mission.tags) {
    exported.places.push_back(
        {"tag", fmt::format("tag {}", tag.id.value), place_of(tag.position, scene)});
  }
  for (const auto& [x, y] : mission.failsafes.fence) {
    exported.fence.emplace_back(x.value, y.value);
  }
  exported.map = drawn_world(world, kMaxTriangles);
  return exported;
}

// x, y, z, and the quaternion x, y, z, w.
std::optional<Pose> waypoint_of(const nlohmann::ordered_json& json) {
  constexpr double kMaxNormError = 1e-3;
  if (!json.is_array() || json.size() != 7) return std::nullopt;
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!json[i].is_number()) return std::nullopt;
    v[i] = json[i].get<double>();
  }
  const Pose pose{{v[0], v[1], v[2]}, Eigen::Quaterniond(v[6], v[3], v[4], v[5])};
  const bool is_pose = pose.is_finite() && std::abs(pose.q.norm() - 1.0) < kMaxNormError;
  return is_pose ? std::optional(Pose{pose.p, pose.q.normalized()}) : std::nullopt;
}

std::string text_of(const nlohmann::ordered_json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

class LogCollector {
 public:
  explicit LogCollector(Exported& exported) : exported_(exported) {}

  void tick(const LoggedTick& tick) {
    const Utime now = tick.inputs.now;
    if (next_ == 0) exported_.begin = next_ = now;
    const double t_s = to_seconds(now - exported_.begin);
    if (tick.inputs.health) battery_ = tick.inputs.health->battery_fraction;
    plan(tick, t_s);
    for (const TransitionRecord& record : tick.outputs.transitions) {
      exported_.events.push_back(
          {t_s, false, fmt::format("{} -> {}: {}", record.from, record.to, record.cause)});
    }
    for (const FailsafeRecord& record : tick.outputs.failsafes) {
      exported_.events.push_back(
          {t_s, true, fmt::format("rung {}: {}: {}", record.rung, record.cause, record.why)});
    }
    if (now < next_) return;
    next_ = now + kPeriod;
    exported_.track.push_back(sample(tick, t_s));
  }

 private:
  void plan(const LoggedTick& tick, double t_s) {
    if (tick.outputs.plan_query) {
      asked_ = {tick.outputs.plan_query->id, tick.outputs.plan_query->state,
                tick.outputs.status.goal};
    }
    if (!tick.inputs.plan || !tick.inputs.plan->plan.accepted) return;
    const PlanReply& reply = *tick.inputs.plan;
    const bool is_asked = reply.id == asked_.id;
    exported_.paths.push_back({is_asked ? asked_.state : std::string(),
                               is_asked ? asked_.goal : std::string(), t_s, reply.plan.waypoints,
                               reply.plan.clearance_m});
  }

  [[nodiscard]] ExportedSample sample(const LoggedTick& tick, double t_s) const {
    const StepOutputs& outputs = tick.outputs;
    ExportedSample sample;
    sample.t_s = t_s;
    if (outputs.estimate.valid) {
      sample.estimate = outputs.estimate.X_WB;
      sample.sigma_m = estimation::horizontal_sigma(outputs.estimate);
      sample.depth_m = -outputs.estimate.X_WB.p.z();
      sample.speed_mps = outputs.estimate.v_WB_B.norm();
    }
    if (tick.truth) {
      sample.truth = tick.truth->X_WB;
      sample.depth_m = -tick.truth->X_WB.p.z();
    }
    sample.command_mps = outputs.command.v;
    sample.command_depth_m = outputs.command.d;
    sample.battery = battery_;
    if (outputs.status.clearance_m > 0.0) sample.clearance_m = outputs.status.clearance_m;
    sample.cross_track_m = outputs.status.cross_track_m;
    sample.state = outputs.status.state;
    sample.goal = outputs.status.goal;
    sample.rung = outputs.status.rung;
    return sample;
  }

  struct Asked {
    std::int64_t id = -1;
    std::string state;
    std::string goal;
  };

  Exported& exported_;
  Utime next_ = 0;
  double battery_ = ExportedSample::kUnknown;
  Asked asked_;
};

}  // namespace

Exported exported_mission(const Mission& mission, const planning::World& world,
                          const std::vector<PlannedRouteLeg>& legs,
                          const std::optional<GeoPoint>& map_origin) {
  Exported exported = described(mission, world, map_origin);
  for (const PlannedRouteLeg& leg : legs) {
    if (!leg.plan.accepted) continue;
    exported.paths.push_back({leg.state, leg.goal, 0.0, leg.plan.waypoints, leg.plan.clearance_m});
  }
  return exported;
}

tl::expected<Exported, std::string> exported_log(
    const std::string& path, const std::function<void(double share)>& progress) {
  tl::expected<LogReader, std::string> log = LogReader::open(path);
  if (!log) return tl::unexpected(log.error());
  const auto error = [&](const std::string& what) {
    return tl::unexpected(fmt::format("{}: {}", path, what));
  };
  if (!log->header()) return error("the log's header is damaged, so that its mission is not known");
  const LogHeader& header = *log->header();
  const tl::expected<LoggedDive, std::string> logged = logged_dive(header);
  if (!logged) return error(logged.error());
  std::optional<GeoPoint> map_origin;
  if (!header.map_xml.empty()) {
    Diagnostics ignored;  // they were shown before the dive
    map_origin = planning::sdf_origin(SourceText(header.map_name, header.map_xml), ignored);
  }
  Exported exported = described(logged->mission, logged->map, map_origin);
  log->observe(progress);
  LogCollector collector(exported);
  while (const std::optional<LoggedTick> tick = log->next()) collector.tick(*tick);
  if (exported.track.empty()) return error("the log contains no complete tick");
  return exported;
}

tl::expected<Exported, std::string> exported_plan(std::string name,
                                                  const nlohmann::ordered_json& plan) {
  Exported exported;
  exported.name = std::move(name);
  std::size_t number = 0;
  for (const auto& leg : plan.at("plans")) {
    ++number;
    const auto waypoints = leg.find("waypoints");
    if (waypoints == leg.end() || !waypoints->is_array()) {
      return tl::unexpected(fmt::format("path {} has no list of waypoints", number));
    }
    ExportedPath path{text_of(leg, "state"), text_of(leg, "goal"), 0.0, {}, 0.0};
    if (const auto clearance = leg.find("clearance_m");
        clearance != leg.end() && clearance->is_number()) {
      path.clearance_m = clearance->get<double>();
    }
    for (const auto& each : *waypoints) {
      const std::optional<Pose> pose = waypoint_of(each);
      if (!pose) {
        return tl::unexpected(
            fmt::format("path {}: waypoint {} is not x, y, z and a unit quaternion x, y, z, w",
                        number, path.waypoints.size() + 1));
      }
      path.waypoints.push_back(*pose);
    }
    if (!path.waypoints.empty()) exported.paths.push_back(std::move(path));
  }
  if (exported.paths.empty()) return tl::unexpected(std::string("no path was found in this plan"));
  return exported;
}

Exported exported_map(std::string name, const planning::World& world) {
  Exported exported;
  exported.name = std::move(name);
  exported.map = drawn_world(world, kMaxTriangles);
  return exported;
}

Exported exported_cloud(std::string name, planning::CloudFile cloud) {
  Exported exported;
  exported.name = std::move(name);
  exported.cloud = std::move(cloud.points);
  exported.cloud_origin = cloud.origin;
  return exported;
}

}  // namespace dive::mission
