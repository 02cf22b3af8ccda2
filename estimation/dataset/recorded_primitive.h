#pragma once
// The primitive estimator on a recording, which has no attitude by an AHRS.

#include <optional>

#include "estimation/dataset/run_start.h"
#include "estimation/primitive.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

namespace dive::estimation {

/// Attitude as from an AHRS: the gyro integrated, and corrected towards gravity, which also gives
/// the gyro's bias across the vertical (Mahony et al. 2008), faster at first. Its bias about the
/// vertical stays as known at the start, and turns the heading.
class PredictedAttitude {
 public:
  /// `start`: at the first sample; without one it is level with that sample's specific force.
  PredictedAttitude(const std::optional<Eigen::Quaterniond>& start,
                    const Eigen::Vector3d& gyro_bias_B)
      : q_WB_(start), bias_B_(gyro_bias_B) {}

  void add_to(ImuSample& sample);

 private:
  std::optional<Eigen::Quaterniond> q_WB_;
  Eigen::Vector3d bias_B_;  ///< rad/s
  std::optional<Utime> first_;
  std::optional<Utime> last_;
};

class RecordedPrimitive {
 public:
  /// `speed`: expected, m/s; a measured velocity replaces it.
  RecordedPrimitive(const std::optional<TrueState>& truth, double speed);

  /// The estimate at the input's time. Images are not used.
  [[nodiscard]] const StateEstimate& step(const VisionInput& input);

 private:
  PredictedAttitude attitude_;
  PrimitiveEstimator estimator_;
  Utime updated_ = 0;  ///< Time of the last estimate.
};

}  // namespace dive::estimation
