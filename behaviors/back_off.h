#pragma once
// Return to a place with clearance: in an unknown environment, and in a known one from an obstacle
// that the map lacks. A plan may start with reduced clearance. A vehicle that replans often can use
// this each time: it works its way into a narrowing, a little nearer to obstacles with every plan,
// until it cannot turn. A vehicle that has come too near, or has been near for too long, therefore
// returns along its trail, which is free, and plans from there with the map as it is then.
//
// There is no clearance to turn around: the vehicle swims stern first if its bow points away from
// the path. A vehicle on its side may be there because it has no room to come level: it keeps its
// roll while coming level would leave less clearance, and less than a turn must leave. It does not
// keep it longer, since flippers on edge hold neither depth nor course well. The course follows the
// line-of-sight law to the point of the path `kLookahead` ahead (Fossen 2011, ch. 12.3), with the
// stern in place of the bow.

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "behaviors/behavior.h"
#include "behaviors/recovery_options.h"
#include "behaviors/trail.h"

namespace dive::behaviors {

/// Idle until begin() succeeds, then under way until follow() returns no command.
class BackOff {
 public:
  /// `d_min_m`: D_min, m.
  explicit BackOff(double d_min_m, const BackOffOptions& options = {})
      : d_min_m_(d_min_m), options_(options) {}

  /// Called once per tick while idle, before begin(). True if the vehicle should back off; begin()
  /// decides whether it can. Measures the clearance when the map has changed.
  [[nodiscard]] bool is_needed(const BehaviorInput& input);

  /// Conditions on the place.
  struct Criteria {
    double min_distance_m = 0.0;  ///< Least distance from here, m.
    /// Longest path along the trail, m; max_distance_m when absent.
    std::optional<double> max_distance_m = std::nullopt;
    bool needs_open_water = false;  ///< Only places with open water above.
    double min_clearance_m = 0.0;   ///< Least clearance on the way there, m; more than 0 always.
  };
  /// Starts along BehaviorInput::trail to the nearest place that has clearance and meets the
  /// conditions; if there is none, to the one with most clearance. False if no place has more than
  /// here, or the path is blocked.
  [[nodiscard]] bool begin(const BehaviorInput& input, const Criteria& criteria);
  /// Called once per tick while under way. Empty if it has arrived, is blocked or took too long; it
  /// is idle then. Negative speeds are astern.
  [[nodiscard]] std::optional<vehicle::Command> follow(const BehaviorInput& input);

  [[nodiscard]] bool is_under_way() const { return route_.has_value(); }
  /// Clearance of the vehicle when it was last measured, m.
  [[nodiscard]] double clearance_m() const { return clearance_m_; }
  /// Number of times in a row that it began from about `p_W`.
  [[nodiscard]] int count_at(const Eigen::Vector3d& p_W) const;

 private:
  /// The path back along the trail.
  struct Route {
    std::vector<Eigen::Vector3d> points_W;
    bool is_astern = false;
    double roll = 0.0;     ///< rad
    double least_m = 0.0;  ///< Clearance with which it ends, m.
    Utime until = 0;       ///< Time at which it has taken too long.
    PathCheck check;       ///< When its clearance is measured again.
    std::size_t next = 1;  ///< Index of the point that it steers to.
  };
  /// A place that the vehicle backed off from.
  struct Place {
    Eigen::Vector3d p_W;
    int count = 0;  ///< Attempts from here, in a row.
  };

  [[nodiscard]] Trail::Path find_path(const BehaviorInput& input, const Criteria& criteria) const;
  /// The clearance of the rest of the route, m, with the roll that it then has.
  [[nodiscard]] double come_level_if_possible(Route& route, const BehaviorInput& input) const;
  [[nodiscard]] static double clearance_of_rest(const Route& route, const BehaviorInput& input);

  double d_min_m_;
  BackOffOptions options_;
  std::optional<Route> route_;             ///< Route being followed; none while idle.
  double clearance_m_ = 0.0;               ///< Clearance when last measured, m.
  double tight_m_ = 0.0;                   ///< Path swum since there was clearance, m.
  std::optional<Eigen::Vector3d> last_W_;  ///< Position up to which that path is counted.
  std::optional<Utime> tried_at_;          ///< Time of the last attempt.
  std::optional<Place> last_place_;        ///< Place of the last attempt that began.
};

}  // namespace dive::behaviors
