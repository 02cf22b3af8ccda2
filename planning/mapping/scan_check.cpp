#include "planning/mapping/scan_check.h"

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/fnv.h"

namespace dive::planning {
namespace {

std::uint64_t digest(const std::vector<Eigen::Vector3f>& points) {
  Fnv1a64 digest;
  digest.add(std::span(reinterpret_cast<const std::uint8_t*>(points.data()),
                       points.size() * sizeof(Eigen::Vector3f)));
  return digest.value();
}

}  // namespace

ScanProblem ScanCheck::check(const RangeScan& scan) {
  bool any = false;
  bool any_near = false;  // scans of open water are all equal
  for (const Eigen::Vector3f& p_B : scan.points_B) {
    if (!p_B.allFinite()) continue;
    any = true;
    any_near |= (p_B - scan.origin_B).norm() <= scan.reach;
  }
  if (!any || scan.points_B.size() > kMaxScanPoints) return ScanProblem::kEmpty;
  if (last_utime_ && scan.utime <= *last_utime_) return ScanProblem::kBackwards;
  const std::uint64_t hash = digest(scan.points_B);
  if (any_near && last_utime_ && hash == last_digest_) return ScanProblem::kRepeated;
  last_utime_ = scan.utime;
  last_digest_ = hash;
  return ScanProblem::kNone;
}

}  // namespace dive::planning
