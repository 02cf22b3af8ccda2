#pragma once
// Loop closure: keyframes along the filter's path, and the recognition of their places. A false
// closure is worse than none, so one is accepted only if
//
//   - the poses permit it, within their covariance;
//   - the appearance matches (descriptors), and enough points all over the image agree on one pose;
//   - roll and pitch agree with gravity's, and position and heading with the filter's, by a gate;
//   - no other place fits as well;
//   - the previous keyframe gave the same result.
//
// Accepted closures enter a pose graph (pose_graph.h). Off the critical path: add() takes values
// and may run on a worker; its result is applied on the control thread. Deterministic, with bounded
// memory.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/loop_closure/keyframe.h"
#include "estimation/visual_inertial/loop_closure/loop_correction.h"
#include "estimation/visual_inertial/loop_closure/pose_graph.h"
#include "estimation/visual_inertial/loop_closure/relative_pose.h"

namespace dive::estimation {

struct LoopCloserOptions {
  double keyframe_m = 0.6;     ///< Distance from the last keyframe at which one is due.
  double keyframe_deg = 25.0;  ///< Rotation from the last keyframe at which one is due.
  int max_keyframes = 600;     ///< Beyond it the least useful one is dropped.
  double min_gap_s = 20.0;     ///< Minimum time between the two observations of a loop.
  double view_m = 2.5;         ///< Maximum distance of keyframes with a common view.
  double view_deg = 50.0;      ///< Maximum rotation between them.
  int likeness_points = 80;    ///< Number of strongest points compared.
  int min_matches = 12;        ///< Minimum number of them with a similar point.
  int max_bits = 60;           ///< Maximum of 256 bits that differ in similar points.
  int max_candidates = 5;      ///< Maximum number of places verified by geometry.
  int min_points = 25;         ///< RelativePoseOptions
  double min_share = 0.4;      ///< RelativePoseOptions
  int min_cells = 5;           ///< RelativePoseOptions
  double pixels_then = 0.7;    ///< Sigma of the points in a stereo pair.
  double pixels_now = 2.0;     ///< Sigma of the same points found again.
  double optimism = 2.0;       ///< Actual errors over those computed from the points.
  double min_sigma_m = 0.01;   ///< Minimum position sigma.
  double min_sigma_deg = 0.15;
  double tilt_deg = 3.0;  ///< Maximum difference in roll and pitch.
  double gate = 16.25;    ///< chi^2 of 4 degrees of freedom: 0.27 % exceed it.
  bool has_depth = true;  ///< PoseGraph
  /// A result that moves no keyframe horizontally by this much is not applied: it waits until
  /// further loops add to it, m.
  double min_move_m = 0.0;

  /// A description of the first error; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
  /// True if `now` is so far from the last keyframe that one is due.
  [[nodiscard]] bool is_far(const Pose& last, const Pose& now) const;
};

/// Result for the last keyframe, for logs.
struct LoopReport {
  int keyframes = 0;
  int candidates = 0;         ///< Places possible by pose and similar in appearance.
  int verified = 0;           ///< Candidates with a pose on which enough points agree.
  int refused = 0;            ///< Verified ones rejected by gravity or the gate.
  bool is_ambiguous = false;  ///< Two places fit.
  bool is_waiting = false;    ///< One place fits; the next keyframe must confirm it.
};

class LoopCloser {
 public:
  /// Demands options and cameras that validate.
  LoopCloser(LoopCloserOptions options, const CameraModel& left, const CameraModel& right);

  /// True if the filter's pose is so far from the last keyframe that one is due.
  [[nodiscard]] bool is_due(const StateEstimate& filter) const;

  /// Adds a keyframe when one is due: the view, and the filter's estimate at that time without any
  /// correction. The result replaces the correction applied so far. A closure that would move the
  /// map beyond kMaxMapCorrection is refused.
  std::optional<LoopCorrection> add(KeyframeView view, const StateEstimate& filter);

  /// Sets the camera poses, left and right, as calibrated by the filter, for the views added from
  /// now on.
  void calibrate(const Pose& X_BL, const Pose& X_BR);

  /// Called on re-initialisation of the filter: nothing connects earlier poses with later ones.
  void restart();

  [[nodiscard]] const LoopReport& report() const { return report_; }
  [[nodiscard]] const PoseGraph& graph() const { return graph_; }

 private:
  struct Closing {
    GraphEdge edge;
    LoopClosure closure;
  };

  [[nodiscard]] std::vector<std::size_t> candidates() const;
  [[nodiscard]] std::optional<Closing> verify(std::size_t old);
  [[nodiscard]] Closing closing(std::size_t old, const RelativePose& relative) const;
  [[nodiscard]] bool has_right_tilt(const Closing& found) const;
  [[nodiscard]] bool passes_gate(const Closing& found) const;
  [[nodiscard]] bool agree(const Closing& a, const Closing& b) const;
  [[nodiscard]] std::optional<Closing> recognise();
  [[nodiscard]] std::optional<LoopCorrection> close(const Closing& found);
  [[nodiscard]] MapCorrection map_correction() const;
  [[nodiscard]] double largest_move() const;
  void drop_one();

  LoopCloserOptions options_;
  Pose X_BC_;
  Pose X_RL_;
  RelativePoseOptions relative_;
  PoseGraph graph_;
  std::vector<KeyframeView> views_;  ///< Views of the graph's nodes.
  /// Per node the correction with which its observations are placed; the last is that of now.
  std::vector<Pose> applied_;
  std::optional<Closing> pending_;
  LoopReport report_;
};

}  // namespace dive::estimation
