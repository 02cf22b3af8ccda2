#pragma once
// Ground truth of tracked features: each is the point of the world at which it was first observed.

#include <cstdint>
#include <map>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"
#include "planning/world/world.h"
#include "vehicle/simulator/ray_tracing/traced_world.h"

namespace dive::bench {

class TrackTruth {
 public:
  /// `left` and `right`: the cameras of the pair.
  TrackTruth(const planning::World& world, const CameraModel& left, const CameraModel& right);

  /// Starts a dive: feature ids begin again.
  void begin_dive() { seen_.clear(); }
  /// Adds the features tracked in an image taken at X_WB.
  void add(const estimation::FeatureFrame& frame, const Pose& X_WB);
  /// The features of an added frame at their true positions, with white noise of `sigma` pixels;
  /// those that are not on a solid are left out.
  [[nodiscard]] estimation::FeatureFrame moved_to_truth(const estimation::FeatureFrame& frame,
                                                        const Pose& X_WB, double sigma,
                                                        Random& random) const;
  void print() const;

 private:
  struct Observation {
    bool is_solid = false;
    Eigen::Vector3d p_W;
    std::int64_t first = 0;
  };
  struct StereoError {
    double depth;           // m
    Eigen::Vector2d error;  // px, right relative to left
  };

  [[nodiscard]] Observation first_observation(const Eigen::Vector2d& n, const Pose& X_WC) const;
  void print_stereo() const;

  vehicle::TracedWorld world_;
  CameraModel left_;
  CameraModel right_;
  std::int64_t images_ = 0;
  std::map<std::int64_t, Observation> seen_;  // features observed in this dive, by id
  std::int64_t tracks_ = 0, solid_ = 0;
  std::map<int, std::vector<double>> by_age_;  // px, per axis
  std::map<int, std::vector<double>> steps_;   // px, change of the error over this many images
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> now_;  // px, by image
  std::vector<StereoError> stereo_;
};

}  // namespace dive::bench
