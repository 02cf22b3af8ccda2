// Rules about start and goals, each by itself, in the world.

#include <fmt/format.h>

#include "mission/check/site.h"

namespace dive::mission {
namespace {

// True if its depth depends on the map. (mission/document checks the others.)
bool is_by_altitude(const Spot& spot) { return spot.position->z_units == ZUnits::kAltitude; }

}  // namespace

void positions_have_ground(Site& site) {
  for (const Spot& spot : site.spots()) {
    if (site.in_world(*spot.position)) continue;
    site.error("CHK-NO-GROUND", spot.position->z.span,
               fmt::format("{} uses ALTITUDE, but there is no ground below", spot.name),
               "give its DEPTH");
  }
  for (const TagSpec& tag : site.mission.tags) {
    if (site.in_world(tag.position)) continue;
    site.error("CHK-NO-GROUND", tag.position.z.span,
               fmt::format("the tag {} uses ALTITUDE, but there is no ground below", tag.id.value),
               "give its DEPTH");
  }
}

void positions_are_in_the_water(Site& site) {
  const double max_depth = site.mission.limits.max_depth.value;
  for (const Spot& spot : site.spots()) {
    const auto p_W = site.in_world(*spot.position);
    if (!is_by_altitude(spot) || !p_W) continue;
    if (p_W->z() > 0.0) {
      site.error("CHK-ABOVE-SURFACE", spot.position->z.span,
                 fmt::format("{} is {:.2f} m above the surface: the ground is only {:.2f} m deep",
                             spot.name, p_W->z(), spot.position->z.value - p_W->z()));
    } else if (-p_W->z() > max_depth) {
      site.error(
          "CHK-TOO-DEEP", spot.position->z.span,
          fmt::format("{} is {:.2f} m deep, deeper than max_depth {:g} m ({})", spot.name,
                      -p_W->z(), max_depth,
                      site.mission.source.line_name(site.mission.limits.max_depth.span.line)));
    }
  }
}

void positions_are_clear(Site& site) {
  const Located<double>& clearance = site.mission.limits.clearance;
  const std::vector<Spot> spots = site.spots();
  // Whether a start's clearance suffices depends on the path that leaves it: see CHK-PLAN.
  const bool start_is_left = spots.size() > 1;
  for (const Spot& spot : spots) {
    const auto p_W = site.in_world(*spot.position);
    if (!p_W) continue;
    const auto contact = site.nearest(*p_W, spot.heading_deg, clearance.value);
    if (!contact || contact->distance >= clearance.value) continue;
    const std::string& obstacle = site.obstacle_name(contact->obstacle);
    if (contact->distance <= 0.0) {
      site.error("CHK-INSIDE", spot.position->x.span,
                 fmt::format("{} is inside '{}'", spot.name, obstacle));
    } else if (spot.position != &site.mission.start || !start_is_left) {
      site.error("CHK-CLEARANCE", spot.position->x.span,
                 fmt::format("{} is {:.2f} m from '{}', nearer than the clearance of {:g} m ({})",
                             spot.name, contact->distance, obstacle, clearance.value,
                             site.mission.source.line_name(clearance.span.line)));
    }
  }
}

// Measured from the vehicle's centre, as by an altimeter.
void positions_keep_altitude(Site& site) {
  const Located<double>& limit = site.mission.limits.min_altitude;
  for (const Spot& spot : site.spots()) {
    const auto p_W = site.in_world(*spot.position);
    const auto floor_z = p_W ? site.ground_below(*p_W) : std::nullopt;
    if (!floor_z) continue;
    const double altitude = p_W->z() - *floor_z;
    if (altitude <= 0.0 || altitude >= limit.value) continue;  // inside an obstacle: CHK-INSIDE
    site.error("CHK-ALTITUDE", spot.position->z.span,
               fmt::format("{} is {:.2f} m above the ground, less than min_altitude {:g} m ({})",
                           spot.name, altitude, limit.value,
                           site.mission.source.line_name(limit.span.line)));
  }
}

void overheads_are_declared(Site& site) {
  for (const Spot& spot : site.spots()) {
    const auto p_W = site.in_world(*spot.position);
    const int obstacle = p_W && !spot.overhead_declared ? site.overhead(*p_W) : -1;
    if (obstacle < 0) continue;
    site.warning("CHK-OVERHEAD", spot.position->x.span,
                 fmt::format("{} is under '{}', but its state does not declare the overhead",
                             spot.name, site.obstacle_name(obstacle)),
                 "write overhead=\"true\", so that an abort looks for open water first");
  }
}

}  // namespace dive::mission
