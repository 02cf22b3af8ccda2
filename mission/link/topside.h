#pragma once
// The operator's end of the link.

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/executive/io.h"
#include "vehicle/link/bus.h"

namespace dive::mission {

/// Sends `command` repeatedly until it is answered. `url` is that of the bus, for messages. The
/// error is a sentence: no executive received within `timeout_s`, or no answer.
[[nodiscard]] tl::expected<link::RequestResult, std::string> ask(OperatorCommand command,
                                                                 link::Bus& bus,
                                                                 const std::string& url,
                                                                 Clock& clock, double timeout_s);

struct VehicleStatus {
  link::Heartbeat heartbeat;
  Status status;
  estimation::StateEstimate estimate;
  std::optional<HealthSample> health;
};

/// The executive's status, as soon as one is received.
[[nodiscard]] tl::expected<VehicleStatus, std::string> listen(link::Bus& bus,
                                                              const std::string& url, Clock& clock,
                                                              double timeout_s);

}  // namespace dive::mission
