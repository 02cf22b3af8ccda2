#pragma once
// The known map and the observed map, as the executive and its behaviours query them: overhead,
// ground, and clearance of a path. Private to mission/executive.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "behaviors/behavior.h"
#include "planning/certify/certify.h"
#include "planning/world/observed_map.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::mission {

class MapView final : public behaviors::PathEvaluator {
 public:
  /// World and hull must outlive it. Clearances to observed obstacles are computed up to
  /// `max_clearance_m`. Objects of the known map that are gone are obstacles in no query.
  MapView(const planning::World& world, const planning::RobotHull& hull,
          double max_clearance_m = 1.5);

  /// Replaces the snapshot; false if nothing has changed since the last one.
  bool update(const planning::ObservedMap& observed);
  /// True if anything has ever been observed.
  [[nodiscard]] bool has_observed() const { return observed_.revision() > 0; }

  // These two allocate nothing.

  /// True if anything solid is between p_W and the surface, within the hull's radius and `margin`
  /// (m).
  [[nodiscard]] bool overhead(const Eigen::Vector3d& p_W, double margin);
  /// Height (z in W) of the first solid straight below p_W; empty if there is none within 200 m.
  [[nodiscard]] std::optional<double> ground_below(const Eigen::Vector3d& p_W) const;

  /// Clearance to observed obstacles, and to objects of the known map that were gone and are back:
  /// that to the others was certified with the path. At most `max_clearance_m`; infinite while
  /// nothing is observed.
  [[nodiscard]] double clearance(std::span<const Pose> waypoints) override;
  [[nodiscard]] double clearance_to_all(std::span<const Pose> waypoints) override;
  /// What is there of the known map.
  [[nodiscard]] const planning::Scene& scene() const { return scene_; }
  [[nodiscard]] planning::Scene& scene() { return scene_; }

 private:
  void take_absences(const planning::AbsentObjects& before);
  [[nodiscard]] double clearance_of_stretch(std::span<const Pose> waypoints, double cutoff);

  struct Returned {
    int obstacle = 0;
    Eigen::AlignedBox3d box;
  };

  const planning::World& known_;
  double hull_radius_;
  double max_clearance_m_;
  planning::World present_;  ///< What is there of the known map, once an object has been gone.
  planning::Scene scene_;
  planning::OverheadIndex ceiling_;
  planning::ObservedMap observed_;
  std::vector<Returned> returned_;  ///< Known obstacles that were gone and are back.
  planning::PlanView scratch_;
  planning::Certifier to_observed_;  ///< Reset to the pieces near each path.
  planning::Certifier to_known_;
};

}  // namespace dive::mission
