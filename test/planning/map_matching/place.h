#pragma once
// A floor and boxes, as the vehicle's map knows them and as a scan meets them: for the tests of map
// matching.

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "common/random.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::planning::testing {

using Eigen::Vector3d;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr float kReach = 10.0F;

// Distance along a ray to an upright box turned by `yaw`, by the slabs that bound it.
struct UprightBox {
  Vector3d centre;
  Vector3d size;
  double yaw = 0.0;

  [[nodiscard]] double range(const Vector3d& origin, const Vector3d& direction) const {
    const Eigen::AngleAxisd back(-yaw, Vector3d::UnitZ());
    const Vector3d o = back * (origin - centre);
    const Vector3d d = back * direction;
    double enter = 0.0;
    double leave = kInfinity;
    for (int k = 0; k < 3; ++k) {
      const double a = (-0.5 * size[k] - o[k]) / d[k];
      const double b = (0.5 * size[k] - o[k]) / d[k];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter > 0.0 && enter <= leave ? enter : kInfinity;
  }
};

struct Place {
  double floor_z = -4.0;
  std::vector<UprightBox> boxes;

  [[nodiscard]] World map() const {
    World world;
    world.obstacles.push_back(
        {"floor", HalfSpace{Vector3d::UnitZ()}, Pose{{0.0, 0.0, floor_z}, {1, 0, 0, 0}}});
    for (const UprightBox& box : boxes) {
      world.obstacles.push_back({"box", Box{box.size}, Pose{box.centre, from_rpy(0, 0, box.yaw)}});
    }
    return world;
  }

  [[nodiscard]] RangeScan scan(const Pose& X_WB, Random& random, double noise = 0.01,
                               int columns = 40, int rows = 30) const {
    RangeScan scan;
    scan.utime = 1'000'000;
    scan.reach = kReach;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const Vector3d along_B =
            from_rpy(0.0, 0.6, 0.0) *
            Vector3d(1.0, 1.7 * (0.5 - (column + 0.5) / columns), 1.0 * (0.5 - (row + 0.5) / rows));
        const Vector3d direction = X_WB.q * along_B.normalized();
        double range = direction.z() < 0.0 ? (floor_z - X_WB.p.z()) / direction.z() : kInfinity;
        for (const UprightBox& box : boxes) range = std::min(range, box.range(X_WB.p, direction));
        range = range < kReach ? range + noise * random.normal() : 2.0 * kReach;
        scan.points_B.push_back((range * along_B.normalized()).cast<float>());
      }
    }
    return scan;
  }
};

}  // namespace dive::planning::testing
