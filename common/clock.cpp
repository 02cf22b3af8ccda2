#include "common/clock.h"

#include <chrono>

namespace dive {

Utime SteadyClock::now() {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  return duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace dive
