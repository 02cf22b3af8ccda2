#pragma once
// All numbers of the recovery from obstructions. README.md has the order of the steps, validate()
// the range of each number. D_min is the clearance required by the mission.

#include <array>
#include <string>

namespace dive::behaviors {

/// Return along the trail to a place with clearance, to plan from there.
struct BackOffOptions {
  /// Share of D_min below which the vehicle backs off at once: limits on one plan do not prevent a
  /// series of plans from leading into a narrowing. Also the share of its certified clearance below
  /// which a path is left: one with 2 cm was followed at full speed past a diver.
  double min_clearance = 0.65;
  /// Clearance that a place must have beyond what the vehicle has, m. A smaller gain is not worth
  /// the motion.
  double min_gain_m = 0.05;
  double retry_s = 2.0;         ///< Time between two attempts, s. The map changes in between.
  double max_distance_m = 8.0;  ///< Longest path back along the trail, m.
  /// Longest path back before an ascent, m, so that the vehicle surfaces near the given place.
  double max_distance_to_ascend_m = 3.0;

  double same_place_m = 3.0;  ///< Distance within which attempts count as from one place, m.
  /// Attempts from one place, in a row, after which the goal is unreachable.
  int max_attempts = 5;
  /// Distance to the place of the next plan, m. From the same place the planner finds the same
  /// path.
  double replan_distance_m = 1.0;
  /// Share of the clearance that the way back had when it began; with less it ends, and a path is
  /// planned from there. Astern the vehicle drifts further off its trail than a path allows. 0 in
  /// an unknown environment: there the way back may be all that is known to be free.
  double kept_clearance = 0.5;
  /// Distance added with each attempt from one place, m. Without it a vehicle went back and forth
  /// within a metre of a diver in a doorway, slid sideways, and its bow came within 1 mm.
  double farther_each_time_m = 0.7;
  /// Share of D_min that the turn onto a new path must leave. The certificate assumes a turn under
  /// way, but a sharp turn is made on the spot before the path: one beside a diver left 7 cm.
  double min_turn_clearance = 0.4;
};

/// A goal without a path may be occupied temporarily. The map keeps an obstacle until the sensor
/// observes free space in its place.
struct ObserveGoalOptions {
  double min_turn_clearance_m = 0.1;  ///< Clearance that the turn towards the goal must leave, m.
  int failures = 5;  ///< Failed plans after which the goal is observed from nearer, each time.
  /// Least distance from which the goal is observed, m: in view, and clear of it.
  double min_distance_m = 2.0;
  double min_approach_m = 1.0;  ///< Shortest path worth the motion, m.
};

/// A blocked trail during a retrace.
struct BlockedTrailOptions {
  /// Time for which the vehicle observes the trail and plans detours, s. 0 in a known environment,
  /// where obstacles do not move and any exit path will do.
  double wait_s = 0.0;
  /// In a known environment: time for which a vehicle that is inside an obstacle by the map tries
  /// to follow its trail nevertheless, s. Its position may be corrected meanwhile.
  double hold_s = 30.0;
  double observe_s = 6.0;        ///< Time that one observation of the trail takes, s.
  int observations = 3;          ///< Observations before a detour is planned; a diver may move.
  double observe_again_m = 2.0;  ///< Distance after which the observations are counted from 0, m.
  double min_clearance = 0.4;    ///< Share of D_min along the trail, until it was observed.
  /// Shares of D_min with which a detour is planned, one after the other: less clearance may allow
  /// a path where more does not.
  std::array<double, 4> detour_clearances = {1.0, 0.6, 0.3, 0.1};
  double progress_m = 0.5;  ///< Distance along a detour after which the shares start again, m.
  int max_detours = 40;     ///< Detours after which progress no longer counts.
  double skip_m = 3.0;      ///< Distance along an unblocked trail to the end of a detour, m.
  /// Height by which a detour may rise above the trail, m: an overhead is mapped last.
  double max_rise_m = 0.3;
};

struct RecoveryOptions {
  double retry_s = 1.0;       ///< Pause after a failed plan, s.
  int unreachable_after = 2;  ///< Failed plans in a row, without a path, to an unreachable goal.
  /// True in an unknown environment: back off, and observe the goal. False: wait and plan again.
  bool by_motion = false;
  BackOffOptions back_off;
  ObserveGoalOptions observe_goal;
  BlockedTrailOptions blocked_trail;

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

}  // namespace dive::behaviors
