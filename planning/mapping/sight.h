#pragma once
// One sweep as it was seen from one place: how far it was looked in every direction.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/range_scan.h"
#include "common/se3.h"

namespace dive::planning {

/// Distances by azimuth and elevation about the sensor, in bins as wide as the sweep is dense.
class Sight {
 public:
  Sight() = default;
  /// `scan` as seen from X_WB. Points that are not finite are left out.
  Sight(const RangeScan& scan, const Pose& X_WB);

  /// Is there water at p_W: was it looked past it and its surroundings, by at least `margin` m?
  [[nodiscard]] bool is_past(const Eigen::Vector3f& p_W, float margin) const;
  /// Was it looked as far as p_W, in that very direction?
  [[nodiscard]] bool has_seen(const Eigen::Vector3f& p_W) const;

  /// How many of the points in the bins around point i of the sweep are about as far away; 0 for a
  /// point of a speck: something near, with nothing beside it, that is too small to be hit.
  [[nodiscard]] int neighbours(std::size_t i) const { return neighbours_[i]; }
  /// Distance of point i from the sensor; NaN where the ray told nothing.
  [[nodiscard]] float range(std::size_t i) const { return ranges_[i]; }

  /// Of the surface about point i of `scan`, the sweep that this was made of: along one way or the
  /// other, unit. Nothing where what is beside it in the picture is not about as far away.
  [[nodiscard]] std::optional<Eigen::Vector3f> normal_B(const RangeScan& scan, std::size_t i) const;

  [[nodiscard]] const Eigen::Vector3f& origin_W() const { return origin_W_; }
  [[nodiscard]] const Pose& X_WB() const { return X_WB_; }
  [[nodiscard]] float reach() const { return reach_; }
  [[nodiscard]] Utime utime() const { return utime_; }
  /// The same sweep from where the vehicle is thought to have been now.
  void move(const Pose& X_WB);
  /// Forgets what was kept of single points: what is left is a look around.
  void forget_points();

 private:
  [[nodiscard]] int bin(const Eigen::Vector3f& direction_B) const;
  /// Calls visit(b) for `bin` and the up to eight around it.
  template <typename Visit>
  void around(std::size_t bin, Visit visit) const;
  void count_neighbours(std::span<const int> bins);
  void leave_out_specks(const RangeScan& scan, std::span<const int> bins);
  void spread();

  Pose X_WB_;
  Eigen::Matrix3f R_BW_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f origin_B_ = Eigen::Vector3f::Zero();
  Eigen::Vector3f origin_W_ = Eigen::Vector3f::Zero();
  float reach_ = 0.0F;
  Utime utime_ = 0;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<float> told_;     ///< Nearest, by bin; negative: not looked at.
  std::vector<int> point_of_;   ///< Which point of the sweep that was; negative: none.
  std::vector<float> nearest_;  ///< The same as told_, the neighbours of the bin included.
  std::vector<float> ranges_;
  std::vector<int> neighbours_;
};

}  // namespace dive::planning
