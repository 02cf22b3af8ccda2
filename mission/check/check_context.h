#pragma once
// Input of the rules of mission/check: a mission in its world. Private to mission/check.

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/reachable_positions.h"
#include "mission/document/flow.h"
#include "mission/document/mission.h"
#include "mission/document/state_index.h"
#include "mission/states/atomic_state.h"
#include "planning/world/scene.h"
#include "planning/world/world.h"

namespace dive::mission {

/// A start or goal named in the mission.
struct NamedGoal {
  std::string name;  ///< Name for messages: "the goal 'gate'".
  const Position* position = nullptr;
  std::optional<double> heading_deg;
  bool overhead_declared = false;
};

class CheckContext final : public MapContext {
 public:
  /// All three must outlive this object.
  CheckContext(const Mission& whole, const planning::World& solid, const planning::RobotHull& hull,
               Diagnostics& diagnostics);

  const Mission& mission;
  const planning::World& world;
  const StateIndex index;
  const Flow flow;
  const ReachablePositions reachable;

  /// Start and goals in document order.
  [[nodiscard]] std::vector<NamedGoal> goals() const;
  [[nodiscard]] double hull_radius() const override { return radius_; }
  [[nodiscard]] std::optional<Eigen::Vector3d> in_world(const Position& position) const override;
  /// Height of the first solid vertically below, if there is any.
  [[nodiscard]] std::optional<double> ground_below(const Eigen::Vector3d& p_W) const;
  /// Nearest obstacle to the hull at the best attitude that the mission allows there, if it is
  /// within `cutoff`. The distance is exact where the attitude is given, and otherwise an upper
  /// bound of the true one: a distance that is too small proves a conflict.
  [[nodiscard]] std::optional<planning::Contact> nearest(const Eigen::Vector3d& p_W,
                                                         const std::optional<double>& heading_deg,
                                                         double cutoff) override;
  /// Index of an obstacle between p_W and the surface, -1 if there is none.
  [[nodiscard]] int overhead(const Eigen::Vector3d& p_W) const;
  [[nodiscard]] const std::string& obstacle_name(int obstacle) const override;

  void error(const char* code, Span span, std::string message, std::string hint = {}) override;
  void warning(const char* code, Span span, std::string message, std::string hint = {});

 private:
  [[nodiscard]] std::optional<planning::Contact> nearest_at(const Eigen::Vector3d& p_W, double yaw,
                                                            double cutoff);
  [[nodiscard]] planning::Contact nearest_to_centre(const Eigen::Vector3d& p_W) const;

  planning::Scene scene_;
  std::vector<Eigen::Vector3d> hull_;
  double radius_ = 0.0;
  std::vector<Eigen::Vector3d> placed_;
  std::vector<planning::Contact> contacts_;
  Diagnostics& diagnostics_;
};

// Rules of position_rules.cpp.
void positions_have_ground(CheckContext& context);
void positions_are_in_the_water(CheckContext& context);
void positions_are_clear(CheckContext& context);
void positions_keep_altitude(CheckContext& context);
void overheads_are_declared(CheckContext& context);

// Rules of leg_rules.cpp.
void legs_fit_their_timeouts(CheckContext& context);
void surfacing_is_unobstructed(CheckContext& context);
void states_obey_their_own_rules(CheckContext& context);

}  // namespace dive::mission
