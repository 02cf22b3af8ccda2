#include "mission/check/check_context.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "planning/world/overhead.h"
#include "planning/world/primitives.h"
#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

using planning::Contact;

constexpr int kHeadings = 90;  // tried where a goal leaves the heading open

// Maximum distance of a hull point from its position at the nearest heading tried, per radius.
const double kHeadingError = 2.0 * std::sin(std::acos(-1.0) / kHeadings / 2.0);

}  // namespace

CheckContext::CheckContext(const Mission& whole, const planning::World& solid,
                           const planning::RobotHull& hull, Diagnostics& diagnostics)
    : mission(whole),
      world(solid),
      index(whole),
      flow(whole, index),
      reachable(whole, index, flow),
      scene_(solid),
      hull_(hull.hull_vertices()),
      radius_(hull.radius()),
      placed_(hull_.size()),
      diagnostics_(diagnostics) {}

std::vector<NamedGoal> CheckContext::goals() const {
  std::vector<NamedGoal> goals = {{"the start", &mission.start, mission.start_heading_deg, true}};
  for (int state = 0; state < index.size(); ++state) {
    const StateSpec& spec = index.spec(state);
    for (const Goal* goal : goals_of(spec)) {
      NamedGoal named{
          fmt::format("the goal '{}'", goal->id.value), &goal->position, {}, spec.overhead};
      if (goal->heading_deg) named.heading_deg = goal->heading_deg->value;
      if (goal->dwell_heading_deg) named.heading_deg = goal->dwell_heading_deg;
      goals.push_back(std::move(named));
    }
  }
  return goals;
}

std::optional<Eigen::Vector3d> CheckContext::in_world(const Position& position) const {
  if (position.z_units != ZUnits::kAltitude) return position.in_world(0.0);
  const std::optional<double> floor_z =
      ground_below(Eigen::Vector3d(position.x.value, position.y.value, 0.0));
  if (!floor_z) return std::nullopt;
  return position.in_world(*floor_z);
}

std::optional<double> CheckContext::ground_below(const Eigen::Vector3d& p_W) const {
  return planning::ground_below(scene_, p_W);
}

std::optional<Contact> CheckContext::nearest(const Eigen::Vector3d& p_W,
                                             const std::optional<double>& heading_deg,
                                             double cutoff) {
  if (scene_.point_distance(p_W) > cutoff + radius_) return std::nullopt;
  if (heading_deg) return nearest_at(p_W, heading_to_yaw(*heading_deg), cutoff);
  if (mission.attitude != planning::AttitudeMode::kHorizontal) return nearest_to_centre(p_W);
  std::optional<Contact> best;
  for (int i = 0; i < kHeadings; ++i) {
    const std::optional<Contact> contact =
        nearest_at(p_W, deg_to_rad(i * 360.0 / kHeadings), cutoff);
    if (!contact) return std::nullopt;
    if (!best || contact->distance > best->distance) best = contact;
  }
  best->distance += radius_ * kHeadingError;
  return best;
}

std::optional<Contact> CheckContext::nearest_at(const Eigen::Vector3d& p_W, double yaw,
                                                double cutoff) {
  const Pose pose{p_W, from_rpy(0.0, 0.0, yaw)};
  std::transform(hull_.begin(), hull_.end(), placed_.begin(),
                 [&pose](const Eigen::Vector3d& vertex_B) { return pose * vertex_B; });
  scene_.contacts(placed_, cutoff, contacts_);
  const auto nearest =
      std::min_element(contacts_.begin(), contacts_.end(),
                       [](const Contact& a, const Contact& b) { return a.distance < b.distance; });
  if (nearest == contacts_.end()) return std::nullopt;
  return *nearest;
}

// The vehicle's centre stays there at every roll and pitch.
Contact CheckContext::nearest_to_centre(const Eigen::Vector3d& p_W) const {
  Contact nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < world.obstacles.size(); ++i) {
    const planning::Obstacle& obstacle = world.obstacles[i];
    const double distance =
        planning::signed_distance(obstacle.shape, obstacle.X_WO.inverse() * p_W);
    if (distance >= nearest.distance) continue;
    nearest.distance = distance;
    nearest.obstacle = static_cast<int>(i);
  }
  return nearest;
}

int CheckContext::overhead(const Eigen::Vector3d& p_W) const {
  planning::PlanView scratch;
  for (std::size_t i = 0; i < world.obstacles.size(); ++i) {
    if (planning::is_above(world.obstacles[i], p_W, radius_, scratch)) return static_cast<int>(i);
  }
  return -1;
}

const std::string& CheckContext::obstacle_name(int obstacle) const {
  return world.obstacles.at(static_cast<std::size_t>(obstacle)).name;
}

void CheckContext::error(const char* code, Span span, std::string message, std::string hint) {
  diagnostics_.error(code, mission.source, span, std::move(message), std::move(hint));
}

void CheckContext::warning(const char* code, Span span, std::string message, std::string hint) {
  diagnostics_.warning(code, mission.source, span, std::move(message), std::move(hint));
}

}  // namespace dive::mission
