#pragma once
// The map of the dive and what has been seen since it began.

#include <memory>
#include <optional>
#include <span>

#include "behaviors/behavior.h"
#include "mission/executive/io.h"
#include "planning/certify/certify.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::mission {

/// What was seen as obstacles, named "seen 1", "seen 2", ... in the order in which they came;
/// `before` were known already.
[[nodiscard]] std::vector<planning::Obstacle> as_obstacles(std::span<const SeenObstacle> seen,
                                                           std::size_t before);

class ChangedMap final : public behaviors::PathJudge {
 public:
  /// Both must outlive it.
  ChangedMap(const planning::World& world, const planning::RobotHull& hull);

  void add(std::span<const SeenObstacle> seen);
  [[nodiscard]] bool has_changed() const { return !added_.obstacles.empty(); }

  /// Anything solid between p_W and the surface, within the hull's radius and `margin` (m).
  [[nodiscard]] bool overhead(const Eigen::Vector3d& p_W, double margin);
  [[nodiscard]] std::optional<double> ground_below(const Eigen::Vector3d& p_W) const;
  /// To what was seen: the rest was certified when the path was planned.
  [[nodiscard]] double clearance(std::span<const Pose> waypoints) override;
  [[nodiscard]] const planning::Scene& scene() const { return scene_; }

 private:
  const planning::RobotHull& hull_;
  double hull_radius_;
  planning::Scene scene_;
  planning::Ceiling ceiling_;
  planning::World added_;
  std::unique_ptr<planning::Scene> added_scene_;
  std::optional<planning::Ceiling> added_ceiling_;
  std::unique_ptr<planning::Certifier> certifier_;
};

}  // namespace dive::mission
