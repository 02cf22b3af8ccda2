#pragma once
// Where the vehicle is, by tags whose places are known. Derivation: doc/visual-inertial/tags.md.
//
// The filter is told nothing of it. What is estimated is how its poses lie in W, about the
// vertical, as closed loops are told of, and beside that how far each tag is from where the mission
// has it: a tag that was surveyed wrongly by 2 cm is wrong by 2 cm however often it is seen.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/tag.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/loop_correction.h"
#include "estimation/visual_inertial/tag_detector.h"

namespace dive::estimation {

struct TagFixOptions {
  double corner_sigma_px = 0.5;  ///< Along each axis, what the camera's model errs by included.
  double misshapen_px = 1.0;     ///< RMS of the corners: no square of that size looks like that.
  double gate_sigma = 3.5;       ///< As a normal's quantile.
  double apart_s = 0.5;          ///< Between two sights of a tag that are news.

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

using Vector8d = Eigen::Matrix<double, 8, 1>;

/// The corners of a tag as the camera sees them, and by what errors they move: of the vehicle's
/// position and heading, of its roll and pitch (about x and y of W), of the tag's position and
/// attitude (about the axes of W).
struct TagView {
  Vector8d z;  ///< [x/z, y/z] per corner.
  Eigen::Matrix<double, 8, 4> by_vehicle;
  Eigen::Matrix<double, 8, 2> by_tilt;
  Eigen::Matrix<double, 8, 6> by_tag;
};

/// Nothing where a corner is not before the camera.
[[nodiscard]] std::optional<TagView> view_tag(const Pose& X_WB, const Pose& X_WT, double size_m,
                                              const Pose& X_BC);

class TagFix {
 public:
  /// Demands tags of different ids, with a size, and options that validate.
  TagFix(std::vector<Tag> tags, const CameraModel& camera, const TagFixOptions& options);

  /// The filter has begun anew, from what was published.
  void restart();
  /// What is seen in a picture; `filter` is the filter's estimate of that moment, not before the
  /// last one. Says of the tag that matters most what became of it.
  TagSight see(const StateEstimate& filter, std::span<const SeenTag> seen);
  /// The filter's estimate of the last see() or later, as the tags have it. Before the first that
  /// was believed: unchanged.
  [[nodiscard]] StateEstimate apply(const StateEstimate& filter) const;

 private:
  struct Known {
    Tag tag;  ///< X_WT: as estimated so far.
    std::optional<Utime> used;
  };
  struct Solution;

  void carry_to(const StateEstimate& filter);
  [[nodiscard]] TagSight see_one(const StateEstimate& filter, Known& known, int at,
                                 const SeenTag& seen);
  [[nodiscard]] std::optional<Solution> solve(const Known& known, int at, const Vector8d& z,
                                              const Eigen::Matrix2d& tilt, Solution from) const;
  [[nodiscard]] std::vector<Solution> solve_all(const StateEstimate& filter, const Known& known,
                                                int at, const SeenTag& seen,
                                                std::span<const Pose> poses_WB) const;
  [[nodiscard]] TagVerdict judge(std::span<const Solution> found) const;
  void correct(const Solution& solution, int at, const Pose& filter);
  [[nodiscard]] Pose vehicle() const { return correction_.correction * correction_.filter; }

  std::vector<Known> tags_;
  CameraModel camera_;
  TagFixOptions options_;
  double sigma_;  ///< Of a corner, normalised.
  /// Of the errors [p, heading of the vehicle | p, rotation vector in W per tag].
  Eigen::MatrixXd P_;
  LoopCorrection correction_;  ///< As of the last see().
  bool has_fix_ = false;
  bool begins_anew_ = false;
};

}  // namespace dive::estimation
