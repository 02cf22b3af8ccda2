#pragma once
// An estimator over a recording, fed as it would be on the vehicle: every sample in its turn, and
// nothing from later than the IMU sample that follows a picture.

#include <functional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "estimation/dataset/asl_dataset.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/state_estimate.h"
#include "estimation/visual_inertial/filter_options.h"
#include "estimation/visual_inertial/loop_correction.h"

namespace dive::estimation {

enum class RunStart {
  kRest,    ///< At rest for half a second: roll and pitch by gravity.
  kMotion,  ///< Swimming at RunOptions::speed: attitude as the gyro and gravity have it.
  kTruth,   ///< Pose and velocity from the recording's truth.
};

struct RunOptions {
  EstimatorKind estimator = EstimatorKind::kVisualInertial;
  RunStart start = RunStart::kRest;
  bool mono = false;      ///< Only the left camera, though there are two.
  bool use_depth = true;  ///< Where there is a depth sensor.
  bool loops = false;     ///< Close loops; needs two cameras.
  double speed = 0.4;     ///< m/s forward, that the primitive estimator and kMotion expect.
  std::uint64_t seed = 1;

  [[nodiscard]] std::string validate() const;
};

struct DatasetRun {
  std::vector<StateEstimate> estimates;  ///< At each picture; valid ones only.
  /// The same, corrected by the loops closed until then; empty without RunOptions::loops.
  std::vector<StateEstimate> corrected;
  int keyframes = 0;
  std::vector<LoopClosure> closures;  ///< In the order in which they were believed.
  std::vector<double> loop_ms;        ///< Of each keyframe, off the critical path.
  std::vector<double> frame_ms;       ///< Front end and filter, each picture, without decoding.
  int frames = 0;                     ///< Pictures, used or not.
  int refused = 0;                    ///< Of those, without features: dark, frozen, broken.
  int poor = 0;                       ///< With too few to be sure of them.
  int lost = 0;                       ///< In which tracking was lost.
  double mean_features = 0.0;
  std::string last_fault;  ///< A sentence; empty without one.
  std::string diverged;    ///< Why the filter says that it has diverged; empty if it has not.
};

/// Of so many of its cameras, at most.
[[nodiscard]] VisualInertialOptions filter_options(const AslDataset& dataset, std::size_t cameras);

/// Empty where the recording has no truth.
[[nodiscard]] Trajectory true_trajectory(const AslDataset& dataset);

/// `clock` measures, nothing else; `progress` is told the share done, now and then. An error is a
/// file that cannot be read, or a recording that lacks what is asked.
[[nodiscard]] tl::expected<DatasetRun, std::string> run_on(
    const AslDataset& dataset, const RunOptions& options, Clock& clock,
    const std::function<void(double)>& progress);

}  // namespace dive::estimation
