#pragma once
// From one frame of features to updates of the state: an MSCKF (Mourikis and Roumeliotis 2007, "A
// multi-state constraint Kalman filter for vision-aided inertial navigation", ICRA) with a few
// landmarks in the state (Li and Mourikis 2013, "Optimization-based estimator design", RSS).
//
// The window keeps clones some distance apart, and the newest: at 0.4 m/s eleven successive frames
// would be a baseline of only 0.2 m. A track is used once, when it is lost or when the oldest clone
// leaves; a track still observed then may become a landmark of the state instead.

#include <optional>
#include <span>
#include <vector>

#include "estimation/visual_inertial/filter/feature_tracks.h"
#include "estimation/visual_inertial/filter/feature_update.h"
#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/front_end/feature_frame.h"

namespace dive::estimation {

/// A landmark for the map of an unknown environment.
struct Landmark {
  std::int64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Covariance of p_W with the vehicle's.
};

struct VisualReport {
  int followed = 0;        ///< Tracked features of the frame.
  int ignored = 0;         ///< Outside the cameras' view, duplicate id, or beyond max_features.
  int used = 0;            ///< Tracks and landmarks that updated the state.
  int rejected = 0;        ///< Rejected by the gate.
  int untriangulated = 0;  ///< Tracks that could not be triangulated.
  double innovation_ratio = 0.0;  ///< Mean r^T S^-1 r over degrees of freedom of those used.
  std::vector<Landmark> landmarks;
};

class VisualUpdate {
 public:
  explicit VisualUpdate(const VisualInertialOptions& options);

  void reset() { tracks_.clear(); }
  /// Updates `state`, whose newest clone is the pose of `frame`, the `number`-th one,
  /// `since_last_s` seconds after the frame before it.
  VisualReport apply(FilterState& state, const FeatureFrame& frame, std::int64_t number,
                     double since_last_s);

 private:
  struct Candidate {
    const FeatureTrack* track;
    bool may_stay;  ///< Still observed: may become a landmark of the state.
    bool is_short;  ///< Used only where there are few others.
  };
  struct Gated;

  /// Uses what was tracked before a gap without frames, and begins again: no tracker follows a
  /// feature across one.
  void end_tracks_before_gap(FilterState& state, std::int64_t number, VisualReport& report);
  /// The observation with the cameras' Jacobians; empty if it is no image point of the cameras.
  void follow(const FilterState& state, const FeatureFrame& frame, std::int64_t number,
              VisualReport& report);
  void correct_landmarks(FilterState& state, std::int64_t number, VisualReport& report);
  [[nodiscard]] std::optional<std::size_t> leaving_clone(const FilterState& state) const;
  [[nodiscard]] std::vector<Candidate> candidates(const FilterState& state, std::int64_t number,
                                                  std::optional<std::size_t> leaving) const;
  void correct_tracks(FilterState& state, const std::vector<Candidate>& found,
                      VisualReport& report);
  [[nodiscard]] std::optional<Gated> gated(const FilterState& state, const FeatureTrack& track,
                                           VisualReport& report) const;
  void promote(FilterState& state, const FeatureTrack& track, std::int64_t number,
               VisualReport& report);
  void clean(FilterState& state, std::int64_t number, std::optional<std::size_t> leaving);
  [[nodiscard]] bool is_out(const Eigen::MatrixXd& S, const Eigen::VectorXd& r,
                            double& distance) const;

  VisualInertialOptions options_;
  double sigma_;  ///< Sigma of an image coordinate, pixels.
  FeatureTracks tracks_;
  std::vector<std::pair<std::size_t, TrackObservation>>
      landmark_observations_;  ///< Observations in this frame, by landmark.
  double distance_ = 0.0;      ///< Sum of r^T S^-1 r over the updates of this frame.
  double freedom_ = 0.0;       ///< Degrees of freedom of the updates of this frame.
};

}  // namespace dive::estimation
