#include <cmath>

#include <fmt/format.h>

#include "mission/export/export_format.h"

namespace dive::mission {
namespace {

// Empty where it is not known.
std::string field(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string();
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + "\"";
}

std::string place(const Exported& exported, const std::optional<Pose>& pose) {
  if (!pose) return exported.origin ? ",,,,," : ",,,";
  std::string text = fmt::format("{:.3f},{:.3f},{:.3f},{:.1f}", pose->p.x(), pose->p.y(),
                                 pose->p.z(), heading_deg(*pose));
  if (!exported.origin) return text;
  const GeoPoint point = to_geographic(*exported.origin, pose->p.head<2>());
  return text + fmt::format(",{:.9f},{:.9f}", point.latitude_deg, point.longitude_deg);
}

std::string place_columns(const Exported& exported, const char* prefix) {
  std::string text = fmt::format("{0}x_m,{0}y_m,{0}z_m,{0}heading_deg", prefix);
  if (exported.origin) text += fmt::format(",{0}latitude_deg,{0}longitude_deg", prefix);
  return text;
}

std::string track(const Exported& exported) {
  std::string text =
      fmt::format("time_s,{},{},sigma_m,depth_m,speed_mps,battery_fraction,state,goal,rung\r\n",
                  place_columns(exported, "true_"), place_columns(exported, "estimated_"));
  for (const ExportedSample& sample : exported.track) {
    text += fmt::format("{:.3f},{},{},{},{},{},{},{},{},{}\r\n", sample.t_s,
                        place(exported, sample.truth), place(exported, sample.estimate),
                        field(sample.sigma_m, 3), field(sample.depth_m, 3),
                        field(sample.speed_mps, 3), field(sample.battery, 4), quoted(sample.state),
                        quoted(sample.goal), quoted(sample.rung));
  }
  return text;
}

}  // namespace

std::string to_csv(const Exported& exported) {
  if (!exported.track.empty()) return track(exported);
  std::string text =
      fmt::format("state,goal,waypoint,{},depth_m,clearance_m\r\n", place_columns(exported, ""));
  for (const ExportedPath& path : exported.paths) {
    for (std::size_t i = 0; i < path.waypoints.size(); ++i) {
      text += fmt::format("{},{},{},{},{:.3f},{:.3f}\r\n", quoted(path.state), quoted(path.goal), i,
                          place(exported, path.waypoints[i]), -path.waypoints[i].p.z(),
                          path.clearance_m);
    }
  }
  return text;
}

}  // namespace dive::mission
