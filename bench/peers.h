#pragma once
// The sampling planners of OMPL on the planner's own question: same world, same hull, same
// distances, same clearance demanded.

#include <cstdint>
#include <string>
#include <vector>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::bench {

struct PeerTask {
  Pose start;
  Pose goal;
  bool horizontal = false;  ///< Positions and yaw only, else all of SE(3).
  double clearance = 0.6;   ///< m, at every state checked.
  double min_z = -50.0;
  double max_z = 0.0;
  double length_target = 0.0;  ///< m: stop at a path this short; infinite: at the first.
  double time_limit_s = 10.0;
  double look = 0.05;  ///< m between looks along a motion.
  std::uint64_t seed = 1;
};

struct PeerRun {
  bool reached = false;      ///< A path within the target.
  double seconds = 0.0;      ///< Until then, or until it gave up.
  double best_length = 0.0;  ///< m, infinite when there is none.
};

/// RRTConnect, KPIECE and BiTRRT are restarted and their paths simplified until one is short
/// enough; RRT*, Informed RRT* and BIT* improve theirs; FMT* doubles its samples.
[[nodiscard]] const std::vector<std::string>& peer_names();

[[nodiscard]] PeerRun run_peer(const std::string& name, const planning::World& world,
                               const planning::RobotHull& hull, const PeerTask& task);

}  // namespace dive::bench
