#include "mission/simulation/contacts.h"

#include <limits>
#include <utility>

namespace dive::mission {

Contacts::Contacts(const vehicle::TriangulatedWorld& world, const planning::RobotHull& hull,
                   const std::optional<vehicle::DiverTrack>& diver, const Pose& X_MW)
    : hull_(hull), world_(world, hull), X_MW_(X_MW) {
  if (!diver) return;
  diver_.emplace(*diver);
  planning::World alone;
  alone.obstacles.push_back(vehicle::Diver::shape());
  to_diver_.emplace(alone, hull);
}

void Contacts::add(std::span<const AppearingObstacle> appeared) {
  planning::World world;
  world.obstacles = as_obstacles(appeared, appeared_count_);
  appeared_count_ += world.obstacles.size();
  appeared_.emplace_back(world, hull_);
}

std::vector<std::string> Contacts::observe(Utime now, const Pose& X_WB) {
  std::vector<std::string> contacts;
  observe(world_, X_WB, now, X_WB, contacts);
  for (vehicle::ClearanceMeter& meter : appeared_) observe(meter, X_WB, now, X_WB, contacts);
  if (diver_) {
    diver_->advance(now, X_WB.p);
    observe(*to_diver_, diver_->pose().inverse() * X_WB, now, X_WB, contacts);
  }
  return contacts;
}

void Contacts::observe(vehicle::ClearanceMeter& meter, const Pose& X_OB, Utime now,
                       const Pose& X_WB, std::vector<std::string>& contacts) {
  for (std::string& name : meter.observe(X_OB)) contacts.push_back(std::move(name));
  if (meter.min_clearance_m() >= nearest_.clearance_m) return;
  nearest_ = {meter.min_clearance_m(), to_seconds(now), X_MW_ * X_WB.p, meter.nearest_obstacle()};
}

double Contacts::diver_clearance_m() const {
  return to_diver_ ? to_diver_->min_clearance_m() : std::numeric_limits<double>::infinity();
}

std::optional<Pose> Contacts::diver() const {
  return diver_ ? std::optional(diver_->pose()) : std::nullopt;
}

}  // namespace dive::mission
