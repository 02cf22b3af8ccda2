#pragma once
// What a run on a recording begins from.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "estimation/dataset/dataset_run.h"
#include "estimation/dataset/recording.h"
#include "estimation/visual_inertial/pipeline/vision_start.h"

namespace dive::estimation {

/// The recording's ground truth at one time.
struct TrueState {
  Utime utime = 0;
  Pose X_WB;
  bool has_attitude = false;
  std::optional<Eigen::Vector3d> v_WB_B;  ///< m/s
  std::optional<BiasPrior> bias;
};

/// The first at `utime` or later.
[[nodiscard]] std::optional<TrueState> true_state(const Recording& recording, Utime utime);

/// Position and its sigma (m) at the start, by the truth if there is one.
struct StartPosition {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  double sigma_m = 0.0;
};
[[nodiscard]] StartPosition start_position(const std::optional<TrueState>& truth);

/// Moves the estimates to a true pose in their time, by a translation, and by a turn about the
/// vertical if it has an attitude. Nothing if there is no estimate within 0.2 s after it.
void move_to(const TrueState& truth, DatasetRun& run);

/// An error if the recording lacks what `options` begin from.
[[nodiscard]] tl::expected<VisionStart, std::string> vision_start(
    const Recording& recording, const RunOptions& options, const std::optional<TrueState>& truth,
    Utime begin);

}  // namespace dive::estimation
