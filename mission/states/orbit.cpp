#include "mission/states/orbit.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "behaviors/orbit.h"
#include "mission/document/state_reader.h"

namespace dive::mission {
namespace {

// Degrees: the line between two stations comes no nearer to the centre than 0.7 of the radius.
constexpr double kMaxSpacing = 90.0;
constexpr double kSampleStep = 0.2;  // m along that line

Eigen::Vector2d towards(double compass_deg) {
  const double yaw = heading_to_yaw(compass_deg);
  return {std::cos(yaw), std::sin(yaw)};
}

}  // namespace

double OrbitSpec::spacing_deg() const {
  return arc_deg ? *arc_deg / (stations.value - 1.0) : 360.0 / stations.value;
}

OrbitState::OrbitState(OrbitSpec spec, const Located<std::string>& id) : orbit_(std::move(spec)) {
  const double step = orbit_.is_clockwise ? orbit_.spacing_deg() : -orbit_.spacing_deg();
  for (int k = 0; k < static_cast<int>(orbit_.stations.value); ++k) {
    const double bearing = compass_heading_deg(orbit_.first_bearing_deg + k * step);
    const Eigen::Vector2d offset = orbit_.radius.value * towards(bearing);
    Goal goal;
    goal.id = {fmt::format("{}-{}", id.value, k + 1), id.span};
    goal.position = orbit_.centre;
    goal.position.x = {orbit_.centre.x.value + offset.x(), orbit_.radius.span};
    goal.position.y = {orbit_.centre.y.value + offset.y(), orbit_.radius.span};
    goal.capture_radius = orbit_.capture_radius;
    goal.dwell_s = orbit_.dwell_s;
    goal.dwell_heading_deg = compass_heading_deg(bearing + 180.0);
    goal.reduced_clearance = orbit_.reduced_clearance;
    goal.span = id.span;
    stations_.push_back(std::move(goal));
  }
}

std::vector<const Goal*> OrbitState::goals() const {
  std::vector<const Goal*> goals;
  for (const Goal& station : stations_) goals.push_back(&station);
  return goals;
}

Located<double> OrbitState::rest_s() const {
  return {orbit_.stations.value * behaviors::kStationTurnSeconds, orbit_.stations.span};
}

void OrbitState::check(const Mission& mission, const StateSpec& spec,
                       Diagnostics& diagnostics) const {
  const double spacing = orbit_.spacing_deg();
  if (spacing <= kMaxSpacing) return;
  const double gaps = std::ceil(orbit_.arc_deg.value_or(360.0) / kMaxSpacing);
  diagnostics.error(
      "MIS-ORBIT-SPACING", mission.source, orbit_.stations.span,
      fmt::format("the stations of '{}' are {:g} degrees apart, more than {:g}: between two of "
                  "them the vehicle would come within {:.2f} m of the centre",
                  spec.id.value, spacing, kMaxSpacing,
                  orbit_.radius.value * std::max(0.0, std::cos(deg_to_rad(0.5 * spacing)))),
      fmt::format("write stations=\"{:g}\" or more", orbit_.arc_deg ? gaps + 1.0 : gaps));
}

void OrbitState::check_in_map(const Mission& mission, const StateSpec& spec,
                              MapContext& map) const {
  const double needed = map.hull_radius() + mission.limits.clearance.value;
  if (orbit_.radius.value < needed) {
    map.error("CHK-ORBIT-RADIUS", orbit_.radius.span,
              fmt::format("at {:g} m from the centre of '{}' the bow comes nearer to it than the "
                          "clearance of {:g} m ({})",
                          orbit_.radius.value, spec.id.value, mission.limits.clearance.value,
                          mission.source.line_name(mission.limits.clearance.span.line)),
              fmt::format("write radius=\"{:.2f}\" or more", std::ceil(needed * 100.0) / 100.0));
  }
  for (std::size_t i = 1; i < stations_.size(); ++i) check_path_between(i, spec, map);
}

// `station`: index of the one that the line leads to. Obstacles beside the line are the planner's.
void OrbitState::check_path_between(std::size_t station, const StateSpec& spec,
                                    MapContext& map) const {
  const auto from_W = map.in_world(stations_[station - 1].position);
  const auto to_W = map.in_world(stations_[station].position);
  if (!from_W || !to_W) return;
  const Eigen::Vector3d motion = *to_W - *from_W;
  const double heading = compass_heading_deg(90.0 - rad_to_deg(std::atan2(motion.y(), motion.x())));
  const int pieces = std::max(1, static_cast<int>(std::ceil(motion.norm() / kSampleStep)));
  for (int k = 0; k <= pieces; ++k) {
    const auto contact =
        map.nearest(*from_W + static_cast<double>(k) / pieces * motion, heading, kSampleStep);
    if (!contact || contact->distance > 0.0) continue;
    map.error(
        "CHK-ORBIT-CHORD", orbit_.stations.span,
        fmt::format("the straight line from station {} to station {} of '{}' cuts through "
                    "'{}'",
                    station, station + 1, spec.id.value, map.obstacle_name(contact->obstacle)),
        "write more stations, a larger radius or another first_bearing_deg");
    return;
  }
}

std::unique_ptr<behaviors::Behavior> OrbitState::make_behavior(const BehaviorSetup& setup) const {
  const behaviors::OrbitCircle circle{{orbit_.centre.x.value, orbit_.centre.y.value},
                                      orbit_.radius.value};
  return std::make_unique<behaviors::Orbit>(setup.leg, circle, leg_goals(setup.scene, stations_),
                                            first_goal(setup, stations_.size()));
}

void read_orbit(const XmlElement& element, const StateReader& reader, StateSpec& spec) {
  const AttributeReader& attributes = reader.attributes();
  OrbitSpec orbit;
  orbit.centre = attributes.position(element);
  orbit.radius = attributes.number(element, "radius");
  orbit.stations = attributes.number(element, "stations");
  orbit.first_bearing_deg = attributes.number(element, "first_bearing_deg").value;
  orbit.is_clockwise = attributes.name(element, "direction").value == "cw";
  if (const auto arc = attributes.optional_number(element, "arc_deg")) orbit.arc_deg = arc->value;
  orbit.dwell_s = attributes.number(element, "dwell");
  orbit.capture_radius = attributes.number(element, "capture_radius");
  orbit.reduced_clearance = attributes.optional_number(element, "reduced_clearance");
  spec.atomic = std::make_shared<OrbitState>(std::move(orbit), spec.id);
}

}  // namespace dive::mission
