#pragma once
// What is asked of an atomic state: by the rules, by the checks of a mission in its map, and by the
// executive that runs it. One class and one file pair per element, beside this file; README.md and
// doc/decisions/one-registry.md.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"
#include "common/diagnostic.h"
#include "mission/document/mission.h"
#include "planning/world/scene.h"

namespace dive::mission {

/// Inputs of the behaviour of an atomic state. All that it refers to must outlive the behaviour.
struct BehaviorSetup {
  behaviors::LegSettings leg;              ///< Settings of the legs in this state.
  const planning::Scene& scene;            ///< World, for positions given as altitude.
  const behaviors::Trail& trail;           ///< The vehicle's positions so far.
  behaviors::PathEvaluator& observed_map;  ///< Clearance of paths to what was observed in the dive.
  int goals_done = 0;                      ///< Goals completed before the executive was restarted.
};

/// A mission in its map, as the rules of a state may ask about it.
class MapContext {
 public:
  virtual ~MapContext() = default;
  /// Radius of the hull about the origin of B, m.
  [[nodiscard]] virtual double hull_radius() const = 0;
  /// Position in W; empty where an altitude has no ground below.
  [[nodiscard]] virtual std::optional<Eigen::Vector3d> in_world(const Position& position) const = 0;
  /// Nearest obstacle to the hull, level at that heading, if it is within `cutoff` (m).
  [[nodiscard]] virtual std::optional<planning::Contact> nearest(
      const Eigen::Vector3d& p_W, const std::optional<double>& heading_deg, double cutoff) = 0;
  [[nodiscard]] virtual const std::string& obstacle_name(int obstacle) const = 0;
  virtual void error(const char* code, Span span, std::string message, std::string hint = {}) = 0;
};

class AtomicState {
 public:
  virtual ~AtomicState() = default;

  /// Goals in the order in which they are visited. A state with goals plans paths; it ends at the
  /// last one.
  [[nodiscard]] virtual std::vector<const Goal*> goals() const { return {}; }
  /// True if its only goal has the id of the state.
  [[nodiscard]] virtual bool is_its_goal() const { return false; }
  /// Time at rest, s, beside the dwells at its goals; its span for messages.
  [[nodiscard]] virtual Located<double> rest_s() const { return {}; }

  /// Where a state without goals ends.
  enum class End {
    kWhereItBegins,
    kAtTheSurface,  ///< Above where it begins.
    kInOpenWater,   ///< On the trail.
  };
  [[nodiscard]] virtual End end() const { return End::kWhereItBegins; }

  /// Reports violations of the rules of this element that the document alone decides.
  virtual void check(const Mission& /*mission*/, const StateSpec& /*spec*/,
                     Diagnostics& /*diagnostics*/) const {}
  /// Reports violations of its rules in the map. Called if all positions are valid.
  virtual void check_in_map(const Mission& /*mission*/, const StateSpec& /*spec*/,
                            MapContext& /*map*/) const {}

  /// The behaviour of the state, from its entry on.
  [[nodiscard]] virtual std::unique_ptr<behaviors::Behavior> make_behavior(
      const BehaviorSetup& setup) const = 0;
};

/// True if the state ends at the surface.
[[nodiscard]] bool is_surfacing(const StateSpec& spec);
/// True if the state goes back along the trail.
[[nodiscard]] bool is_retracing(const StateSpec& spec);

/// Height of the ground (z in W) below a position as written; the surface if there is no ground.
[[nodiscard]] double ground_height(const planning::Scene& scene, const Position& position);

/// A goal as the legs know it, in W.
[[nodiscard]] behaviors::LegGoal leg_goal(const planning::Scene& scene, const Goal& goal);
[[nodiscard]] std::vector<behaviors::LegGoal> leg_goals(const planning::Scene& scene,
                                                        const std::vector<Goal>& goals);
/// Index of the first of `goals` goals that is still to be reached; the last one if all were.
[[nodiscard]] std::size_t first_goal(const BehaviorSetup& setup, std::size_t goals);

}  // namespace dive::mission
