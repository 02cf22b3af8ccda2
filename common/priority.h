#pragma once
// Who is served first when the machine has too much to do.

namespace dive {

/// The calling thread, and those it starts from now on, run before all ordinary ones (SCHED_FIFO).
/// False where the system does not permit it: it takes root, CAP_SYS_NICE or an rtprio limit.
bool run_first();

/// The calling thread is an ordinary one again.
void run_as_others();

}  // namespace dive
