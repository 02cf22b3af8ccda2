#include "mission/cli/service_notifier.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

namespace dive::mission {
namespace {

constexpr std::size_t kQueueBytes = 64U << 10U;
constexpr auto kLastMessage = std::chrono::seconds(1);

}  // namespace

ServiceNotifier::ServiceNotifier() {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return;
  std::uint64_t watchdog_us = 0;
  is_watched_ = sd_watchdog_enabled(0, &watchdog_us) > 0;
  if (is_watched_) {
    period_ = std::min<std::chrono::steady_clock::duration>(
        period_, std::chrono::microseconds(watchdog_us / 2));
  }
  output_.emplace(kQueueBytes, WhenFull::kDrop, [](std::span<const std::uint8_t> message) {
    sd_notify(0, std::string(message.begin(), message.end()).c_str());
  });
}

void ServiceNotifier::observe(const StepOutputs& outputs) {
  if (!output_ || (!is_ready_ && outputs.status.state.empty())) return;
  const auto now = std::chrono::steady_clock::now();
  if (is_ready_ && now < next_) return;
  next_ = now + period_;
  const Status& status = outputs.status;
  const std::string goal = status.goal.empty() ? "" : " -> " + status.goal;
  const std::string rung = status.rung == "none" ? "" : " [" + status.rung + "]";
  output_->push(fmt::format("{}{}STATUS={}{}, depth {:.1f} m{}", is_ready_ ? "" : "READY=1\n",
                            is_watched_ ? "WATCHDOG=1\n" : "", status.state, goal, status.depth_m,
                            rung));
  is_ready_ = true;
}

void ServiceNotifier::end_dive() {
  if (!output_) return;
  output_->push(std::string_view("STOPPING=1"));
  output_->close(kLastMessage);
}

}  // namespace dive::mission
