#pragma once
// SIGTERM and SIGINT of `dive run`. While a dive is running the first signal is an abort; a second
// one ends the process at once with status 128 + signal, without a message that the dive has ended,
// so that the supervisor takes over. Before the dive the first signal already ends the process so;
// after it signals are ignored. SIGPIPE and SIGXFSZ are ignored: neither a closed terminal nor a
// file that may not grow ends a dive.

#include <optional>

#include "common/operator_command.h"

namespace dive::mission {

/// One at a time.
class StopSignals {
 public:
  /// Installs the handlers.
  StopSignals();
  /// Restores the handlers of before.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// The abort of a signal, once. The first call begins the dive.
  [[nodiscard]] std::optional<OperatorCommand> take();
  /// The dive has ended: its results are written whatever signals arrive.
  void end_dive();
};

}  // namespace dive::mission
