#include "common/clock.h"

#include <chrono>

namespace dive {

Utime SteadyClock::now() {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  return duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Utime FastClock::now() {
  return static_cast<Utime>(static_cast<double>(steady_.now() - start_) * factor_);
}

Utime FastClock::real(Utime duration) const {
  return static_cast<Utime>(static_cast<double>(duration) / factor_);
}

}  // namespace dive
