#pragma once
// Contacts of the true vehicle in a simulated dive, with three sources: the world, obstacles that
// have appeared since the dive began, and a diver.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/clock.h"
#include "mission/record/collision.h"
#include "mission/simulation/appearing_obstacle.h"
#include "planning/world/world.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::mission {

class Contacts {
 public:
  /// The hull must outlive this object. `X_MW`: from the simulated world to the map, to which
  /// nearest() refers.
  Contacts(const vehicle::TriangulatedWorld& world, const planning::RobotHull& hull,
           const std::optional<vehicle::DiverTrack>& diver, const Pose& X_MW);

  /// Adds obstacles from now on, with the names that as_obstacles() gives them.
  void add(std::span<const AppearingObstacle> appeared);
  /// Number of obstacles added so far.
  [[nodiscard]] std::size_t appeared() const { return appeared_count_; }
  /// Moves the diver and evaluates the pose of one tick. Returns the names of the obstacles with
  /// which a contact begins.
  std::vector<std::string> observe(Utime now, const Pose& X_WB);

  [[nodiscard]] const NearestApproach& nearest() const { return nearest_; }
  /// Smallest distance to the diver; infinite without one.
  [[nodiscard]] double diver_clearance_m() const;
  /// X_WD, if there is a diver.
  [[nodiscard]] std::optional<Pose> diver() const;

 private:
  void observe(vehicle::ClearanceMeter& meter, const Pose& X_OB, Utime now, const Pose& X_WB,
               std::vector<std::string>& contacts);

  const planning::RobotHull& hull_;
  vehicle::ClearanceMeter world_;
  /// One meter for each add(), so that contacts persist.
  std::vector<vehicle::ClearanceMeter> appeared_;
  std::size_t appeared_count_ = 0;  ///< Number of obstacles in them.
  std::optional<vehicle::Diver> diver_;
  std::optional<vehicle::ClearanceMeter> to_diver_;
  Pose X_MW_;
  NearestApproach nearest_;
};

}  // namespace dive::mission
