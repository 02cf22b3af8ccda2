#pragma once
// What the scans of the last seconds say of the known map: is it the map of this place?

#include <array>
#include <cstddef>

#include "common/clock.h"
#include "common/map_fix.h"

namespace dive::behaviors {

/// Allocates nothing.
class MapEvidence {
 public:
  /// Time over which scans are counted, s.
  static constexpr double kSeconds = 8.0;

  /// Adds the agreement of one scan; scans come in the order of their times.
  void add(Utime scan_utime, const MapAgreement& agreement);
  struct Sum {
    MapAgreement places;  ///< Each counted in every scan that shows it.
    int scans = 0;        ///< Number of scans that say anything.

    /// True if these scans show another place than the map. A few objects that the map lacks, or
    /// that are gone, do not: they come among others that are where the map has them.
    [[nodiscard]] bool contradicts_map() const;
  };
  /// Agreement of the scans of the last kSeconds with the map.
  [[nodiscard]] Sum sum(Utime now) const;

 private:
  struct Scan {
    Utime utime = 0;
    MapAgreement agreement;
  };
  static constexpr std::size_t kScans = 32;  ///< At two a second more than kSeconds hold.

  std::array<Scan, kScans> scans_{};  ///< A ring; the time 0 stands for none.
  std::size_t next_ = 0;
};

}  // namespace dive::behaviors
