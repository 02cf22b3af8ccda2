#include "mission/card/checklist.h"

#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace dive::mission {
namespace {

std::string vertical(const Position& position) {
  const double z = position.z.value;
  switch (position.z_units) {
    case ZUnits::kDepth:
      return fmt::format("{:g} m deep", z);
    case ZUnits::kAltitude:
      return fmt::format("{:g} m above the ground", z);
    case ZUnits::kZ:
      return fmt::format("{:g} m deep", -z);
  }
  return {};
}

// What the energy of the route and of the longest exit path leave of a full battery is not known on
// deck; what must be in it is.
std::string battery(const CheckReport& report) {
  const std::optional<TurningPoint> turn = report.budget.first_turning_point();
  const double least = turn ? turn->least_charge : 0.0;
  return fmt::format("Battery full: the route takes {:.1f} Wh, and the return begins at {:.0f} %",
                     report.budget.energy_wh, std::ceil(100.0 * least));
}

}  // namespace

std::vector<std::string> checklist(const Mission& mission, const CheckReport& report) {
  std::vector<std::string> lines = {
      "Mission on the vehicle has the hash below",
      battery(report),
      "Hull closed, leak sensor dry, ballast trimmed",
      "All six flippers move freely",
      "Depth reads 0 m at the surface, heading agrees with a compass",
  };
  if (uses_range_camera(mission)) lines.emplace_back("Range camera clean, scans arrive");
  if (uses_visual_inertial(mission)) {
    lines.emplace_back("Front cameras clean, lamps work, calibration is of these cameras");
  }
  if (!mission.tags.empty()) {
    lines.push_back(fmt::format("{} tag(s) in place as surveyed", mission.tags.size()));
  }
  if (!mission.current.value.is_still()) {
    const Eigen::Vector2d current = mission.current.value.at(0.0);
    const double towards_deg =
        std::fmod(rad_to_deg(std::atan2(current.x(), current.y())) + 360.0, 360.0);
    lines.push_back(
        fmt::format("Current at the start {:.2f} m/s towards {:03.0f}\u00b0, as expected",
                    current.norm(), towards_deg));
  }
  lines.emplace_back("Free disk for log and journal; no old dive.journal");
  lines.emplace_back("Supervisor runs (dive supervise), dive status answers");
  lines.emplace_back("Abort tried from topside (dive abort --lcm URL), divers and boat informed");
  lines.push_back(fmt::format(
      "Released at x {:g} m east, y {:g} m north (within {:g} m), {}, heading {:03.0f}\u00b0",
      mission.start.x.value, mission.start.y.value, 2.0 * mission.priors.start_m,
      vertical(mission.start), mission.start_heading_deg));
  return lines;
}

}  // namespace dive::mission
