#pragma once
// Loop closure: keyframes of the filter's way, and where one of them is seen again. A false closure
// is worse than none, so one is believed only if
//
//   - it may be that place: the poses say so, within their covariance;
//   - it looks like it (descriptors), and enough points all over the picture agree on one pose;
//   - roll and pitch agree with gravity's, and position and heading with the filter's, by a gate;
//   - no other place fits as well;
//   - the keyframe before it said the same.
//
// What is believed goes into a pose graph (pose_graph.h). Off the critical path: add() takes values
// and may run on a worker; what it returns is applied on the control thread. The same calls give
// the same results, and memory is bounded.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/keyframe.h"
#include "estimation/visual_inertial/loop_correction.h"
#include "estimation/visual_inertial/pose_graph.h"
#include "estimation/visual_inertial/relative_pose.h"

namespace dive::estimation {

struct LoopCloserOptions {
  double keyframe_m = 0.6;      ///< A keyframe is due when so far from the last,
  double keyframe_deg = 25.0;   ///< or turned by so much.
  int max_keyframes = 600;      ///< Beyond that the least useful is forgotten.
  double least_gap_s = 20.0;    ///< Places seen less long ago are no loop.
  double view_m = 2.5;          ///< So far apart two keyframes may show the same,
  double view_deg = 50.0;       ///< and so much turned.
  int likeness_points = 80;     ///< Clearest points, of which ...
  int fewest_alike = 12;        ///< ... so many must have a like one.
  int most_bits = 60;           ///< Of 256, in which like ones differ.
  int max_candidates = 5;       ///< Whose geometry is looked at.
  int fewest_points = 25;       ///< RelativePoseOptions
  double fewest_share = 0.4;    ///< RelativePoseOptions
  int fewest_cells = 5;         ///< RelativePoseOptions
  double pixels_then = 0.7;     ///< One sigma of a stereo pair's points,
  double pixels_now = 2.0;      ///< and of the same points found again.
  double optimism = 2.0;        ///< Errors are so many times what the points say,
  double least_sigma_m = 0.01;  ///< and no less than that
  double least_sigma_deg = 0.15;
  double tilt_deg = 3.0;  ///< Roll and pitch agree so well.
  double gate = 16.25;    ///< chi^2 of 4 degrees of freedom: 0.27 % exceed it.
  bool has_depth = true;  ///< PoseGraph

  /// What is wrong with them, for people; empty when they are usable.
  [[nodiscard]] std::string validate() const;
  /// Whether `now` is so far from the last keyframe that one is due.
  [[nodiscard]] bool is_far(const Pose& last, const Pose& now) const;
};

/// What became of the last keyframe, for logs.
struct LoopReport {
  int keyframes = 0;
  int candidates = 0;         ///< Places that it may be, and looks like.
  int verified = 0;           ///< Of them, with a pose that enough points agree on.
  int refused = 0;            ///< Of those, by gravity or the gate.
  bool is_ambiguous = false;  ///< Two places fit.
  bool is_waiting = false;    ///< One fits; the next keyframe must say the same.
};

class LoopCloser {
 public:
  /// Demands options and cameras that validate.
  LoopCloser(LoopCloserOptions options, const CameraModel& left, const CameraModel& right);

  /// Whether the filter, where it is now, is so far from the last keyframe that one is due.
  [[nodiscard]] bool is_due(const StateEstimate& filter) const;

  /// A keyframe, when one is due: what was seen, and the filter's estimate of that moment, without
  /// any correction. What comes back replaces the correction that was applied until now.
  std::optional<LoopCorrection> add(PlaceView view, const StateEstimate& filter);

  /// The cameras as the filter has calibrated them since, left and right: what is added from now on
  /// was seen by these.
  void calibrate(const Pose& X_BL, const Pose& X_BR);

  /// The filter has begun anew: nothing leads from before to now.
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
  void make_room();

  LoopCloserOptions options_;
  Pose X_BC_;
  Pose X_RL_;
  RelativePoseOptions relative_;
  PoseGraph graph_;
  std::vector<PlaceView> views_;  ///< Of the graph's nodes.
  std::vector<Pose> applied_;     ///< The correction under which what was seen there was put.
  Pose correction_;               ///< Applied now.
  std::optional<Closing> pending_;
  LoopReport report_;
};

}  // namespace dive::estimation
