#pragma once
// Payload commands on their way to the instruments: each is held back until the journal has it on
// the disk, so that a restarted executive does not send it again.

#include <cstdint>
#include <deque>
#include <functional>
#include <span>

#include "common/clock.h"
#include "mission/executive/io.h"

namespace dive::mission {

class PayloadGate {
 public:
  /// Longest time for which a command is held back. Then the disk counts as dead: a command marked
  /// `once` is not sent at all, any other one is sent.
  static constexpr Utime kLimit = 5 * kMicrosecondsPerSecond;

  using Send = std::function<void(const ActionRecord& command)>;

  /// Called once per tick with the actions of its step: sends the commands that may go, in their
  /// order. `is_on_disk`: the journal has all commands so far.
  void pass(Utime now, std::span<const ActionRecord> actions, bool is_on_disk, const Send& send);

  /// Number of commands that were not sent.
  [[nodiscard]] std::int64_t withheld() const { return withheld_; }

 private:
  struct Held {
    Utime since = 0;
    ActionRecord command;
  };
  std::deque<Held> held_;
  std::int64_t withheld_ = 0;
};

}  // namespace dive::mission
