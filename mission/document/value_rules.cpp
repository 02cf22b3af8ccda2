// Rules on positions, limits and times that exclude values impossible for this vehicle.
// mission/check has the rules that depend on the map.

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "mission/document/rule_set.h"
#include "mission/document/rules.h"
#include "mission/states/atomic_state.h"
#include "vehicle/speed_range.h"

namespace dive::mission {
namespace {

// Calls `visit` with the start and every goal whose depth follows from the document alone.
void for_each_depth(const Subject& subject,
                    const std::function<void(const std::string& name, const Position& position,
                                             double depth)>& visit) {
  const auto note = [&visit](const std::string& name, const Position& position) {
    if (position.z_units == ZUnits::kAltitude) return;
    visit(name, position,
          position.z_units == ZUnits::kDepth ? position.z.value : -position.z.value);
  };
  note("the start", subject.mission.start);
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const Goal* goal : goals_of(subject.index.spec(state))) {
      note(fmt::format("the goal '{}'", goal->id.value), goal->position);
    }
  }
}

// `name` is an attribute of <map> without effect unless fixes are used.
bool has_fixes_for(const char* name, const Span& span, const Subject& subject) {
  const Mission& mission = subject.mission;
  if (uses_map_fixes(mission)) return true;
  const bool has_tags = !mission.tags.empty();
  subject.error("MIS-NEEDS-FIXES", span,
                fmt::format("'{}' requires map fixes, which {}", name,
                            has_tags ? "a mission with tags does not use" : "are turned off"),
                fmt::format("remove {}, or '{}'", has_tags ? "the tags" : "fixes=\"off\"", name));
  return false;
}

}  // namespace

void speed_suits_the_vehicle(const Subject& subject) {
  const Located<double>& speed = subject.mission.speed;
  if (speed.value >= vehicle::kMinSpeed && speed.value <= vehicle::kMaxSpeed) return;
  subject.error("MIS-SPEED", speed.span,
                fmt::format("the aqua2 cannot swim {} m/s: it swims {} to {} m/s", speed.value,
                            vehicle::kMinSpeed, vehicle::kMaxSpeed));
}

void positions_are_under_water(const Subject& subject) {
  for_each_depth(subject, [&](const std::string& name, const Position& position, double depth) {
    if (depth >= 0.0) return;
    subject.error("MIS-ABOVE-SURFACE", position.z.span,
                  fmt::format("{} is {:g} m above the surface", name, -depth),
                  position.z_units == ZUnits::kDepth ? "a depth is positive down"
                                                     : "z is negative under water");
  });
}

void positions_respect_max_depth(const Subject& subject) {
  const Located<double>& limit = subject.mission.limits.max_depth;
  for_each_depth(subject, [&](const std::string& name, const Position& position, double depth) {
    if (depth <= limit.value) return;
    subject.error("MIS-TOO-DEEP", position.z.span,
                  fmt::format("{} is {:g} m deep, deeper than max_depth {:g} m ({})", name, depth,
                              limit.value, subject.mission.source.line_name(limit.span.line)));
  });
}

void altitudes_are_in_open_water(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (!spec.overhead) continue;
    for (const Goal* goal : goals_of(spec)) {
      if (goal->position.z_units != ZUnits::kAltitude) continue;
      subject.error(
          "MIS-ALTITUDE-OVERHEAD", goal->position.z.span,
          fmt::format("the goal '{}' is under an overhead, but given by altitude", goal->id.value),
          "altitude is measured from the first solid below the surface: use DEPTH");
    }
  }
}

void altitudes_have_known_ground(const Subject& subject) {
  if (!subject.mission.unknown) return;
  Span last;  // all goals of one transect have the same
  const auto check = [&](const std::string& name, const Position& position) {
    const Span& span = position.z.span;
    const bool is_reported = span.line == last.line && span.column == last.column;
    if (position.z_units != ZUnits::kAltitude || is_reported) return;
    last = span;
    subject.error("MIS-ALTITUDE-UNKNOWN", span,
                  fmt::format("{} uses ALTITUDE in an unknown environment", name),
                  "the ground is not known when the dive begins: use DEPTH");
  };
  check("the start", subject.mission.start);
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const Goal* goal : goals_of(subject.index.spec(state))) {
      check(fmt::format("the goal '{}'", goal->id.value), goal->position);
    }
  }
}

void mapping_cameras_are_used(const Subject& subject) {
  const Mission& mission = subject.mission;
  if (!maps_with_stereo(mission) || uses_visual_inertial(mission)) return;
  subject.error("MIS-MAPPING-SENSOR", mission.mapping_sensor->span,
                "the cameras map the environment, but the estimator does not use them",
                "write <estimation estimator=\"visual_inertial\"/>, or remove 'mapping_sensor'");
}

void information_is_available(const Subject& subject) {
  const std::optional<Span>& span = subject.mission.prefers_information;
  if (span && !subject.mission.unknown) {
    static_cast<void>(has_fixes_for("information", *span, subject));
  }
}

// Without fixes an object seems to be gone where the vehicle is lost; unless obstacles are mapped,
// nothing stops it where an object was removed by mistake.
void absence_can_be_observed(const Subject& subject) {
  const Mission& mission = subject.mission;
  if (!mission.trusts_absence || mission.unknown) return;
  if (!has_fixes_for("trust_absence", mission.trusts_absence_span, subject)) return;
  if (mapping_sensor(mission) == MappingSensor::kNone) {
    subject.error("MIS-ABSENCE", mission.trusts_absence_span,
                  "'trust_absence' requires a range sensor that maps, but mapping_sensor is none",
                  "remove mapping_sensor=\"none\", or 'trust_absence'");
  }
}

