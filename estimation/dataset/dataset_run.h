#pragma once
// Runs an estimator on a recording as in a dive: the visual-inertial estimator is the pipeline of a
// dive, with its checks, restarts and expected speed (vision_pipeline.h).

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/run_health.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter/filter_options.h"
#include "estimation/visual_inertial/loop_closure/loop_correction.h"

namespace dive::estimation {

enum class RunStart {
  kImages,  ///< From the images, at rest or in motion.
  kTruth,   ///< Pose, velocity and biases from the recording's ground truth.
};

struct RunOptions {
  EstimatorKind estimator = EstimatorKind::kVisualInertial;
  RunStart start = RunStart::kImages;
  bool mono = false;      ///< Only the left camera of two.
  bool use_depth = true;  ///< Depth samples are used where there are any.
  bool loops = false;     ///< Loop closure; needs two cameras.
  /// Expected forward speed, m/s: of the primitive estimator (else 0.4) where none is measured, of
  /// kImages, and of the visual-inertial estimator in the dark.
  std::optional<double> speed;
  std::uint64_t seed = 1;

  [[nodiscard]] std::string validate() const;
};

struct DatasetRun {
  std::vector<StateEstimate> estimates;  ///< Valid estimates, one per image.
  /// The estimates corrected by the loops closed so far; empty without RunOptions::loops.
  std::vector<StateEstimate> corrected;
  int keyframes = 0;
  std::vector<LoopClosure> closures;  ///< Loop closures in the order of acceptance.
  std::vector<double> loop_ms;        ///< Time per keyframe, off the critical path.
  std::vector<double> frame_ms;       ///< Time of front end and filter per image, without decoding.
  int frames = 0;                     ///< Number of images since `begin`, used or not.
  RunHealth health;                   ///< Of the visual-inertial estimator.
  std::vector<CameraModel> cameras;   ///< With the intrinsics as it estimated them at the end.
  Utime begin = 0;                    ///< Time of the first image; earlier ones are left out.
  Diagnostics diagnostics;            ///< Warnings: images that were left out or not readable.
  double mean_features = 0.0;
  double began_s = 0.0;   ///< Time of the first estimate since `begin`.
  std::string waits_for;  ///< What the filter lacked at the end to begin; empty if it had begun.
};

/// Options for at most `cameras` of the dataset's cameras.
[[nodiscard]] VisualInertialOptions filter_options(const Recording& dataset, std::size_t cameras);

/// Empty if the recording has no ground truth.
[[nodiscard]] Trajectory true_trajectory(const Recording& dataset);

/// `clock` is used for timing only; `progress` receives the completed fraction from time to time.
/// An error is a recording that lacks required data: ground truth to start from, or images that can
/// be read. Without RunStart::kTruth the truth gives the position and heading at the start if it is
/// there by then; otherwise the estimates are moved to it at its first pose, by a translation and a
/// turn about the vertical, so that they can be compared with it.
[[nodiscard]] tl::expected<DatasetRun, std::string> run_on(
    const Recording& dataset, const RunOptions& options, Clock& clock,
    const std::function<void(double)>& progress);

}  // namespace dive::estimation
