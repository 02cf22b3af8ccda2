#include "common/priority.h"

#include <sched.h>

namespace dive {
namespace {

constexpr int kPriority = 20;  // below the kernel's own threads, above all ordinary ones

}  // namespace

bool set_realtime_priority() {
  const sched_param wanted{.sched_priority = kPriority};
  return ::sched_setscheduler(0, SCHED_FIFO, &wanted) == 0;
}

void set_normal_priority() {
  const sched_param ordinary{.sched_priority = 0};
  ::sched_setscheduler(0, SCHED_OTHER, &ordinary);
}

}  // namespace dive
