#include "planning/map_matching/map_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "planning/map_matching/scan_limits.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kRays = 160;     // of a scan
constexpr double kPlace = 1.0;         // m, edge of a place
constexpr int kMinRays = 2;            // of a place: one alone may be a particle
constexpr double kAgrees = 0.25;       // m from a mapped surface, for a position without error
constexpr double kBeside = 0.1;        // m to each side of a ray, for a position without error
constexpr double kNearSurface = -0.1;  // m: a ray that leaves the water ends there
constexpr double kFreeStep = 1.0;      // m along a ray where no surface is within that distance
constexpr double kMinStep = 0.05;      // m along a ray that passes close to a surface
constexpr double kHit = 0.03;          // m from a surface: the ray meets it
constexpr double kFacing = -0.2;       // n . d of a surface that a ray meets
constexpr double kGround = 0.9;        // n . z of a surface that is flat ground
constexpr int kMaxSteps = 60;          // of one ray
constexpr int kGone = 5;               // rays that see through an object that is gone
constexpr int kForEachOnIt = 3;        // of them, for each ray that meets it

struct Ray {
  Vector3d from_W;
  Vector3d direction_W;  // unit
  double range;          // m, up to kMaxRange
  bool is_return;        // the range is that of a surface

  [[nodiscard]] Vector3d at(double range_m) const { return from_W + range_m * direction_W; }
};

struct Hit {
  double range;     // m
  double incident;  // |n . d|
  bool is_ground;
  int object;
};

enum class Finding { kConfirmed, kMissing, kUnmapped };

struct Vote {
  std::array<std::int32_t, 3> place;
  Finding finding;
  int object;  // on the map; -1: none

  auto operator<=>(const Vote&) const = default;
};

// The first mapped surface that a ray meets up to `end` (m), by steps of the distance from the
// nearest surface. Empty inside grazing corners, where no step gets on.
std::optional<Hit> first_hit(const MapSurface& surface, const Ray& ray, double end) {
  double range = kMinRange;
  for (int step = 0; step < kMaxSteps && range < end; ++step) {
    const Vector3d x = ray.at(range);
    const auto nearest = surface.nearest(x, ray.from_W, kFreeStep);
    if (!nearest) {
      range += kFreeStep;
      continue;
    }
    const double along = nearest->normal_W.dot(ray.direction_W);
    const bool is_ground = nearest->normal_W.z() > kGround;
    if (nearest->height < -kHit)
      return Hit{range, 1.0, is_ground, nearest->object};  // inside a solid
    if (nearest->height < kHit && along < kFacing)
      return Hit{range, -along, is_ground, nearest->object};
    range += std::max(nearest->height, kMinStep);
  }
  return std::nullopt;
}

// True if four rays parallel to this one, `beside_m` to its sides, meet surfaces too, all of them
// well before its measured range.
bool is_in_the_way(const MapSurface& surface, const Ray& ray, double beside_m, double tolerance) {
  const Vector3d& d = ray.direction_W;
  const Vector3d u = d.unitOrthogonal();
  const Vector3d v = d.cross(u);
  return std::ranges::all_of(std::array<Vector3d, 4>{u, -u, v, -v}, [&](const Vector3d& side) {
    Ray parallel = ray;
    parallel.from_W += beside_m * side;
    const auto hit = first_hit(surface, parallel, ray.range);
    return hit && (ray.range - hit->range) * hit->incident > tolerance;
  });
}

