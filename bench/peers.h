#pragma once
// The sampling planners of OMPL on the planner's own request: same world, hull, distances and
// required clearance.

#include <cstdint>
#include <string>
#include <vector>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::bench {

struct PeerTask {
  Pose start;
  Pose goal;
  bool horizontal = false;  ///< True for positions and yaw only, false for all of SE(3).
  double clearance = 0.6;   ///< Required clearance at every state checked, m.
  double min_z = -50.0;
  double max_z = 0.0;
  double length_target = 0.0;  ///< Length at which to stop, m; infinite: at the first path.
  double time_limit_s = 10.0;
  double look = 0.05;  ///< Step of collision checks along a motion, m.
  std::uint64_t seed = 1;
};

struct PeerRun {
  bool reached = false;      ///< True if a path within the target was found.
  double seconds = 0.0;      ///< Time until then, or until the limit, s.
  double best_length = 0.0;  ///< Length of the best path, m; infinite if there is none.
};

/// RRTConnect, KPIECE and BiTRRT are restarted and their paths simplified until one is short
/// enough; RRT*, Informed RRT* and BIT* improve their own; FMT* doubles its samples.
[[nodiscard]] const std::vector<std::string>& peer_names();

[[nodiscard]] PeerRun run_peer(const std::string& name, const planning::World& world,
                               const planning::RobotHull& hull, const PeerTask& task);

}  // namespace dive::bench
