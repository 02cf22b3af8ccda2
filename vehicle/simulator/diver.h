#pragma once
// A diver who swims into the vehicle's path.
//
// A ClearanceMeter (ground_truth.h) measures the clearance between the two, on a world that holds
// only Diver::shape(), at the relative pose X_DB = X_WD^-1 X_WB.

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

/// A diver's route: straight from waypoint to waypoint, ending at the last. Walls are ignored.
struct DiverTrack {
  struct Waypoint {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< Position of the diver's centre, m.
    double pause_s = 0.0;                           ///< Time spent at the waypoint.
  };
  std::vector<Waypoint> waypoints = {};
  double speed = 0.5;    ///< m/s.
  double start_s = 0.0;  ///< Time of departure from the first waypoint.
  double keeps_m = 1.5;  ///< Minimum distance from the vehicle's origin to the diver's skin.

  /// A description of the first error; empty if the track is usable.
  [[nodiscard]] std::string validate() const;
};

/// Frame D: centre of a capsule, x along its axis towards the head and always level, z up. The
/// diver turns on the spot towards the next waypoint; directly above or below the next one the
/// heading stays. Nothing is random.
class Diver {
 public:
  static constexpr double kRadius = 0.3;  ///< m
  static constexpr double kLength = 1.2;  ///< Length of the cylindrical part, m.

  /// Demands a track that validates.
  explicit Diver(DiverTrack track);

  /// Moves the diver until `now`, beside a vehicle at `vehicle_W` (finite). A diver whose next move
  /// would come nearer to the vehicle than keeps_m waits, without limit; moves away are always
  /// made. An earlier `now` than before changes nothing.
  void advance(Utime now, const Eigen::Vector3d& vehicle_W);

  /// X_WD after the last advance().
  [[nodiscard]] const Pose& pose() const { return now_.X_WD; }

  /// The capsule in D.
  [[nodiscard]] static planning::Obstacle shape();

 private:
  struct Progress {
    Pose X_WD;
    std::size_t next = 1;  // next waypoint
    double pause_s = 0.0;  // rest of the pause at the previous waypoint
  };

  void face(Progress& progress) const;
  [[nodiscard]] Progress after(double dt) const;

  DiverTrack track_;
  Utime utime_;
  Progress now_;
};

}  // namespace dive::vehicle
