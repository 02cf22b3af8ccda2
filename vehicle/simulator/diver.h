#pragma once
// A diver who swims into the vehicle's path.
//
// The clearance between the two is a ClearanceMeter's (ground_truth.h) on a world that holds only
// Diver::shape(), observed at X_DB = X_WD^-1 X_WB.

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

/// Where a diver swims: straight from waypoint to waypoint, and no farther than the last. Walls are
/// not asked.
struct DiverTrack {
  struct Waypoint {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< Of the diver's middle, m.
    double pause_s = 0.0;                           ///< Spent there.
  };
  std::vector<Waypoint> waypoints = {};
  double speed = 0.5;    ///< m/s.
  double start_s = 0.0;  ///< The diver is at the first waypoint, at rest, until then.
  double keeps_m =
      1.5;  ///< From the vehicle's origin to the diver's skin: never less by own doing.

  /// What is wrong with it, for people; empty when it can be swum.
  [[nodiscard]] std::string validate() const;
};

/// Frame D: the middle of a capsule, x along its axis towards the head and always level, z up. It
/// turns on the spot, to where the next waypoint lies; above or below another waypoint it keeps its
/// heading. Nothing in it is random.
class Diver {
 public:
  static constexpr double kRadius = 0.3;  ///< m
  static constexpr double kLength = 1.2;  ///< m, of the cylindrical part.

  /// Demands a track that validates.
  explicit Diver(DiverTrack track);

  /// Swims on until `now`, beside a vehicle that is at `vehicle_W` (finite). A diver whose next
  /// move would bring it nearer to the vehicle than keeps_m waits, as long as it takes; moves that
  /// lead away are always made. An earlier `now` than before changes nothing.
  void advance(Utime now, const Eigen::Vector3d& vehicle_W);

  /// X_WD after the last advance().
  [[nodiscard]] const Pose& pose() const { return now_.X_WD; }

  /// The capsule in D.
  [[nodiscard]] static planning::Obstacle shape();

 private:
  struct Progress {
    Pose X_WD;
    std::size_t next = 1;  // waypoint ahead
    double pause_s = 0.0;  // left of the pause at the one behind
  };

  void face(Progress& progress) const;
  [[nodiscard]] Progress after(double dt) const;

  DiverTrack track_;
  Utime utime_;
  Progress now_;
};

}  // namespace dive::vehicle