void surfacing_is_in_open_water(const Subject& subject) {
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    if (!spec.overhead || !is_surfacing(spec)) continue;
    subject.error(
        "MIS-SURFACE-OVERHEAD", spec.id.span,
        fmt::format("'{}' surfaces, but is declared to be under an overhead", spec.id.value),
        "leave the overhead first, and surface outside of that state");
  }
}

void limits_leave_clearance(const Subject& subject) {
  const Limits& limits = subject.mission.limits;
  if (limits.max_depth.value > limits.clearance.value) return;
  subject.error("MIS-LIMITS", limits.max_depth.span,
                fmt::format("a clearance of {:g} m to the surface leaves no space above max_depth "
                            "{:g} m",
                            limits.clearance.value, limits.max_depth.value),
                "raise max_depth or lower clearance");
}

void reduced_clearances_are_less(const Subject& subject) {
  const Mission& mission = subject.mission;
  const Located<double>& clearance = mission.limits.clearance;
  Span last;  // all goals of one transect have the same
  const auto check = [&](const std::optional<Located<double>>& reduced) {
    if (!reduced || reduced->value <= clearance.value) return;
    const Span& span = reduced->span;
    if (span.line == last.line && span.column == last.column) return;
    last = span;
    subject.error(
        "MIS-REDUCED-CLEARANCE", span,
        fmt::format("a reduced clearance of {:g} m is more than the clearance of {:g} m "
                    "({})",
                    reduced->value, clearance.value, mission.source.line_name(clearance.span.line)),
        "state the least clearance that the mission accepts where a leg starts");
  };
  check(mission.limits.reduced_clearance);
  for (int state = 0; state < subject.index.size(); ++state) {
    for (const Goal* goal : goals_of(subject.index.spec(state))) check(goal->reduced_clearance);
  }
}

void failsafes_bring_it_up(const Subject& subject) {
  using behaviors::FailsafeKind;
  for (const FailsafeKind kind : {FailsafeKind::kLeak, FailsafeKind::kBattery,
                                  FailsafeKind::kMissionTimeout, FailsafeKind::kOperatorAbort}) {
    const Failsafes& failsafes = subject.mission.failsafes;
    const std::optional<Span>& written = failsafes.written[static_cast<std::size_t>(kind)];
    if (!written || failsafes.policy(kind).rung >= behaviors::Rung::kRetrace) continue;
    subject.warning(
        "MIS-FAILSAFE", *written,
        fmt::format("'{}' does not bring the vehicle up: its rung is {}",
                    behaviors::to_string(kind), behaviors::to_string(failsafes.policy(kind).rung)),
        "use abort_and_surface");
  }
}

void tags_are_distinct(const Subject& subject) {
  const std::vector<TagSpec>& tags = subject.mission.tags;
  for (auto tag = tags.begin(); tag != tags.end(); ++tag) {
    const auto first = std::find_if(
        tags.begin(), tag, [&](const TagSpec& other) { return other.id.value == tag->id.value; });
    if (first == tag) continue;
    subject.error("MIS-TAG-DUPLICATE", tag->id.span,
                  fmt::format("tag {} is already defined ({})", tag->id.value,
                              subject.mission.source.line_name(first->id.span.line)),
                  "two tags with one id cannot be distinguished: print another");
  }
}

void tags_can_be_used(const Subject& subject) {
  const Mission& mission = subject.mission;
  for (const TagSpec& tag : mission.tags) {
    const std::string name = fmt::format("the tag {}", tag.id.value);
    if (!uses_visual_inertial(mission)) {
      subject.error("MIS-TAG-UNUSED", tag.id.span, name + " is not used by the primitive estimator",
                    "write estimator=\"visual_inertial\"");
    } else if (mission.unknown) {
      subject.error(
          "MIS-TAG-UNUSED", tag.id.span, name + " is in an unknown environment",
          "there the position is relative to the observed map, which tags would contradict");
    }
    if (tag.position.z_units == ZUnits::kAltitude) continue;
    const double z = tag.position.in_world(0.0).z();
    if (z <= 0.0) continue;
    subject.error("MIS-ABOVE-SURFACE", tag.position.z.span,
                  fmt::format("{} is {:g} m above the surface", name, z));
  }
}

void times_fit_into_the_mission(const Subject& subject) {
  const Located<double>& limit = subject.mission.limits.mission_timeout;
  for (int state = 0; state < subject.index.size(); ++state) {
    const StateSpec& spec = subject.index.spec(state);
    const Timeout* timeout = state_timeout(spec);
    const Located<double> time = timeout != nullptr ? timeout->seconds
                                 : spec.atomic      ? spec.atomic->rest_s()
                                                    : Located<double>();
    if (time.value <= limit.value) continue;
    subject.warning(
        "MIS-TIME", time.span,
        fmt::format("the timeout of '{}' is {:g} s, longer than the whole mission ({:g} s, {})",
                    spec.id.value, time.value, limit.value,
                    subject.mission.source.line_name(limit.span.line)));
  }
}

}  // namespace dive::mission
