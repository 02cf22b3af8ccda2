#pragma once
// What the failsafes watch, from raw samples to conditions. A sample that no working sensor can
// send (NaN, a quaternion that is none, a depth beyond the ocean) is not passed on and counts as
// one that did not arrive, so that a broken sensor and a silent one are the same thing.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "vehicle/command.h"

namespace dive::behaviors {

[[nodiscard]] bool is_plausible(const ImuSample& sample);
[[nodiscard]] bool is_plausible(const DepthSample& sample);
[[nodiscard]] bool is_plausible(const HealthSample& sample);

/// What a mission allows.
struct MonitorLimits {
  std::array<double, kFailsafeCount> threshold{};  ///< By FailsafeKind; see FailsafeTraits.
  double max_depth = 0.0;                          ///< m
  double min_altitude = 0.0;                       ///< m
  double mission_timeout_s = 0.0;
  bool watches_range = false;          ///< In unknown water.
  std::vector<Eigen::Vector2d> fence;  ///< Corners in W, in order, three or more; empty: none.
};

/// What the executive knows this tick.
struct MonitorInput {
  Utime now = 0;
  double elapsed_s = 0.0;  ///< Since the mission started.
  const estimation::StateEstimate* estimate = nullptr;
  std::optional<double> altitude_m;  ///< Above the ground straight below; none where there is none.
  vehicle::Command command;          ///< The last one.
  double expected_climb = 0.0;       ///< m/s, upwards, that the flippers should make.
  double leg_elapsed_s = 0.0;        ///< Since the leg began.
  double leg_expected_s = 0.0;       ///< For the leg at the mission's speed; 0: not on a leg.
  int plan_failures = 0;             ///< In a row.
  bool out_of_replans = false;
  bool operator_abort = false;
  bool rises = false;  ///< Straight up, in open water: it needs no eyes for that.
  bool retrace_failed = false;
};

class Monitors {
 public:
  explicit Monitors(MonitorLimits limits);

  /// Samples as they arrive, at `now`; false when implausible or older than the last: not to be
  /// used.
  [[nodiscard]] bool accept(Utime now, const ImuSample& sample);
  [[nodiscard]] bool accept(Utime now, const DepthSample& sample);
  [[nodiscard]] bool accept(Utime now, const HealthSample& sample);
  void heartbeat(Utime now) { heartbeat_ = now; }
  /// Something was seen, at `scan_utime`.
  void saw(Utime scan_utime) { seen_ = scan_utime; }
  /// Silence counts from here for sensors that never spoke.
  void start(Utime now);

  /// Allocates nothing.
  [[nodiscard]] const FailsafeConditions& update(const MonitorInput& input);
  [[nodiscard]] const HealthSample& health() const { return health_; }
  [[nodiscard]] bool is_true(FailsafeKind kind) const {
    return conditions_[static_cast<std::size_t>(kind)];
  }

 private:
  /// When a source was last heard, and since when it has said the same.
  struct Source {
    std::optional<Utime> heard;
    Utime sampled = 0;
    Utime changed = 0;
  };
  [[nodiscard]] static bool note(Source& source, Utime now, Utime sampled, bool plausible,
                                 bool same);
  [[nodiscard]] double threshold(FailsafeKind kind) const {
    return limits_.threshold[static_cast<std::size_t>(kind)];
  }
  void set(FailsafeKind kind, bool value) { conditions_[static_cast<std::size_t>(kind)] = value; }
  [[nodiscard]] bool is_silent(const Source& source, Utime now, double after_s) const;
  void watch_sensors(const MonitorInput& input);
  void watch_estimate(const MonitorInput& input);
  void watch_progress(const MonitorInput& input);
  [[nodiscard]] bool is_outside_fence(const Eigen::Vector3d& p_W) const;

  MonitorLimits limits_;
  FailsafeConditions conditions_{};
  Source imu_, depth_, power_;
  Eigen::Vector4d last_q_ = Eigen::Vector4d::Zero();
  double last_depth_m_ = 0.0;
  double expected_rise_m_ = 0.0;  ///< Since the depth sensor last said something new.
  Utime last_update_ = 0;
  HealthSample health_;
  std::optional<Utime> heartbeat_;
  std::optional<Utime> seen_;
  Utime started_ = 0;
  std::optional<Eigen::Vector3d> anchor_W_;  ///< Where it was when it last got anywhere ...
  Utime anchored_ = 0;                       ///< ... and when.
};

}  // namespace dive::behaviors
