#include "mission/onboard/settings.h"

#include "mission/executive/behavior_factory.h"
#include "mission/states/atomic_state.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

constexpr double kMinMapMove = 0.03;  // m: moving the map builds all its surfaces again

constexpr double kGraceSeconds = 120.0;  // for an abort that starts when the time is up

}  // namespace

std::string OnboardSettings::validate() const {
  if (planner_latency_ticks < 1) return "planner_latency_ticks must be at least 1";
  if (mapper_latency_ticks < 1) return "mapper_latency_ticks must be at least 1";
  if (fix_latency_ticks < 1) return "fix_latency_ticks must be at least 1";
  if (vision_latency_ticks < 1) return "vision_latency_ticks must be at least 1";
  if (loop_latency_ticks < 1) return "loop_latency_ticks must be at least 1";
  if (std::string problem = mapper.validate(); !problem.empty()) return problem;
  return planner.validate();
}

double longest_dive_s(const Mission& mission) {
  return 1.5 * mission.limits.mission_timeout.value + kGraceSeconds;
}

std::vector<Tag> known_tags(const Mission& mission, const planning::World& world) {
  std::vector<Tag> tags;
  if (mission.tags.empty()) return tags;
  const planning::Scene scene(world);
  for (const TagSpec& spec : mission.tags) {
    Tag tag;
    tag.id = spec.id.value;
    tag.size_m = spec.size_m;
    tag.X_WT.p = spec.position.in_world(ground_height(scene, spec.position));
    tag.X_WT.q = tag_attitude(heading_to_yaw(spec.heading_deg), deg_to_rad(spec.pitch_deg),
                              deg_to_rad(spec.roll_deg));
    tag.sigma_m = spec.sigma_m;
    tag.sigma_deg = spec.sigma_deg;
    tags.push_back(tag);
  }
  return tags;
}

std::optional<LoopSettings> loop_settings(const Mission& mission, Utime latency) {
  if (!mission.closes_loops || !mission.tags.empty()) return std::nullopt;
  LoopSettings settings;
  settings.moves_map = mission.unknown.has_value();
  if (settings.moves_map) settings.closer.min_move_m = kMinMapMove;
  settings.latency = latency;
  return settings;
}

}  // namespace dive::mission
