#include "planning/map_matching/object_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "planning/map_matching/scan_limits.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Object = ObjectCells::Object;

constexpr double kNear = 0.25;        // m from the object, for a position without error
constexpr double kMayMiss = 0.1;      // m: a ray without a return may have met the object
constexpr double kHitsObject = 0.01;  // m from the surface: the ray meets it
constexpr double kObjectStep = 0.02;  // m along a ray
constexpr double kAtWaves = -0.1;     // m: the range of a ray that leaves the water is a wave's
constexpr int kThrough = 3;           // rays through a free cell
// Rays that end at an occupied cell, in all, and one for each so many that pass through it: the
// cell fills the view of a close camera, and particles of marine snow are before it.
constexpr int kOnIt = 6;
constexpr int kThroughForEachOnIt = 4;
constexpr int kForEachLost = 3;  // rays through a free cell, for each without a return

struct ObjectRay {
  Vector3d from_W;
  Vector3d direction_W;  // unit
  double range;          // m; of a ray without a return as far as it counts
  bool is_return;

  [[nodiscard]] Vector3d at(double range_m) const { return from_W + range_m * direction_W; }
};

std::optional<ObjectRay> ray_to(const Eigen::Vector3f& point_B, const RangeScan& scan,
                                const Pose& X_WB) {
  const Vector3d origin_B = scan.origin_B.cast<double>();
  const Vector3d along_W = X_WB.q * (point_B.cast<double>() - origin_B);
  const double range = along_W.norm();
  if (!(range >= kMinRange)) return std::nullopt;
  const double reach = static_cast<double>(scan.reach);
  ObjectRay ray{X_WB * origin_B, along_W / range, std::min(range, reach), range <= reach};
  if (ray.at(ray.range).z() > kAtWaves) ray.is_return = false;
  return ray;
}

// The part of the ray in the box, m; empty: from > to.
struct Stretch {
  double from = kMinRange;
  double to = kMaxRange;
};
Stretch stretch_in(const AlignedBox3d& box, const ObjectRay& ray) {
  Stretch stretch;
  for (int k = 0; k < 3; ++k) {
    const double a = (box.min()[k] - ray.from_W[k]) / ray.direction_W[k];
    const double b = (box.max()[k] - ray.from_W[k]) / ray.direction_W[k];
    stretch.from = std::max(stretch.from, std::min(a, b));  // a NaN changes nothing
    stretch.to = std::min(stretch.to, std::max(a, b));
  }
  return stretch;
}

// The rays of one scan at one object, by its cells.
class ObjectScan {
 public:
  ObjectScan(const MapSurface& surface, const Object& object, double sigma_m)
      : surface_(surface),
        object_(object),
        error_m_(kSigmas * sigma_m),
        counts_(object.cells.size()) {}

  void add(const ObjectRay& ray) {
    const double near = kNear + error_m_ + kRangeShare * ray.range;
    if (ray.is_return && ends_near(ray, near)) return;
    const double beside = ray.is_return ? kHitsObject : kMayMiss + error_m_;
    const Vector3d margin = Vector3d::Constant(beside);
    Stretch stretch = stretch_in({object_.box.min() - margin, object_.box.max() + margin}, ray);
    stretch.to = std::min(stretch.to, ray.range);
    int last = -1;
    while (stretch.from <= stretch.to) {
      const Vector3d x = ray.at(stretch.from);
      const double distance = surface_.distance(object_.obstacles.first, x, kMaxRange);
      if (distance < beside) {
        if (const auto cell = object_.cell_at(x); cell && *cell != last) {
          last = *cell;
          ++(ray.is_return ? counts_[at(last)].through : counts_[at(last)].lost);
        }
      }
      stretch.from += std::max(distance - beside, kObjectStep);
    }
  }

  void append(std::int32_t index, std::vector<CellSighting>& sightings) const {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      const Count& count = counts_[i];
      const bool is_occupied =
          count.on_it >= kOnIt && kThroughForEachOnIt * count.on_it >= count.through;
      const bool is_free = !count.is_disputed && count.through >= kThrough &&
                           count.through >= kForEachLost * count.lost;
      if (is_occupied || is_free) {
        sightings.push_back({index, static_cast<std::int32_t>(i), !is_occupied});
      }
    }
  }

 private:
  struct Count {
    int through = 0;
    int lost = 0;   // without a return
    int on_it = 0;  // end where only this object explains it
    bool is_disputed = false;
  };

  static std::size_t at(int cell) { return static_cast<std::size_t>(cell); }

  bool ends_near(const ObjectRay& ray, double near) {
    const Vector3d end = ray.at(ray.range);
    if (object_.box.squaredExteriorDistance(end) > near * near) return false;
    if (surface_.distance(object_.obstacles.first, end, near) >= near) return false;
    const bool is_explained =
        surface_.is_near(end, near, [&](int object) { return object == object_.obstacles.first; });
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (object_.cells[i].squaredExteriorDistance(end) > near * near) continue;
      counts_[i].is_disputed = true;
      if (!is_explained) ++counts_[i].on_it;
    }
    return true;
  }

  const MapSurface& surface_;
  const Object& object_;
  double error_m_;
  std::vector<Count> counts_;
};

}  // namespace

std::vector<CellSighting> observe_objects(const MapSurface& surface, const ObjectCells& objects,
                                          const RangeScan& scan, const Pose& X_WB, double sigma_m) {
  std::vector<ObjectRay> rays;
  rays.reserve(scan.points_B.size());
  for (const Eigen::Vector3f& point_B : scan.points_B) {
    if (const auto ray = ray_to(point_B, scan, X_WB)) rays.push_back(*ray);
  }
  const Vector3d from_W = X_WB * scan.origin_B.cast<double>();
  std::vector<CellSighting> sightings;
  for (std::size_t i = 0; i < objects.objects().size(); ++i) {
    const Object& object = objects.objects()[i];
    if (object.box.squaredExteriorDistance(from_W) > kMaxRange * kMaxRange) continue;
    ObjectScan one(surface, object, sigma_m);
    for (const ObjectRay& ray : rays) one.add(ray);
    one.append(static_cast<std::int32_t>(i), sightings);
  }
  return sightings;
}

}  // namespace dive::planning
