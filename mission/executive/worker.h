#pragma once
// What the services that work off the control thread have in common.

#include <chrono>
#include <future>

namespace dive::mission {

/// What a service does when it is polled and its worker is late: in simulation it waits, so that a
/// dive does not depend on the machine; on a vehicle nothing may hold up the control loop.
enum class Late { kWait, kNotYet };

template <class Result>
[[nodiscard]] bool is_busy(const std::future<Result>& work) {
  return work.valid() && work.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

}  // namespace dive::mission
