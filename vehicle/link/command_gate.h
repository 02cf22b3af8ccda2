#pragma once
// Which commands of a source count. Vehicle and supervisor each evaluate them by session, sequence,
// plausible time and arrival, so that neither a repeated packet nor a second sender, a restarted
// one or one whose clock was set can displace the one that commands the vehicle.

#include <cstdint>
#include <optional>

#include "common/clock.h"
#include "vehicle/link/codec.h"

namespace dive::link {

class CommandGate {
 public:
  /// Maximum plausible advance of a session's time, s, and for each s since its last command.
  static constexpr double kMaxAdvance = 5.0;
  static constexpr double kMaxRate = 20.0;
  /// The same for its sequence; 50 commands a second are sent.
  static constexpr double kMaxCommands = 1000.0;
  static constexpr double kMaxCommandRate = 1000.0;

  enum class Decision {
    kAccepted,
    kRepeated,      ///< Not newer than the last one of its session.
    kImplausible,   ///< Values that are no command, or a time or sequence far ahead.
    kOtherSession,  ///< Another session while the present one commands the vehicle.
  };

  /// A session is replaced by another after `session_timeout_s` without a command of it; 0: at
  /// once.
  explicit CommandGate(double session_timeout_s) : session_timeout_s_(session_timeout_s) {}

  /// Evaluates a command that arrived at `now`.
  Decision receive(const VehicleCommand& command, Utime now);

  /// The newest accepted command.
  [[nodiscard]] const std::optional<VehicleCommand>& newest() const { return newest_; }
  /// Time since it arrived, s; infinite without one.
  [[nodiscard]] double age_s(Utime now) const;
  /// True if `session_id` is the session of the newest accepted command.
  [[nodiscard]] bool is_from(std::uint64_t session_id) const {
    return newest_ && newest_->session_id == session_id;
  }
  /// Number of sessions accepted so far: one more with every restart.
  [[nodiscard]] int sessions() const { return sessions_; }
  /// Number of commands that were not accepted.
  [[nodiscard]] std::int64_t refused() const { return refused_; }

 private:
  [[nodiscard]] Decision evaluate(const VehicleCommand& command, Utime now) const;

  double session_timeout_s_;
  std::optional<VehicleCommand> newest_;
  Utime arrived_at_ = 0;
  int sessions_ = 0;
  std::int64_t refused_ = 0;
};

}  // namespace dive::link
