#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "common/se3.h"
#include "common/xml.h"
#include "mission/import/foreign_mission.h"
#include "vehicle/speed_range.h"

namespace dive::mission {
namespace {

constexpr double kUsualSpeed = 0.4;   // m/s
constexpr double kStartDepth = 1.0;   // m
constexpr double kMinAltitude = 0.3;  // m
constexpr double kReserve = 0.3;      // fraction of the battery
constexpr double kBelow = 5.0;        // m of water below the deepest leg
constexpr double kSpareDepth = 2.0;   // m between max_depth and the deepest leg
constexpr double kSlack = 3.0;        // factor on a leg's duration, where no timeout is given
constexpr double kMinTimeout = 0.1;   // s; these are the bounds of the mission language
constexpr double kMaxTimeout = 86400.0;
constexpr double kMinDepthLimit = 0.5;  // m
constexpr double kMaxDepthLimit = 200.0;

using Eigen::Vector2d;

// Millimetre resolution by default, without an exponent, which XML's decimals do not allow.
std::string decimal(double value, int digits = 3) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

// Two hyphens would end an XML comment.
std::string in_comment(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--")) {
    text.replace(at, 2, "- -");
  }
  return text;
}

double length_of(const ForeignLeg& leg, const Vector2d& from) {
  double length = (leg.points.front() - from).norm();
  for (std::size_t i = 1; i < leg.points.size(); ++i) {
    length += (leg.points[i] - leg.points[i - 1]).norm();
  }
  return length;
}

/// Depth range, as far as the mission alone determines it.
struct Extent {
  double deepest = 0.0;
  double highest_altitude = 0.0;
  double lowest_altitude = std::numeric_limits<double>::infinity();
  double path_m = 0.0;
};

Extent extent_of(const ForeignMission& mission) {
  Extent extent;
  Vector2d at = start_of(mission);
  for (const ForeignLeg& leg : mission.legs) {
    double& limit = leg.is_altitude ? extent.highest_altitude : extent.deepest;
    limit = std::max(limit, leg.z);
    if (leg.is_altitude) extent.lowest_altitude = std::min(extent.lowest_altitude, leg.z);
    extent.path_m += length_of(leg, at);
    at = leg.points.back();
  }
  return extent;
}

bool can_swim(double speed) { return speed >= vehicle::kMinSpeed && speed <= vehicle::kMaxSpeed; }

// Speed of the whole mission, which is constant.
double speed_of(const ForeignMission& mission, const ImportOptions& options) {
  if (options.speed) return *options.speed;
  double slowest = std::numeric_limits<double>::infinity();
  for (const ForeignLeg& leg : mission.legs) {
    slowest = std::min(slowest, leg.speed.value_or(slowest));
  }
  return can_swim(slowest) ? slowest : kUsualSpeed;
}

/// Scale factor of a timeout that keeps its ratio to the duration of its leg.
double stretch(const ForeignLeg& leg, double speed) { return leg.speed.value_or(speed) / speed; }

double timeout_of(const ForeignLeg& leg, const Vector2d& from, double speed) {
  const double wanted = leg.timeout_s ? *leg.timeout_s * stretch(leg, speed)
                                      : kSlack * length_of(leg, from) / speed + leg.dwell_s + 60.0;
  return std::clamp(wanted, kMinTimeout, kMaxTimeout);
}

std::string reason_for_speed(double written, const ImportOptions& options) {
  if (options.speed) return "as --speed demands";
  if (written > vehicle::kMaxSpeed) {
    return fmt::format("because the aqua2 swims at most {:g} m/s", vehicle::kMaxSpeed);
  }
  if (written < vehicle::kMinSpeed) {
    return fmt::format("because the aqua2 swims at least {:g} m/s", vehicle::kMinSpeed);
  }
  return "because a mission has one speed";
}

void report_pace(const ForeignMission& mission, const ImportOptions& options, double speed,
                 ImportReport& report) {
  Vector2d at = start_of(mission);
  for (const ForeignLeg& leg : mission.legs) {
    const double ratio = stretch(leg, speed);
    const double timeout = timeout_of(leg, at, speed);
    at = leg.points.back();
    const bool is_changed = std::abs(ratio - 1.0) > 1e-9;
    if (is_changed) {
      report.warning("IMP-SPEED", leg.speed_span,
                     fmt::format("{}: {:g} m/s becomes {:g} m/s, {}", mission.speed_name,
                                 *leg.speed, speed, reason_for_speed(*leg.speed, options)));
    }
    if (!leg.timeout_s) continue;
    const std::string change =
        fmt::format("{} s becomes {} s", decimal(*leg.timeout_s), decimal(timeout));
    if (std::abs(timeout - *leg.timeout_s * ratio) > 1e-9) {
      report.warning(
          "IMP-CHANGED", leg.timeout_span,
          fmt::format("{} may be {:g} to {:g} s", mission.timeout_name, kMinTimeout, kMaxTimeout),
          change);
    } else if (is_changed) {
      report.note("IMP-SCALED", leg.timeout_span,
                  fmt::format("{} is multiplied by {:g}, like the duration of its leg",
                              mission.timeout_name, ratio),
                  change);
    }
  }
}

// --- the parts of the file ---

/// Values that the mission needs and the foreign file lacks.
struct Supplement {
  double speed = kUsualSpeed;
  double seabed_m = 0.0;
  double max_depth = 0.0;
  double clearance = 0.0;
  double mission_timeout = 0.0;
  Vector2d start = Vector2d::Zero();
  double heading_deg = 0.0;
};

double heading_along(const Vector2d& direction) {
  const double heading = rad_to_deg(std::atan2(direction.x(), direction.y()));
  return heading < 0.0 ? heading + 360.0 : heading;
}

// The file's heading, else that of the first leg: of its pattern's first row, or as written.
double start_heading(const ForeignMission& mission) {
  const ForeignLeg& leg = mission.legs.front();
  if (mission.start && mission.start->heading_deg) return *mission.start->heading_deg;
  if (mission.start) return heading_along(leg.points.front() - mission.start->p);
  if (leg.points.size() > 1) return heading_along(leg.points[1] - leg.points[0]);
  return leg.heading_deg.value_or(0.0);
}

Supplement supplement_of(const ForeignMission& mission, const ImportOptions& options) {
  const Extent extent = extent_of(mission);
  Supplement added;
  added.speed = speed_of(mission, options);
  const double least_seabed = std::max(extent.deepest, extent.highest_altitude) + kBelow;
  added.seabed_m = options.seabed_m > 0.0 ? options.seabed_m : least_seabed;
  const double deepest = std::max(extent.deepest, added.seabed_m - extent.lowest_altitude);
  added.max_depth =
      std::clamp(std::min(deepest + kSpareDepth, added.seabed_m), kMinDepthLimit, kMaxDepthLimit);
  added.clearance = options.clearance;
  added.mission_timeout = kSlack * extent.path_m / added.speed + 600.0;
  added.start = start_of(mission);
  added.heading_deg = start_heading(mission);
  Vector2d at = added.start;
  for (const ForeignLeg& leg : mission.legs) {
    added.mission_timeout = std::max(added.mission_timeout, timeout_of(leg, at, added.speed));
    at = leg.points.back();
  }
  added.mission_timeout = std::min(added.mission_timeout, kMaxTimeout);
  return added;
}

void report_supplement(const ForeignMission& mission, const ImportOptions& options,
                       const Supplement& added, ImportReport& report) {
  const Span top{1, 1, 1};
  report.note("IMP-ADDED", top,
              fmt::format("{}, x={} y={}, {:g} m deep, heading {} degrees",
                          mission.start ? "the file has no depth of the start: it is"
                                        : "the file has no start: it is put at the first waypoint",
                          decimal(added.start.x()), decimal(added.start.y()), kStartDepth,
                          decimal(added.heading_deg)));
  report.note(
      "IMP-ADDED", top,
      fmt::format("the file has no map: a flat seabed at {} m is {}", decimal(added.seabed_m),
                  options.seabed_m > 0.0 ? "made, as --seabed demands" : "assumed"));
  report.note(
      "IMP-ADDED", top,
      fmt::format("the file has no limits: max_depth is {} m, min_altitude {:g} m, clearance "
                  "{:g} m, mission_timeout {} s, battery_reserve {:g}",
                  decimal(added.max_depth), kMinAltitude, added.clearance,
                  decimal(added.mission_timeout), kReserve));
  const auto has = [&](auto member) {
    return std::ranges::any_of(
        mission.legs, [member](const ForeignLeg& leg) { return (leg.*member).has_value(); });
  };
  if (!has(&ForeignLeg::speed) && !options.speed) {
    report.note("IMP-ADDED", top,
                fmt::format("the file has no speed: it is {:g} m/s", added.speed));
  }
  if (!has(&ForeignLeg::timeout_s)) {
    report.note(
        "IMP-ADDED", top,
        fmt::format("the file has no timeouts: each leg has {:g} times what it takes, and a "
                    "minute",
                    kSlack));
  }
}

std::string write_payload(const char* indent, const std::vector<std::string>& commands) {
  if (commands.empty()) return {};
  std::string text = fmt::format("{}<onentry>", indent);
  for (const std::string& command : commands) {
    text += fmt::format("<payload command=\"{}\"/>", escape_xml(command));
  }
  return text + "</onentry>\n";
}

std::string write_position(const ForeignLeg& leg, const Vector2d& p) {
  std::string text =
      fmt::format("x=\"{}\" y=\"{}\" z=\"{}\" z_units=\"{}\"", decimal(p.x()), decimal(p.y()),
                  decimal(leg.z), leg.is_altitude ? "ALTITUDE" : "DEPTH");
  if (leg.heading_deg) text += fmt::format(" heading_deg=\"{}\"", decimal(*leg.heading_deg));
  return text + fmt::format(" capture_radius=\"{}\"", decimal(leg.capture_radius));
}

std::string write_leg(const ForeignLeg& leg, std::size_t number, std::size_t count,
                      const Vector2d& from, double speed) {
  const std::string next = number == count ? "ascend" : fmt::format("leg{}", number + 1);
  const std::string timeout =
      fmt::format("timeout=\"{}\" on_timeout=\"{}\"", decimal(timeout_of(leg, from, speed)), next);
  const bool single = leg.points.size() == 1 && leg.dwell_s == 0.0;
  std::string text;
  if (single) {
    text = fmt::format("    <goto id=\"leg{}\" {}\n          {}>\n", number,
                       write_position(leg, leg.points.front()), timeout);
  } else {
    text = fmt::format("    <goal_sequence id=\"leg{}\" {}>\n", number, timeout);
    for (std::size_t i = 0; i < leg.points.size(); ++i) {
      const bool stays = leg.dwell_s > 0.0 && i + 1 == leg.points.size();
      text += fmt::format("      <goal id=\"leg{}-{}\" {}{}/>\n", number, i + 1,
                          write_position(leg, leg.points[i]),
                          stays ? fmt::format(" dwell=\"{}\"", decimal(leg.dwell_s)) : "");
    }
  }
  text += write_payload("      ", leg.payload);
  return text + fmt::format(
                    "      <transition event=\"done.state.leg{0} plan.failed.leg{0}\" "
                    "target=\"{1}\"/>\n    </{2}>\n",
                    number, next, single ? "goto" : "goal_sequence");
}

// 1e-9 degrees are 0.1 mm.
std::string write_origin(const std::optional<GeoPoint>& origin) {
  if (!origin) return {};
  return fmt::format("  <origin latitude=\"{}\" longitude=\"{}\"/>\n",
                     decimal(origin->latitude_deg, 9), decimal(origin->longitude_deg, 9));
}

std::string write_fence(const std::vector<Vector2d>& corners) {
  if (corners.empty()) return {};
  std::string text = "  <failsafes>\n    <geofence rung=\"abort_and_surface\">\n";
  for (const Vector2d& p : corners) {
    text += fmt::format("      <corner x=\"{}\" y=\"{}\"/>\n", decimal(p.x()), decimal(p.y()));
  }
  return text + "    </geofence>\n  </failsafes>\n";
}

std::string write_states(const ForeignMission& mission, const Supplement& added) {
  std::string text = "  <states initial=\"leg1\">\n";
  Vector2d at = added.start;
  for (std::size_t i = 0; i < mission.legs.size(); ++i) {
    text += write_leg(mission.legs[i], i + 1, mission.legs.size(), at, added.speed);
    at = mission.legs[i].points.back();
  }
  return text + "    <surface id=\"ascend\">\n" + write_payload("      ", mission.payload) +
         "      <transition event=\"done.state.ascend\" target=\"surfaced\"/>\n"
         "    </surface>\n"
         "    <final id=\"surfaced\"/>\n"
         "  </states>\n";
}

std::string write_map(const std::string& id, double seabed_m) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<sdf version=\"1.6\">\n"
      "  <world name=\"{}\">\n"
      "    <model name=\"seabed\"><static>true</static><pose>0 0 {} 0 0 0</pose><link "
      "name=\"link\">\n"
      "      <collision name=\"flat\"><geometry><plane><normal>0 0 1</normal><size>1000 "
      "1000</size></plane></geometry></collision>\n"
      "    </link></model>\n"
      "  </world>\n"
      "</sdf>\n",
      id, decimal(-seabed_m));
}

}  // namespace

