#pragma once
// Trajectories as text in the format of the TUM RGB-D benchmark, which evo and
// rpg_trajectory_evaluation read: `t x y z qx qy qz qw`, t in seconds, a line each, # for comments.

#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "common/se3.h"

namespace dive::estimation {

struct StampedPose {
  Utime utime = 0;
  Pose X_WB;
};

using Trajectory = std::vector<StampedPose>;  ///< Poses by increasing time.

[[nodiscard]] std::string to_tum(const Trajectory& trajectory);

/// An error is "NAME:LINE: what"; `name` is the name for the text.
[[nodiscard]] tl::expected<Trajectory, std::string> from_tum(const std::string& text,
                                                             const std::string& name);

/// Path length, m.
[[nodiscard]] double length_of(const Trajectory& trajectory);

/// The pose at a time between two poses at most `max_gap_s` apart; empty elsewhere.
[[nodiscard]] std::optional<Pose> pose_at(const Trajectory& trajectory, Utime utime,
                                          double max_gap_s);

}  // namespace dive::estimation
