#pragma once
// orbit: from station to station on a circle, with the bow to its centre at each.
//
// The flippers have no effort sideways, so the vehicle cannot circle a point and face it at the
// same time. It swims to a station bow ahead, comes to rest, turns its bow to the point and stays
// for the dwell, turns to the next station, and swims on. Nor can it stay in a current across its
// bow: a vehicle that has drifted off its station swims back to it, where the dwell goes on, and
// swims on to the next after three returns.

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "behaviors/behavior.h"
#include "behaviors/leg.h"

namespace dive::behaviors {

struct OrbitCircle {
  Eigen::Vector2d centre_W = Eigen::Vector2d::Zero();  ///< Position of the point that it faces, m.
  double radius = 3.0;                                 ///< m
};

/// Expected time at a station besides the dwell, s: to come to rest and to turn twice.
inline constexpr double kStationTurnSeconds = 9.0;

class Orbit final : public Behavior {
 public:
  /// Demands at least one station; starts with the one of index `first`. The dwell of a station is
  /// the time during which the bow points to the centre within 3 degrees of the estimated bearing.
  Orbit(const LegSettings& settings, const OrbitCircle& circle, std::vector<LegGoal> stations,
        std::size_t first = 0);

  [[nodiscard]] BehaviorOutput step(const BehaviorInput& input) override;
  [[nodiscard]] const Progress& progress() const override { return leg_->progress(); }
  [[nodiscard]] bool needs_free_ahead() const override;
  void way_ahead(const Pose& X_WB, double seconds, std::vector<Pose>& way) const override;
  [[nodiscard]] bool request_alternative() override;
  /// Continues with the next station; false at the last one.
  [[nodiscard]] bool skip() override;
  [[nodiscard]] int goals_done() const override { return static_cast<int>(current_); }

 private:
  enum class Phase {
    kSwimming,   ///< Follows the leg to the current station.
    kStopping,   ///< Comes to rest: a vehicle that turns in motion slides on sideways.
    kFacing,     ///< Turns its bow to the centre, and dwells.
    kDeparting,  ///< Turns its bow to the next station.
  };

  [[nodiscard]] BehaviorOutput swim(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput stop(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput face(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput depart(const BehaviorInput& input);
  [[nodiscard]] BehaviorOutput start_leg(const BehaviorInput& input);
  void begin_station();
  void begin_leg();
  [[nodiscard]] vehicle::Command station_command(double yaw) const;

  LegSettings settings_;
  OrbitCircle circle_;
  std::vector<LegGoal> stations_;
  std::size_t current_;
  Phase phase_ = Phase::kSwimming;
  std::optional<Leg> leg_;          ///< The leg to the current station.
  Utime stopping_since_ = 0;        ///< Time of arrival.
  double arrival_yaw_ = 0.0;        ///< Heading at arrival, rad.
  double faced_s_ = 0.0;            ///< Time with the bow to the centre at this station, s.
  int returns_ = 0;                 ///< Number of returns to this station after a drift.
  std::optional<Utime> last_tick_;  ///< Time of the last tick of the dwell.
};

}  // namespace dive::behaviors