std::optional<Vote> vote(const MapSurface& surface, const Ray& ray, double sigma_m) {
  const auto at = [&](double range, Finding finding, int object) {
    const Vector3d place = (ray.at(range) / kPlace).array().floor();
    return Vote{{static_cast<std::int32_t>(place.x()), static_cast<std::int32_t>(place.y()),
                 static_cast<std::int32_t>(place.z())},
                finding,
                object};
  };
  const double tolerance = kAgrees + kSigmas * sigma_m + kRangeShare * ray.range;
  const auto hit = first_hit(surface, ray, std::min(ray.range + tolerance, kMaxRange));
  if (hit) {
    const double beyond = (ray.range - hit->range) * hit->incident;
    if (beyond > tolerance) {
      const double beside = kBeside + kSigmas * sigma_m;
      if (!is_in_the_way(surface, ray, beside, tolerance)) return std::nullopt;
      return at(hit->range, Finding::kMissing, hit->object);
    }
    if (!ray.is_return || hit->is_ground) return std::nullopt;
    if (beyond >= -tolerance) return at(ray.range, Finding::kConfirmed, hit->object);
  }
  if (!ray.is_return) return std::nullopt;
  const auto nearest = surface.nearest(ray.at(ray.range), ray.from_W, tolerance);
  if (!nearest) return at(ray.range, Finding::kUnmapped, -1);
  if (nearest->normal_W.z() > kGround) return std::nullopt;
  return at(ray.range, Finding::kConfirmed, nearest->object);
}

// The object that most rays see through, and few meet; -1: none.
int missing_object(std::vector<Vote> votes) {
  std::ranges::sort(votes, {}, &Vote::object);
  int gone = -1;
  int most = kGone - 1;
  for (auto first = votes.begin(); first != votes.end();) {
    const auto last = std::find_if(first, votes.end(),
                                   [&](const Vote& vote) { return vote.object != first->object; });
    const auto through = static_cast<int>(std::count_if(
        first, last, [](const Vote& vote) { return vote.finding == Finding::kMissing; }));
    const auto on_it = static_cast<int>(last - first) - through;
    if (first->object >= 0 && through > most && through > kForEachOnIt * on_it) {
      most = through;
      gone = first->object;
    }
    first = last;
  }
  return gone;
}

std::vector<Ray> rays_of(const RangeScan& scan, const Pose& X_WB) {
  std::vector<Ray> rays;
  const Vector3d origin_B = scan.origin_B.cast<double>();
  const Vector3d from_W = X_WB * origin_B;
  if (from_W.z() > kNearSurface) return rays;
  const std::size_t stride = std::max<std::size_t>(1, scan.points_B.size() / kRays);
  for (std::size_t i = stride / 2; i < scan.points_B.size(); i += stride) {
    const Vector3d along_W = X_WB.q * (scan.points_B[i].cast<double>() - origin_B);
    const double range = along_W.norm();
    if (!(range >= kMinRange)) continue;
    const Vector3d direction_W = along_W / range;
    const double water = direction_W.z() > 0.0 ? (kNearSurface - from_W.z()) / direction_W.z()
                                               : std::numeric_limits<double>::infinity();
    const double most = std::min({kMaxRange, static_cast<double>(scan.reach), water});
    rays.push_back({from_W, direction_W, std::min(range, most), range <= most});
  }
  return rays;
}

}  // namespace

MapAgreement agreement(const MapSurface& surface, const RangeScan& scan, const Pose& X_WB,
                       double sigma_m) {
  std::vector<Vote> votes;
  for (const Ray& ray : rays_of(scan, X_WB)) {
    if (const auto one = vote(surface, ray, sigma_m)) votes.push_back(*one);
  }
  std::ranges::sort(votes);
  MapAgreement result;
  result.missing_object = missing_object(votes);
  for (auto first = votes.begin(); first != votes.end();) {
    std::array<int, 3> rays{};
    auto last = first;
    for (; last != votes.end() && last->place == first->place; ++last) {
      ++rays[static_cast<std::size_t>(last->finding)];
    }
    first = last;
    const auto most = std::ranges::max_element(rays);
    if (*most < kMinRays) continue;
    switch (static_cast<Finding>(most - rays.begin())) {
      case Finding::kConfirmed:
        ++result.confirmed;
        break;
      case Finding::kMissing:
        ++result.missing;
        break;
      case Finding::kUnmapped:
        ++result.unmapped;
        break;
    }
  }
  return result;
}

}  // namespace dive::planning
