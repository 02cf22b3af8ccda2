#pragma once
// Which planned path the vehicle follows, found from what a log contains. Private to
// mission/report.

#include <cstddef>
#include <optional>
#include <vector>

#include "mission/executive/io.h"
#include "mission/report/report.h"

namespace dive::mission {

/// The line p_{i-1} p_i of a path.
struct FollowedLine {
  std::size_t path = 0;  ///< Index in the list of paths.
  Eigen::Vector3d start_W;
  Eigen::Vector3d end_W;

  /// Distance of a point from the line, m: the paper's error.
  [[nodiscard]] double distance(const Eigen::Vector3d& p_W) const;
};

/// The line that the vehicle follows by this tick's status: that of the newest accepted path whose
/// distance to the estimate is the logged one. Empty if it follows no planned path, as on a retrace
/// along the trail.
[[nodiscard]] std::optional<FollowedLine> followed_line(const std::vector<ReportPath>& paths,
                                                        const Status& status,
                                                        const Eigen::Vector3d& estimated_W);

}  // namespace dive::mission
