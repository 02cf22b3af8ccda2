#pragma once
// Detects scans that a working sensor does not send.

#include <cstdint>
#include <optional>

#include "common/clock.h"
#include "common/range_scan.h"

namespace dive::planning {

/// Reason why a scan is rejected.
enum class ScanProblem {
  kNone,
  kEmpty,      ///< No ray has a range, or there are more than kMaxScanPoints.
  kRepeated,   ///< Equal to the last scan, bit for bit: the sensor is frozen.
  kBackwards,  ///< Not newer than the last scan.
};

class ScanCheck {
 public:
  /// Checks the next scan. Scans of open water are all equal, and none of them is repeated.
  [[nodiscard]] ScanProblem check(const RangeScan& scan);

 private:
  std::optional<Utime> last_utime_;
  std::uint64_t last_digest_ = 0;
};

}  // namespace dive::planning
