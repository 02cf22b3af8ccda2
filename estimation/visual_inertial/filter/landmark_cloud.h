#pragma once
// The landmarks that the filter has estimated: each at its last position, with its covariance then.
// For the map of an unknown environment and for evaluation after the dive.
//
// A landmark's covariance in W contains the vehicle's own error, which the map shares. The map
// needs the rest, C - J P J^T, with P the covariance of the pose and J the Jacobian of a point
// fixed to the vehicle; for a landmark in the filter's state it can be negative, and is then zero.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter/visual_update.h"

namespace dive::estimation {

struct LandmarkCloudOptions {
  int max_landmarks = 50'000;  ///< At the limit the least recently observed is replaced.
  double noise_m = 0.02;       ///< Maximum sigma: noise_m + noise_square r^2, worst direction.
  double noise_square = 0.01;  ///< The same, 1/m; the map's limit for a stereo pair.
  double max_age_s = 2.0;      ///< Maximum age of landmarks in a scan.
  double reach_m = 10.0;       ///< Maximum range of a scan.

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

struct CloudLandmark {
  std::int64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Covariance of p_W.
  double sigma_m = 0.0;     ///< Sigma relative to the vehicle, in the worst direction.
  double distance_m = 0.0;  ///< Distance from the vehicle.
  Utime placed = 0;         ///< Time of the estimate, distance and sigma.
};

class LandmarkCloud {
 public:
  /// Demands options that validate.
  explicit LandmarkCloud(LandmarkCloudOptions options);

  /// Adds landmarks and the estimate of the filter after a frame. Values that are not finite are
  /// ignored.
  void add(const StateEstimate& estimate, std::span<const Landmark> landmarks);

  /// Applies a loop closure as in Mapper::move(): a landmark placed at t moves by correction(t).
  void move(const std::function<Pose(Utime)>& correction);

  /// Landmarks by increasing id.
  [[nodiscard]] const std::map<std::int64_t, CloudLandmark>& all() const { return landmarks_; }

  /// Recent and accurate landmarks, as measured from `eye_B` by a vehicle at X_WB; no ray marks
  /// free space.
  [[nodiscard]] RangeScan scan(Utime utime, const Pose& X_WB, const Eigen::Vector3d& eye_B) const;

  /// All accurate landmarks, as text in the PLY format: x y z, the upper triangle of the
  /// covariance, id, and time (s).
  [[nodiscard]] std::string to_ply() const;

 private:
  [[nodiscard]] bool is_good(const CloudLandmark& landmark) const;
  void drop_one();

  LandmarkCloudOptions options_;
  std::map<std::int64_t, CloudLandmark> landmarks_;
  std::map<std::pair<Utime, std::int64_t>, std::int64_t> by_age_;  ///< From (placed, id) to id.
};

}  // namespace dive::estimation
