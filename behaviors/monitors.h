#pragma once
// The conditions of the failsafes, evaluated on raw samples. A sample that no working sensor can
// send (NaN, a quaternion without unit norm, an impossible depth) is discarded, so that a broken
// sensor and a silent one are treated alike.

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "behaviors/failsafes.h"
#include "behaviors/map_evidence.h"
#include "common/measurements.h"
#include "estimation/state_estimate.h"
#include "vehicle/command.h"

namespace dive::behaviors {

[[nodiscard]] bool is_plausible(const ImuSample& sample);
[[nodiscard]] bool is_plausible(const DepthSample& sample);
[[nodiscard]] bool is_plausible(const HealthSample& sample);

/// Why a sensor counts as lost.
enum class SensorLoss {
  kSilent,        ///< No plausible sample for the failsafe's threshold.
  kFrozen,        ///< One unchanged value for kFrozenSeconds.
  kContradicted,  ///< A depth that does not change although the vehicle rises or sinks.
};
/// A working sensor's noise shows within this time, s.
inline constexpr double kFrozenSeconds = 10.0;

/// Limits of the mission.
struct MonitorLimits {
  std::array<double, kFailsafeCount> threshold{};  ///< Indexed by FailsafeKind; FailsafeTraits.
  double max_depth = 0.0;                          ///< m
  double min_altitude = 0.0;                       ///< m
  double mission_timeout_s = 0.0;
  bool watches_range = false;          ///< The dive depends on range data.
  std::vector<Eigen::Vector2d> fence;  ///< Three or more corners in W, in order; empty: no fence.
};

/// Quantities of one tick.
struct MonitorInput {
  Utime now = 0;
  double elapsed_s = 0.0;  ///< Time since the mission started, s.
  const estimation::StateEstimate* estimate = nullptr;
  std::optional<double> altitude_m;  ///< Height above the ground; empty without ground below.
  /// Margin of the position ahead (planning/certify/position_margin.h).
  double margin_sigma = std::numeric_limits<double>::infinity();
  vehicle::Command command;     ///< Command of the previous tick.
  double expected_climb = 0.0;  ///< Upward velocity expected from the efforts, m/s.
  double leg_elapsed_s = 0.0;   ///< Time since the leg began, s.
  double leg_expected_s = 0.0;  ///< Duration of the leg at the mission's speed, s; 0: no leg.
  int plan_failures = 0;        ///< Number of failed plans in a row.
  bool out_of_replans = false;
  bool operator_abort = false;
  bool rises = false;  ///< A vertical ascent in open water, for which no range data are needed.
  bool retrace_failed = false;
};

class Monitors {
 public:
  explicit Monitors(MonitorLimits limits);

  /// Records a sample that arrives at `now`; false if it is implausible or older than the last one
  /// and must not be used.
  [[nodiscard]] bool accept(Utime now, const ImuSample& sample);
  [[nodiscard]] bool accept(Utime now, const DepthSample& sample);
  [[nodiscard]] bool accept(Utime now, const HealthSample& sample);
  void heartbeat(Utime now) { heartbeat_ = now; }
  /// Records the time of a scan that was mapped, or matched with the map.
  void receive_scan(Utime scan_utime) { scanned_ = scan_utime; }
  /// Records what a scan says of the known map.
  void receive(const MapFix& fix);
  /// Records a loss of log or journal.
  void lose_log(Utime now) { log_lost_ = now; }
  /// Start of the silence of sensors that never sent a sample. Must be called before update().
  void start(Utime now);

  /// Allocates nothing.
  [[nodiscard]] const FailsafeConditions& update(const MonitorInput& input);
  [[nodiscard]] const HealthSample& health() const { return health_; }
  /// The sum by which the last update() decided on kWrongMap.
  [[nodiscard]] const MapAgreement& map_agreement() const { return map_agreement_; }
  /// Causes of the last kImuLost and kDepthLost.
  [[nodiscard]] SensorLoss imu_loss() const { return imu_loss_; }
  [[nodiscard]] SensorLoss depth_loss() const { return depth_loss_; }
  [[nodiscard]] bool is_true(FailsafeKind kind) const {
    return conditions_[static_cast<std::size_t>(kind)];
  }

 private:
  /// Times of the last sample and of the last change of its value.
  struct Source {
    std::optional<Utime> arrived;
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
  void leave_out_stall(Utime now);
  void compare_height(const MapFix& fix);
  void watch_sensors(const MonitorInput& input);
  void watch_estimate(const MonitorInput& input);
  void watch_progress(const MonitorInput& input);
  [[nodiscard]] bool is_outside_fence(const Eigen::Vector3d& p_W) const;

  MonitorLimits limits_;
  FailsafeConditions conditions_{};
  Source imu_, depth_, power_;
  SensorLoss imu_loss_ = SensorLoss::kSilent;
  SensorLoss depth_loss_ = SensorLoss::kSilent;
  Eigen::Vector4d last_q_ = Eigen::Vector4d::Zero();
  double last_depth_m_ = 0.0;
  /// Height by the map plus depth, as that last changed, m.
  std::optional<double> height_above_depth_;
  int height_denials_ = 0;  ///< Fixes in a row whose height denies a depth that does not change.
  double expected_rise_m_ = 0.0;  ///< Expected rise since the measured depth last changed, m.
  Utime last_update_ = 0;
  HealthSample health_;
  MapEvidence map_evidence_;
  MapAgreement map_agreement_;
  std::optional<Utime> heartbeat_;
  std::optional<Utime> scanned_;
  std::optional<Utime> log_lost_;
  Utime started_ = 0;
  std::optional<Eigen::Vector3d> anchor_W_;  ///< Position at the last progress.
  Utime anchored_ = 0;                       ///< Time of the last progress, us.
};

}  // namespace dive::behaviors
