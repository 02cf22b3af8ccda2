#include "mission/link/payload_gate.h"

namespace dive::mission {

void PayloadGate::pass(Utime now, std::span<const ActionRecord> actions, bool is_on_disk,
                       const Send& send) {
  for (const ActionRecord& action : actions) {
    if (action.kind == ActionRecord::Kind::kPayload) held_.push_back({now, action});
  }
  while (!held_.empty()) {
    const Held& next = held_.front();
    const bool is_late = now - next.since >= kLimit;
    if (!is_on_disk && !is_late) return;
    if (is_on_disk || !next.command.once) {
      send(next.command);
    } else {
      ++withheld_;
    }
    held_.pop_front();
  }
}

}  // namespace dive::mission
