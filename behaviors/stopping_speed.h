#pragma once
// The highest speed in an unknown environment: the one from which the vehicle can stop within the
// space that it has observed free.
//
// It continues at v for the reaction time t_r, until a new obstacle has changed the command, and
// then comes to rest by drag with the time constant tau, over v tau. To stop `margin` before the
// end of the observed space it may swim at
//     v_max = max(0, (free_ahead - travelled since that scan - margin) / (t_r + tau)).
// Speed follows the command with tau as well: with the command v_max while v_max falls, the vehicle
// would always be faster than v_max and stop 0.1 m beyond the observed space. The command is
// therefore at most
//     clamp(v_max - 3 (v - v_max), 0, v_max).

#include <optional>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/timed_buffer.h"

namespace dive::behaviors {

struct StoppingSpeedOptions {
  bool requires_observed_space = true;  ///< False: unobserved space counts as free.
  double stale_s = 1.0;                 ///< Age of a scan after which nothing ahead is free, s.
  double margin_m = 0.25;
  double reaction_s = 0.2;
  double time_constant_s = 1.0;
};

class StoppingSpeed {
 public:
  explicit StoppingSpeed(StoppingSpeedOptions options) : options_(options) {}

  /// Records the position of a tick.
  void advance(Utime now, const Eigen::Vector3d& p_W);
  /// Records the free distance ahead in the newest scan, m, measured not after the last tick.
  void add_scan(Utime scan_utime, double free_ahead_m);

  /// Highest command (m/s) for a vehicle that swims forward at `speed`: 0 before the first scan and
  /// after a stale one, infinite without a limit.
  [[nodiscard]] double max_command(Utime now, double speed) const;

 private:
  struct Scan {
    Utime utime = 0;
    double free_ahead_m = 0.0;
    double swum_m = 0.0;  ///< Distance swum by then, m.
  };

  StoppingSpeedOptions options_;
  TimedBuffer<double, 256> distances_;  ///< Distance swum by tick, m: five seconds.
  std::optional<Eigen::Vector3d> last_W_;
  double swum_m_ = 0.0;
  std::optional<Scan> scan_;
};

}  // namespace dive::behaviors
