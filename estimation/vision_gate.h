#pragma once
// Decides which visual-inertial estimates are accepted, and when vision counts as lost or as usable
// again. It checks only whether an estimate is plausible beside the odometry, not what becomes of
// it.

#include <optional>
#include <string>

#include "common/clock.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"

namespace dive::estimation {

/// The motion that the odometry measured at one time, in the odometry frame O.
struct OdometryState {
  Eigen::Vector2d p_O = Eigen::Vector2d::Zero();  ///< m
  Eigen::Vector2d v_O = Eigen::Vector2d::Zero();  ///< m/s
  Eigen::Quaterniond q_OB = Eigen::Quaterniond::Identity();
  Eigen::Vector2d excess_velocity_O = Eigen::Vector2d::Zero();  ///< As in OdometryErrors, m/s.
  Eigen::Vector2d excess_O = Eigen::Vector2d::Zero();           ///< m
};

struct VisionGateOptions {
  int max_bad_updates = 2;          ///< Consecutive rejected updates that end the use of vision.
  double max_silent_periods = 2.5;  ///< Camera periods without an accepted update that end it.
  int min_good_updates = 3;         ///< Consecutive accepted updates before vision is used.
  int max_good_updates = 12;        ///< Bound of that number, which doubles after each short use.
  double short_use_s = 5.0;         ///< A use of vision that ends within this time is short.
  double max_age_s = 0.5;           ///< Age of an image at which its update is rejected.
  double max_speed = 2.5;           ///< m/s; faster is implausible for the vehicle.
  double max_excess_speed = 1.0;    ///< m/s between the velocities of vision and odometry.
  double max_tilt_deg = 15.0;       ///< Between the verticals of vision and of the AHRS.

  /// Empty if usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Deterministic. Does not allocate.
class VisionGate {
 public:
  enum class Decision {
    kRejected,  ///< The update is not used; the state of vision stays.
    kAccepted,  ///< The update is used.
    kLost,      ///< The update is rejected, and vision is not used from now on.
  };

  /// Demands options that validate.
  explicit VisionGate(const VisionGateOptions& options);

  /// Evaluates an update that arrived at `now`; `odometry` is the state at its utime, if known.
  [[nodiscard]] Decision evaluate(Utime now, const VisionEstimate& vision,
                                  const std::optional<OdometryState>& odometry);
  /// Called once a tick; true if vision has sent no update for too long and is not used from now
  /// on.
  [[nodiscard]] bool times_out(Utime now);

  [[nodiscard]] bool uses_vision() const { return used_since_.has_value(); }
  /// Reason why vision is not used, as of the last update; kNone while it is.
  [[nodiscard]] VisionFault fault() const { return fault_; }
  [[nodiscard]] double period_s() const { return period_s_; }  ///< Period of the cameras.

 private:
  [[nodiscard]] VisionFault find_fault(Utime now, const VisionEstimate& vision,
                                       const std::optional<OdometryState>& odometry) const;
  void lose(Utime now, VisionFault fault);

  VisionGateOptions options_;
  double period_s_ = 0.05;
  std::optional<Utime> last_image_;  ///< Time of the image of the last accepted update, us.
  Utime last_accepted_ = 0;          ///< Arrival of the last accepted update, us.
  int good_ = 0;                     ///< Consecutive accepted updates.
  int bad_ = 0;                      ///< Consecutive rejected updates.
  int good_needed_;                  ///< Accepted updates before vision is used again.
  std::optional<Utime> used_since_;  ///< Start of the present use of vision, us; empty if unused.
  VisionFault last_bad_ = VisionFault::kNone;
  VisionFault fault_ = VisionFault::kStarting;
};

}  // namespace dive::estimation
