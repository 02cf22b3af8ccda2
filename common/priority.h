#pragma once
// Thread priorities on a machine under full load.

namespace dive {

/// Runs the calling thread, and those it starts from now on, before all ordinary ones (SCHED_FIFO).
/// False where the system does not permit it: root, CAP_SYS_NICE or an rtprio limit is required.
bool run_first();

/// Returns the calling thread to ordinary priority.
void run_as_others();

}  // namespace dive
