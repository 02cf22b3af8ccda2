#pragma once
// What the filter has placed, kept: each landmark where it was last placed, with the covariance it
// had then. For the map of unknown water, and for who looks at a dive afterwards.
//
// A landmark's covariance in W holds the vehicle's own error, which the map shares with it. What
// counts for the map is the rest, C - J P J^T, with P that of the pose and J that of a point fixed
// to the vehicle; of a landmark in the filter's state it can be less than nothing, and is nothing.

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
#include "estimation/visual_inertial/visual_update.h"

namespace dive::estimation {

struct LandmarkCloudOptions {
  int max_landmarks = 50'000;  ///< The one not seen for longest leaves for a new one.
  double noise_m = 0.02;       ///< No less sure than noise_m + noise_square r^2 (one sigma, worst
  double noise_square = 0.01;  ///< direction, 1/m): what the map takes of a stereo pair.
  double max_age_s = 2.0;      ///< Of those in a scan.
  double reach_m = 10.0;       ///< Of a scan.

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
};

struct CloudLandmark {
  std::int64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of p_W.
  double sigma_m = 0.0;     ///< Against the vehicle, in the worst direction.
  double distance_m = 0.0;  ///< From the vehicle.
  Utime placed = 0;         ///< When; distance and sigma are of then.
};

class LandmarkCloud {
 public:
  /// Demands options that validate.
  explicit LandmarkCloud(LandmarkCloudOptions options);

  /// As the filter had them, and itself, after a frame. What is not finite is left out.
  void add(const StateEstimate& estimate, std::span<const Landmark> landmarks);

  /// A loop was closed, as Mapper::move() has it: what was placed at t was really at correction(t)
  /// times where it was put.
  void move(const std::function<Pose(Utime)>& correction);

  /// By id, rising.
  [[nodiscard]] const std::map<std::int64_t, CloudLandmark>& all() const { return landmarks_; }

  /// Those placed lately and well enough, as a vehicle at X_WB would measure them from `eye_B`; no
  /// ray tells that it is free.
  [[nodiscard]] RangeScan scan(Utime utime, const Pose& X_WB, const Eigen::Vector3d& eye_B) const;

  /// All that were placed well enough, as text in the PLY format: x y z, the upper triangle of the
  /// covariance, id, and when they were placed (s).
  [[nodiscard]] std::string to_ply() const;

 private:
  [[nodiscard]] bool is_good(const CloudLandmark& landmark) const;
  void make_room();

  LandmarkCloudOptions options_;
  std::map<std::int64_t, CloudLandmark> landmarks_;
  std::map<std::pair<Utime, std::int64_t>, std::int64_t> by_age_;  ///< (placed, id) to id.
};

}  // namespace dive::estimation
