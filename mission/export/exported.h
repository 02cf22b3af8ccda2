#pragma once
// What `dive export` writes, in the conventions of the project: W is ENU with z up, SI units, times
// since the dive began. Every format is made from this.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/geodesy.h"
#include "common/se3.h"
#include "mission/document/mission.h"
#include "mission/drawing/drawn_mesh.h"

namespace dive::mission {

/// A position that the mission names.
struct ExportedPlace {
  std::string kind;  ///< "start", "goal" or "tag".
  std::string name;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
};

/// A planned path.
struct ExportedPath {
  std::string state;
  std::string goal;
  double t_s = 0.0;             ///< When the plan arrived; 0 in the plan of a mission.
  std::vector<Pose> waypoints;  ///< X_WB
  double clearance_m = 0.0;     ///< Certified.
};

/// One moment of a dive. NaN: not known.
struct ExportedSample {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double t_s = 0.0;
  std::optional<Pose> truth;     ///< True X_WB.
  std::optional<Pose> estimate;  ///< Estimated X_WB.
  double sigma_m = kUnknown;     ///< estimation::horizontal_sigma()
  double depth_m = kUnknown;     ///< Of the true pose, else of the estimated.
  double speed_mps = kUnknown;   ///< Estimated speed over ground.
  double command_mps = 0.0;      ///< Commanded forward speed.
  double command_depth_m = 0.0;
  double battery = kUnknown;      ///< Fraction of the charge.
  double clearance_m = kUnknown;  ///< Certified clearance of the path being followed.
  double cross_track_m = 0.0;     ///< Estimated distance to the line that is followed.
  std::string state;
  std::string goal;
  std::string rung;
};

/// A transition or a change of the failsafe ladder, as a sentence.
struct ExportedEvent {
  double t_s = 0.0;
  bool is_failsafe = false;
  std::string text;
};

struct Exported {
  std::string name;                ///< Of the mission, the map or the cloud.
  std::optional<GeoPoint> origin;  ///< Place of x = y = 0.
  std::vector<ExportedPlace> places;
  std::vector<Eigen::Vector2d> fence;  ///< Corners of the geofence; empty: none.
  std::vector<ExportedPath> paths;
  Utime begin = 0;                    ///< Time of t_s = 0 by the vehicle's clock.
  std::vector<ExportedSample> track;  ///< Ascending.
  std::vector<ExportedEvent> events;  ///< Ascending.
  DrawnMesh map;
  std::vector<Eigen::Vector3f> cloud;  ///< Relative to `cloud_origin`.
  Eigen::Vector3d cloud_origin = Eigen::Vector3d::Zero();
};

/// Compass heading (true) of the bow, in [0, 360).
[[nodiscard]] inline double heading_deg(const Pose& X_WB) {
  return compass_heading_deg(90.0 - rad_to_deg(to_rpy(X_WB.q).z()));
}

}  // namespace dive::mission
