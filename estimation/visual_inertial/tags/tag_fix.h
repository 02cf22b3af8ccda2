#pragma once
// Position fixes by tags at known poses. Derivation: doc/visual-inertial/tags.md.
//
// The filter does not receive them. The estimate is the map <- odom correction of its poses about
// the vertical, as for closed loops, and beside that each tag's error against the mission: a tag
// surveyed wrongly by 2 cm is wrong by 2 cm however often it is observed.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/tag.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/loop_closure/loop_correction.h"
#include "estimation/visual_inertial/tags/tag_detector.h"

namespace dive::estimation {

struct TagFixOptions {
  double corner_sigma_px = 0.5;  ///< Sigma along each axis, including the camera model's error.
  double misshapen_px = 1.0;     ///< Maximum RMS of the corners against a square of that size.
  double gate_sigma = 3.5;       ///< Gate as a normal's quantile.
  double apart_s = 0.5;          ///< Minimum time between two used observations of a tag.

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

using Vector8d = Eigen::Matrix<double, 8, 1>;

/// The corners of a tag in the image, and their Jacobians: by the vehicle's position and heading,
/// by its roll and pitch (about x and y of W), by the tag's position and attitude (about the axes
/// of W).
struct TagView {
  Vector8d z;  ///< [x/z, y/z] per corner.
  Eigen::Matrix<double, 8, 4> by_vehicle;
  Eigen::Matrix<double, 8, 2> by_tilt;
  Eigen::Matrix<double, 8, 6> by_tag;
};

/// Empty if a corner is not in front of the camera.
[[nodiscard]] std::optional<TagView> view_tag(const Pose& X_WB, const Pose& X_WT, double size_m,
                                              const Pose& X_BC);

class TagFix {
 public:
  /// Demands tags of different ids, with a size, and options that validate.
  TagFix(std::vector<Tag> tags, const CameraModel& camera, const TagFixOptions& options);

  /// Called when the filter was re-initialised from the published estimate.
  void restart();
  /// Processes the tags observed in an image; `filter` is the filter's estimate at that time, not
  /// before the last one. Returns the result for the most relevant tag.
  TagObservation add(const StateEstimate& filter, std::span<const DetectedTag> detected);
  /// The filter's estimate at the last add() or later, corrected by the tags. Unchanged before the
  /// first accepted tag.
  [[nodiscard]] StateEstimate apply(const StateEstimate& filter) const;

 private:
  struct Known {
    Tag tag;  ///< X_WT as estimated so far.
    std::optional<Utime> used;
  };
  struct Solution;
  struct Corners;

  void carry_to(const StateEstimate& filter);
  [[nodiscard]] TagObservation add_one(const StateEstimate& filter, Known& known, int at,
                                       const DetectedTag& detected);
  [[nodiscard]] Corners corners_of(const StateEstimate& filter, const DetectedTag& detected) const;
  [[nodiscard]] std::optional<Solution> solve(const Known& known, int at, const Corners& measured,
                                              Solution from) const;
  [[nodiscard]] std::vector<Solution> solve_all(const StateEstimate& filter, const Known& known,
                                                int at, const DetectedTag& detected,
                                                std::span<const Pose> poses_WB) const;
  [[nodiscard]] TagResult check(std::span<const Solution> found) const;
  void correct(const Solution& solution, int at, const Pose& filter);
  [[nodiscard]] Pose vehicle() const { return correction_.correction * correction_.filter; }

  std::vector<Known> tags_;
  CameraModel camera_;
  TagFixOptions options_;
  /// Covariance of the errors [p, heading of the vehicle | p, rotation vector in W per tag].
  Eigen::MatrixXd P_;
  LoopCorrection correction_;  ///< Correction as of the last add().
  bool has_fix_ = false;
  bool begins_anew_ = false;
};

}  // namespace dive::estimation
