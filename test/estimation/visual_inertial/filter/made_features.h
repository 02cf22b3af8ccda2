#pragma once
// Features of random points, as one camera or two would track them along a path: with noise, losses
// and drifting particles. Shares no code with the filter.

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::testing {

struct MadeFeatureOptions {
  int features = 200;        ///< Tracked at a time.
  double snow_share = 0.0;   ///< Fraction of them that drift through the water.
  double loss_share = 0.01;  ///< Fraction of the tracks lost from one frame to the next.
  double pixel_sigma = 0.7;
  double near_m = 2.0;  ///< Range of the points when they are made.
  double far_m = 6.0;
};

class MadeFeatures {
 public:
  /// True pose of B, that many seconds after an image's time.
  using Motion = std::function<Pose(double seconds)>;

  /// `nominal`: cameras as configured in the filter, with pinholes or ideal equidistant lenses;
  /// `truth`: as they are.
  MadeFeatures(const MadeFeatureOptions& options, std::vector<CameraModel> nominal,
               std::vector<CameraModel> truth, Random& random);

  /// Adds a point before the camera at that pose.
  void add_point_before(const Pose& X_WB);
  /// All that is seen at that time; `utime`: by any clock, for the particles' motion.
  [[nodiscard]] std::vector<estimation::FeatureObservation> observe(const Motion& X_WB_after,
                                                                    Utime utime);

  /// True if a feature's id belongs to a moving object.
  [[nodiscard]] static bool is_snow(std::int64_t id) { return id >= kSnow; }
  [[nodiscard]] Eigen::Vector3d landmark(std::int64_t id) const {
    return points_[points_of_.at(id)];
  }

 private:
  static constexpr std::int64_t kSnow = 1'000'000'000;
  struct Flake {
    Eigen::Vector3d p_W;
    Eigen::Vector3d v_W;
    Utime utime;
  };

  [[nodiscard]] bool sees(const Pose& X_WB, const Eigen::Vector3d& p_W, std::size_t camera,
                          Eigen::Vector2d& pixel) const;
  [[nodiscard]] Eigen::Vector3d random_point_before(const Pose& X_WB, double near, double far);
  void follow_points(const Pose& X_WB, std::size_t wanted);
  void follow_snow(const Pose& X_WB, Utime utime, std::size_t wanted);
  [[nodiscard]] estimation::FeatureObservation feature(const Motion& X_WB_after, std::int64_t id,
                                                       const Eigen::Vector3d& p_W);

  MadeFeatureOptions options_;
  std::vector<CameraModel> nominal_;
  std::vector<CameraModel> true_;
  Random& random_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<bool> is_followed_;
  std::map<std::int64_t, std::size_t> points_of_;  ///< All ids used so far.
  std::map<std::int64_t, std::size_t> followed_;
  std::map<std::int64_t, Flake> flakes_;
  std::int64_t next_id_ = 1;
};

}  // namespace dive::testing
