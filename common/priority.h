#pragma once
// Thread priorities on a machine under full load.

namespace dive {

/// Runs the calling thread, and those it starts from now on, before all ordinary ones (SCHED_FIFO).
/// False where the system does not permit it: root, CAP_SYS_NICE or an rtprio limit is required.
bool set_realtime_priority();

/// Returns the calling thread to ordinary priority.
void set_normal_priority();

}  // namespace dive
