#pragma once
// How a behaviour recovers from what obstructs it: every number of that policy. README.md has the
// order in which the steps are taken, validate() has each range. D_min is the clearance that the
// mission asks for.

#include <array>
#include <string>

namespace dive::behaviors {

/// Going back along the trail to where there is clearance, to plan from there.
struct BackOffOptions {
  /// Share of D_min. A vehicle with less backs off at once: rules for one plan do not stop many
  /// plans from working their way into a narrowing. A path that has less, of what it was certified
  /// with, is left: with 2 cm it was followed at full speed, past a diver.
  double min_clearance = 0.65;
  /// Clearance that a place must have beyond what the vehicle has, m. A smaller gain is not worth
  /// the motion.
  double min_gain_m = 0.05;
  double retry_s = 2.0;         ///< Time between two attempts, s. The map changes in between.
  double max_distance_m = 8.0;  ///< Longest path back along the trail, m.
  /// Longest path back before an ascent, m. The vehicle surfaces about where it was told to.
  double max_distance_to_ascend_m = 3.0;

  double same_place_m = 3.0;  ///< Distance within which attempts count as from one place, m.
  /// Attempts from one place, in a row, after which the goal is unreachable.
  int max_attempts = 5;
  /// Distance from which another plan is tried, m. From the same place the planner finds the same.
  double replan_distance_m = 1.0;
  /// Distance added with each attempt from one place, m. Without it a vehicle before a diver in a
  /// doorway went back and forth within a metre, sliding sideways, and its bow came to 1 mm.
  double farther_each_time_m = 0.7;
  /// Share of D_min that the turn onto a new path must leave. A path is certified turning under
  /// way, a sharp turn is made on the spot before it: one beside a diver left 7 cm.
  double min_turn_clearance = 0.4;
};

/// A goal to which there is no path may be occupied for a while. The map keeps what occupied it
/// until the sensor observes free space there.
struct ObserveGoalOptions {
  double min_turn_clearance_m = 0.1;  ///< Clearance that the turn towards the goal must leave, m.
  int failures = 5;  ///< Failed plans after which the goal is observed from nearer, each time.
  /// Least distance to the goal to observe it from, m: in view, and out of reach.
  double min_distance_m = 2.0;
  double min_approach_m = 1.0;  ///< Shortest path worth the motion, m.
};

/// A trail that is blocked on the way out.
struct BlockedTrailOptions {
  /// Time for which the vehicle observes the trail and plans around what blocks it, s. 0 in a known
  /// environment: nothing there goes away, and any path out will do.
  double wait_s = 0.0;
  double observe_s = 6.0;        ///< Time that one observation of the trail takes, s.
  int observations = 3;          ///< Observations before a detour is planned: a diver moves on.
  double observe_again_m = 2.0;  ///< Distance after which the observations count from 0 again, m.
  double min_clearance = 0.4;    ///< Share of D_min along the trail, until it was observed.
  /// Shares of D_min with which a detour is planned, one after the other: what is out of reach with
  /// all of it may be within reach with less.
  std::array<double, 4> detour_clearances = {1.0, 0.6, 0.3, 0.1};
  double progress_m = 0.5;  ///< Distance along a detour after which the shares begin again, m.
  int max_detours = 40;     ///< Detours after which progress no longer counts.
  double skip_m = 3.0;  ///< Distance along a trail on which nothing is found, to a detour's end, m.
  /// Height above the trail that a detour may lead to, m: a ceiling is the last thing on the map.
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
