#pragma once
// The map of the dive and what has been seen since it began: things that a known map lacks, as
// boxes, and unknown water, as the pieces that a mapper makes of it.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "behaviors/behavior.h"
#include "mission/executive/io.h"
#include "mission/executive/seen_pieces.h"
#include "planning/certify/certify.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/seen.h"
#include "planning/world/world.h"

namespace dive::mission {

/// What was seen as obstacles, named "seen 1", "seen 2", ... in the order in which they came;
/// `before` were known already.
[[nodiscard]] std::vector<planning::Obstacle> as_obstacles(std::span<const SeenObstacle> seen,
                                                           std::size_t before);

class ChangedMap final : public behaviors::PathJudge {
 public:
  /// World and hull must outlive it. Clearances to seen pieces are told up to `judged_m`.
  ChangedMap(const planning::World& world, const planning::RobotHull& hull, double judged_m = 1.5);

  void add(std::span<const SeenObstacle> seen);
  /// False, and nothing changes, for an update that is not well-formed or not newer than the last.
  bool apply(const planning::MapUpdate& update);
  /// Has anything ever been seen?
  [[nodiscard]] bool has_changed() const { return changed_; }

  /// Anything solid between p_W and the surface, within the hull's radius and `margin` (m).
  [[nodiscard]] bool overhead(const Eigen::Vector3d& p_W, double margin);
  [[nodiscard]] std::optional<double> ground_below(const Eigen::Vector3d& p_W) const;
  /// To what was seen: the rest was certified when the path was planned. At most `judged_m` once
  /// there are pieces.
  [[nodiscard]] double clearance(std::span<const Pose> waypoints) override;
  [[nodiscard]] const planning::Scene& scene() const { return scene_; }

 private:
  [[nodiscard]] double clearance_to_pieces(std::span<const Pose> waypoints);
  [[nodiscard]] double clearance_of_stretch(std::span<const Pose> waypoints, double cutoff);

  const planning::RobotHull& hull_;
  double hull_radius_;
  double judged_m_;
  bool changed_ = false;
  planning::Scene scene_;
  planning::Ceiling ceiling_;
  planning::World added_;
  std::unique_ptr<planning::Scene> added_scene_;
  std::optional<planning::Ceiling> added_ceiling_;
  std::unique_ptr<planning::Certifier> certifier_;
  SeenPieces pieces_;
  planning::Certifier to_pieces_;  ///< Reset to those near each path.
};

}  // namespace dive::mission