Vector2d start_of(const ForeignMission& mission) {
  return mission.start ? mission.start->p : mission.legs.front().points.front();
}

std::string as_id(std::string_view text) {
  constexpr std::size_t kMaxLength = 60;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const bool needs_front = text.empty() || !is_letter(text.front());
  std::string id = needs_front ? "_" : "";
  for (const char c : text.substr(0, kMaxLength)) id += is_letter(c) || is_digit(c) ? c : '_';
  return id;
}

Imported write_mission(const ForeignMission& mission, const ImportOptions& options,
                       const std::string& from, ImportReport& report) {
  const Supplement added = supplement_of(mission, options);
  report_supplement(mission, options, added, report);
  report_pace(mission, options, added.speed, report);
  Imported result;
  result.speed = added.speed;
  result.map_name = mission.id + ".sdf";
  result.map_sdf = write_map(mission.id, added.seabed_m);
  result.mission_xml =
      fmt::format(
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
          "<!-- From {}. The map is a flat seabed at {} m: put the real one in its place. -->\n"
          "<mission xmlns=\"urn:dive:mission:1\" id=\"{}\">\n"
          "  <description>{}</description>\n{}"
          "  <vehicle model=\"aqua2\" speed=\"{}\"/>\n"
          "  <map file=\"{}\"/>\n"
          "  <start x=\"{}\" y=\"{}\" z=\"{}\" z_units=\"DEPTH\" heading_deg=\"{}\"/>\n"
          "  <limits max_depth=\"{}\" min_altitude=\"{:g}\" clearance=\"{:g}\"\n"
          "          mission_timeout=\"{}\" battery_reserve=\"{:g}\"/>\n",
          in_comment(from), decimal(added.seabed_m), mission.id, escape_xml(mission.description),
          write_origin(mission.origin), decimal(added.speed), result.map_name,
          decimal(added.start.x()), decimal(added.start.y()), kStartDepth,
          decimal(added.heading_deg), decimal(added.max_depth), kMinAltitude, added.clearance,
          decimal(added.mission_timeout), kReserve) +
      write_fence(mission.fence) + write_states(mission, added) + "</mission>\n";
  return result;
}

}  // namespace dive::mission
