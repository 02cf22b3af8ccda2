// The IMP-* rules, and the rules for foreign missions of any format.

#include <algorithm>

#include <fmt/format.h>

#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

constexpr double kSurfaced = 0.5;     // m: shallower counts as the surface
constexpr double kRatedDepth = 37.0;  // m, of the Aqua2, as published in 2010 (120 ft)

using Eigen::Vector2d;

constexpr Rule kRules[] = {
    {"IMP-ACFR", Severity::kError, "The file is an ACFR mission that can be converted."},
    {"IMP-QGC", Severity::kError, "The file is a QGroundControl plan for an underwater vehicle."},
    {"IMP-UNKNOWN", Severity::kWarning, "Every element of the file is known."},
    {"IMP-PRIMITIVE", Severity::kWarning,
     "Every primitive in the file exists in the file's own software."},
    {"IMP-COMMAND", Severity::kWarning, "Every command has a counterpart in the mission."},
    {"IMP-PATTERN", Severity::kWarning, "Patterns are swum as the file's own vehicle swims them."},
    {"IMP-CHANGED", Severity::kWarning, "Values of the file are possible in a mission."},
    {"IMP-MODE", Severity::kWarning, "Every leg has a depth mode, depth or altitude."},
    {"IMP-DATUM", Severity::kWarning, "Heights are above a datum that is at the surface."},
    {"IMP-TIMEOUT", Severity::kWarning, "Every leg can be finished within its own timeout."},
    {"IMP-SPEED", Severity::kWarning, "All legs are swum at a speed that the aqua2 can swim."},
    {"IMP-DEPTH", Severity::kWarning, "No leg is deeper than the aqua2 is rated for."},
    {"IMP-ALTITUDE", Severity::kWarning, "Legs do not need an altimeter."},
    {"IMP-SUBMERGED", Severity::kWarning, "The mission ends at the surface."},
    {"IMP-SCALED", Severity::kNote, "Where the speed changes, timeouts change by the same ratio."},
    {"IMP-PAYLOAD", Severity::kNote, "The payload accepts the commands of the mission."},
    {"IMP-ORIGIN", Severity::kNote,
     "Latitudes and longitudes become metres about the mission's origin."},
    {"IMP-LEFT-OUT", Severity::kNote, "Elements without a counterpart in a mission are left out."},
    {"IMP-ADDED", Severity::kNote, "Elements that a mission needs and the file lacks are added."},
};

// Minimum length, m, to swim from `from` to complete the leg.
double least_length(const ForeignLeg& leg, const Vector2d& from) {
  double length = (leg.points.front() - from).norm();
  for (std::size_t i = 1; i < leg.points.size(); ++i) {
    length += (leg.points[i] - leg.points[i - 1]).norm();
  }
  return std::max(length - leg.capture_radius, 0.0);
}

void check_leg(const ForeignLeg& leg, const Vector2d& from, ImportReport& report) {
  const double length = least_length(leg, from);
  if (leg.speed && leg.timeout_s && length > *leg.speed * *leg.timeout_s) {
    report.warning("IMP-TIMEOUT", leg.span,
                   fmt::format("{:.0f} m at {:g} m/s take {:.0f} s, and the timeout is {:g} s",
                               length, *leg.speed, length / *leg.speed, *leg.timeout_s),
                   {}, "the leg is cut off before its end, and the next leg starts elsewhere");
  }
  if (leg.is_altitude) {
    report.warning(
        "IMP-ALTITUDE", leg.span,
        "the leg keeps an altitude, and the aqua2 has no altimeter: it is taken from the "
        "map's ground",
        fmt::format("{:g} m", leg.z), "put a map with the real ground in its place");
  } else if (leg.z > kRatedDepth) {
    report.warning(
        "IMP-DEPTH", leg.span,
        fmt::format("the leg is deeper than the {:g} m that the aqua2 is rated for", kRatedDepth),
        fmt::format("{:g} m", leg.z));
  }
}

}  // namespace

std::span<const Rule> import_rules() { return kRules; }

void report_defects(const ForeignMission& mission, ImportReport& report) {
  Vector2d at = start_of(mission);
  for (const ForeignLeg& leg : mission.legs) {
    check_leg(leg, at, report);
    at = leg.points.back();
  }
  const ForeignLeg& last = mission.legs.back();
  if (!last.is_altitude && last.z <= kSurfaced) return;
  report.warning("IMP-SUBMERGED", last.span,
                 fmt::format("the mission ends here, at {:g} m {}: ours surfaces afterwards",
                             last.z, last.is_altitude ? "above the ground" : "depth"));
}

}  // namespace dive::mission
