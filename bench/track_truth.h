#pragma once
// Where the features that a tracker follows truly are: each is the point of the world that it was
// first seen at.

#include <cstdint>
#include <map>
#include <vector>

#include "common/camera_model.h"
#include "common/random.h"
#include "estimation/visual_inertial/feature_frame.h"
#include "planning/world/world.h"
#include "vehicle/simulator/traced_world.h"

namespace dive::bench {

class TrackTruth {
 public:
  /// Left and right.
  TrackTruth(const planning::World& world, const CameraModel& left, const CameraModel& right);

  /// Ids start anew.
  void begin_dive() { seen_.clear(); }
  /// What was tracked in a picture taken at X_WB.
  void add(const estimation::FeatureFrame& frame, const Pose& X_WB);
  /// The features of a frame that has been added where they truly are, with white noise of `sigma`
  /// pixels; those of nothing solid are left out.
  [[nodiscard]] estimation::FeatureFrame moved_to_truth(const estimation::FeatureFrame& frame,
                                                        const Pose& X_WB, double sigma,
                                                        Random& random) const;
  void print() const;

 private:
  struct Seen {
    bool is_solid = false;
    Eigen::Vector3d p_W;
    std::int64_t first = 0;
  };
  struct StereoError {
    double depth;           // m
    Eigen::Vector2d error;  // px, right as seen from left
  };

  [[nodiscard]] Seen first_sight(const Eigen::Vector2d& n, const Pose& X_WC) const;
  void print_stereo() const;

  vehicle::TracedWorld world_;
  CameraModel left_;
  CameraModel right_;
  std::int64_t pictures_ = 0;
  std::map<std::int64_t, Seen> seen_;  // of this dive
  std::int64_t tracks_ = 0, solid_ = 0;
  std::map<int, std::vector<double>> by_age_;  // px, per axis
  std::map<int, std::vector<double>> steps_;   // px, of the error over so many pictures
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> now_;  // px, picture by picture
  std::vector<StereoError> stereo_;
};

}  // namespace dive::bench
