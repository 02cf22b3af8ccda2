#pragma once
// Observations from the clones of each landmark that is not in the state. Bounded: as many tracks
// as one frame has features, and those lost in it; as many observations each as there are clones.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

/// Image coordinates in one frame, normalised and, by camera, in pixels.
struct TrackObservation {
  std::int64_t frame = 0;
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
  /// d pixel / d n of the left and of the right camera there: the noise of a pixel is the same all
  /// over the image, that of n is not.
  std::array<Eigen::Matrix2d, 2> to_pixels{Eigen::Matrix2d::Identity(),
                                           Eigen::Matrix2d::Identity()};
  std::array<Eigen::Vector2d, 2> pixel{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  /// From the frame's time to the exposure of the row, by camera, s.
  std::array<double, 2> row_s{};
};

/// The observation of a feature in a frame by these cameras, left first. Empty if it is not finite
/// or no camera has an image there.
[[nodiscard]] std::optional<TrackObservation> observation_of(const FeatureObservation& feature,
                                                             std::int64_t frame,
                                                             std::span<const CameraModel> cameras);

struct FeatureTrack {
  std::int64_t id = 0;
  std::int64_t last_frame = 0;                 ///< Last frame with an observation.
  std::vector<TrackObservation> observations;  ///< Observations in the order of frames.
};

class FeatureTracks {
 public:
  void add(std::int64_t id, const TrackObservation& observation);
  /// Removes the observations from a dropped clone.
  void forget_frame(std::int64_t frame);
  void forget(std::int64_t id) { tracks_.erase(id); }
  /// Keeps the track without the observations used in an update.
  void use_up(std::int64_t id);
  /// Removes tracks without an observation in `frame`.
  void forget_lost(std::int64_t frame);
  void clear() { tracks_.clear(); }
  /// Tracks in the order of their ids.
  [[nodiscard]] const std::map<std::int64_t, FeatureTrack>& all() const { return tracks_; }

 private:
  std::map<std::int64_t, FeatureTrack> tracks_;
};

}  // namespace dive::estimation
