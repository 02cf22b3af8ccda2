#include "behaviors/map_evidence.h"

namespace dive::behaviors {
namespace {

constexpr int kLeastScans = 10;  // that say anything: the position has been searched for by then
// Sums over scans: three places in each scan of four seconds, say.
constexpr int kMissing = 20;
constexpr int kUnmapped = 60;

}  // namespace

void MapEvidence::add(Utime scan_utime, const MapAgreement& agreement) {
  scans_[next_] = {scan_utime, agreement};
  next_ = (next_ + 1) % kScans;
}

MapEvidence::Sum MapEvidence::sum(Utime now) const {
  Sum sum;
  for (const auto& [utime, agreement] : scans_) {
    if (utime == 0 || to_seconds(now - utime) > kSeconds) continue;
    sum.places.confirmed += agreement.confirmed;
    sum.places.missing += agreement.missing;
    sum.places.unmapped += agreement.unmapped;
    if (agreement.places() > 0) ++sum.scans;
  }
  return sum;
}

bool MapEvidence::Sum::contradicts_map() const {
  const bool are_enough = places.missing >= kMissing || places.unmapped >= kUnmapped;
  return scans >= kLeastScans && are_enough && places.contradicts();
}

}  // namespace dive::behaviors
