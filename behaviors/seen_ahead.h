#pragma once
// How fast a vehicle in unknown water may swim: no faster than it can stop within what it has seen.
//
// It goes on at v for the reaction time t_r, until what appears has become a command, and then
// comes to rest with the time constant tau of its own drag, over v tau. So that it stops `margin`
// short of where its sight ends its speed may be
//     v_max = max(0, (seen_ahead - travelled since that scan - margin) / (t_r + tau)).
// A command takes tau as well to become speed: told v_max as that falls, the vehicle would be
// faster all the time, and stop 0.1 m beyond its sight. What is commanded is therefore at most
//     clamp(v_max - 3 (v - v_max), 0, v_max).

#include <optional>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/timed_buffer.h"

namespace dive::behaviors {

struct SeenAheadOptions {
  bool stops_within_sight = true;  ///< False: what was not seen is taken for water.
  double stale_s = 1.0;            ///< A scan that is older shows nothing any more: no way ahead.
  double margin_m = 0.25;
  double reaction_s = 0.2;
  double time_constant_s = 1.0;
};

class SeenAhead {
 public:
  explicit SeenAhead(SeenAheadOptions options) : options_(options) {}

  /// One tick: where the vehicle is now.
  void advance(Utime now, const Eigen::Vector3d& p_W);
  /// The newest scan, not after the last tick, showed `seen_ahead_m` of water.
  void hear(Utime scan_utime, double seen_ahead_m);

  /// m/s that may be commanded to a vehicle that swims forward at `speed`: 0 before the first scan
  /// and after one that is stale, infinite where nothing limits it.
  [[nodiscard]] double max_command(Utime now, double speed) const;

 private:
  struct Scan {
    Utime utime = 0;
    double seen_ahead_m = 0.0;
    double swum_m = 0.0;  ///< By then.
  };

  SeenAheadOptions options_;
  TimedBuffer<double, 256> distances_;  ///< Distance swum by tick, m: five seconds.
  std::optional<Eigen::Vector3d> last_W_;
  double swum_m_ = 0.0;
  std::optional<Scan> scan_;
};

}  // namespace dive::behaviors
