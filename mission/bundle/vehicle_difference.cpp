#include "mission/bundle/vehicle_difference.h"

#include <algorithm>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace dive::mission {
namespace {

bool is_same(const planning::RobotHull& a, const planning::RobotHull& b) {
  return std::ranges::equal(
      a.parts, b.parts, [](const planning::ConvexSolid& one, const planning::ConvexSolid& other) {
        return one.vertices == other.vertices;
      });
}

std::string extent(const planning::RobotHull& hull) {
  Eigen::AlignedBox3d box;
  for (const planning::ConvexSolid& part : hull.parts) {
    for (const Eigen::Vector3d& v : part.vertices) box.extend(v);
  }
  const Eigen::Vector3d size = box.isEmpty() ? Eigen::Vector3d::Zero().eval() : box.sizes().eval();
  return fmt::format("{} parts, {:.3f} x {:.3f} x {:.3f} m", hull.parts.size(), size.x(), size.y(),
                     size.z());
}

}  // namespace

std::string vehicle_difference(const vehicle::Model& checked, const vehicle::Model& here) {
  if (!is_same(checked.hull, here.hull)) {
    return fmt::format("another hull: it is checked for {} ({}), and this vehicle is {} ({})",
                       checked.name, extent(checked.hull), here.name, extent(here.hull));
  }
  if (checked.mass_kg != here.mass_kg) {
    return fmt::format("another mass: {:g} kg, and this vehicle has {:g} kg", checked.mass_kg,
                       here.mass_kg);
  }
  if (checked.hips_B != here.hips_B || checked.centre_of_mass_B != here.centre_of_mass_B ||
      checked.inertia_B != here.inertia_B) {
    return "another vehicle: its hips, centre of mass or inertia differ";
  }
  for (const MotionCoefficient& coefficient : motion_coefficients()) {
    const double a = coefficient.value(checked.motion);
    const double b = coefficient.value(here.motion);
    if (a == b) continue;
    return fmt::format("another motion model: {} is {:g}, and this vehicle's {:g}",
                       coefficient.name, a, b);
  }
  return {};
}

}  // namespace dive::mission
