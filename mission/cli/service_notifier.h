#pragma once
// Notifies the service manager of a dive (sd_notify(3)): READY=1 when it has begun, then a
// STATUS= line and, with a watchdog, WATCHDOG=1 at half its period or once a second, STOPPING=1 at
// its end. Sent by another thread; the watchdog's message comes from the control loop, so that a
// loop that hangs is noticed. Does nothing without NOTIFY_SOCKET in the environment.

#include <chrono>
#include <optional>

#include "common/background_output.h"
#include "mission/executive/io.h"

namespace dive::mission {

class ServiceNotifier {
 public:
  ServiceNotifier();

  /// Called every tick.
  void observe(const StepOutputs& outputs);
  /// The dive has ended.
  void end_dive();

 private:
  std::optional<BackgroundOutput> output_;
  std::chrono::steady_clock::duration period_ = std::chrono::seconds(1);
  std::chrono::steady_clock::time_point next_;
  bool is_watched_ = false;
  bool is_ready_ = false;
};

}  // namespace dive::mission
