#pragma once
// One scan from one pose: the range in every direction.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/range_scan.h"
#include "common/se3.h"

namespace dive::planning {

/// Ranges by azimuth and elevation about the sensor, in bins as wide as the scan is dense.
class RangeImage {
 public:
  RangeImage() = default;
  /// `scan` taken at X_WB. Points that are not finite are left out.
  RangeImage(const RangeScan& scan, const Pose& X_WB);

  /// True if the scan passed p_W and its surroundings by at least `margin` m, so that p_W is free.
  [[nodiscard]] bool is_passed(const Eigen::Vector3f& p_W, float margin) const;
  /// True if the ray in exactly that direction passed p_W.
  [[nodiscard]] bool is_in_view(const Eigen::Vector3f& p_W) const;

  /// Number of points in the bins around point i of the scan at about the same range, 0 for a
  /// particle: a point nearby with nothing beside it, too small to be an obstacle. At the edge of
  /// the view of a scan without gaps it is scaled up by the bins that lie outside: an obstacle of
  /// which a row of pixels is visible is one.
  [[nodiscard]] int neighbours(std::size_t i) const { return neighbours_[i]; }
  /// The same, scaled likewise, among the points that are `marked` (one entry for each point of
  /// `scan`), one for each bin.
  [[nodiscard]] int marked_neighbours(const RangeScan& scan, std::size_t i,
                                      const std::vector<bool>& marked) const;
  /// Distance of point i from the sensor, m; NaN if the ray gave no range.
  [[nodiscard]] float range(std::size_t i) const { return ranges_[i]; }

  /// Unit normal, of either sign, of the surface at point i of `scan`, the scan that this was made
  /// from. Absent if the adjacent points of the image are not at about the same range.
  [[nodiscard]] std::optional<Eigen::Vector3f> normal_B(const RangeScan& scan, std::size_t i) const;

  [[nodiscard]] const Eigen::Vector3f& origin_W() const { return origin_W_; }
  [[nodiscard]] const Pose& X_WB() const { return X_WB_; }
  [[nodiscard]] float reach() const { return reach_; }
  [[nodiscard]] Utime utime() const { return utime_; }
  /// Moves the scan to a corrected pose of the vehicle.
  void move(const Pose& X_WB);
  /// Discards the data of single points; the ranges by direction remain.
  void forget_points();

 private:
  [[nodiscard]] int bin(const Eigen::Vector3f& direction_B) const;
  /// Calls visit(b) for `bin` and its up to eight neighbours.
  template <typename Visit>
  void around(std::size_t bin, Visit visit) const;
  /// m between the range of point i and that of a point of the same surface.
  [[nodiscard]] float alike_m(std::size_t i) const;
  /// `count` in a bin and its neighbours, `in_view` of which are, as if all of them were.
  [[nodiscard]] int scaled_up(int count, int in_view) const;
  [[nodiscard]] bool is_observed(std::size_t bin) const { return ranges_by_bin_[bin] >= 0.0F; }
  void count_neighbours(std::span<const int> bins);
  void leave_out_particles(const RangeScan& scan, std::span<const int> bins);
  void spread();

  Pose X_WB_;
  Eigen::Matrix3f R_BW_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f origin_B_ = Eigen::Vector3f::Zero();
  Eigen::Vector3f origin_W_ = Eigen::Vector3f::Zero();
  float reach_ = 0.0F;
  Utime utime_ = 0;
  bool has_gaps_ = false;  ///< Many rays gave no range, as those of a stereo pair.
  int columns_ = 0;
  int rows_ = 0;
  std::vector<float> ranges_by_bin_;  ///< Nearest range by bin, m; negative if not observed.
  std::vector<int> point_of_;   ///< Index of that point in the scan, by bin; negative if none.
  std::vector<float> nearest_;  ///< Nearest range over the bin and its neighbours, m.
  std::vector<float> ranges_;
  std::vector<int> neighbours_;
};

}  // namespace dive::planning
