#include "behaviors/map_evidence.h"

#include <algorithm>

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

bool MapEvidence::is_recent(const Scan& scan, Utime now) {
  return scan.utime != 0 && to_seconds(now - scan.utime) <= kSeconds;
}

MapAgreement MapEvidence::sum(Utime now) const {
  MapAgreement sum;
  for (const Scan& scan : scans_) {
    if (!is_recent(scan, now)) continue;
    sum.confirmed += scan.agreement.confirmed;
    sum.missing += scan.agreement.missing;
    sum.unmapped += scan.agreement.unmapped;
  }
  return sum;
}

bool MapEvidence::contradicts_map(Utime now) const {
  const auto scans = std::ranges::count_if(scans_, [&](const Scan& scan) {
    return is_recent(scan, now) && scan.agreement.places() > 0;
  });
  if (scans < kLeastScans) return false;
  const MapAgreement places = sum(now);
  const bool are_enough = places.missing >= kMissing || places.unmapped >= kUnmapped;
  return are_enough && places.contradicts();
}

}  // namespace dive::behaviors
