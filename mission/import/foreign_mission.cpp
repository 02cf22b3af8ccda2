#include "mission/import/foreign_mission.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "common/xml.h"

namespace dive::mission {
namespace {

constexpr double kSurfaced = 0.5;    // m: shallower is as good as the surface
constexpr double kFastest = 0.8;     // m/s, of the aqua2
constexpr double kBelow = 5.0;       // m of water below the deepest leg
constexpr double kSpareDepth = 2.0;  // m that max_depth leaves below the deepest leg
constexpr double kSlack = 3.0;       // times the time a leg takes, where none is given
constexpr double kLongestDay = 86400.0;

using Eigen::Vector2d;

constexpr Rule kRules[] = {
    {"IMP-ACFR", Severity::kError, "The file is a mission of ACFR's that can be turned into ours."},
    {"IMP-QGC", Severity::kError, "The file is a plan of QGroundControl's for under water."},
    {"IMP-PRIMITIVE", Severity::kWarning, "The file's own software knows every primitive in it."},
    {"IMP-MODE", Severity::kWarning, "Every leg says whether it keeps depth or altitude."},
    {"IMP-TIMEOUT", Severity::kWarning, "Every leg can be finished within its own timeout."},
    {"IMP-SPEED", Severity::kWarning, "No leg is faster than our vehicle swims."},
    {"IMP-SUBMERGED", Severity::kWarning, "The mission ends at the surface."},
};

double length_of(const ForeignLeg& leg, const Vector2d& from) {
  double length = (leg.points.front() - from).norm();
  for (std::size_t i = 1; i < leg.points.size(); ++i) {
    length += (leg.points[i] - leg.points[i - 1]).norm();
  }
  return length;
}

// Millimetres, and no exponent, which XML's decimals do not have.
std::string decimal(double value) {
  std::string text = fmt::format("{:.3f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

/// Depths as far as the mission alone tells them.
struct Extent {
  double deepest = 0.0;
  double highest_altitude = 0.0;
  double lowest_altitude = std::numeric_limits<double>::infinity();
  double longest_timeout_s = 0.0;
  double path_m = 0.0;
};

Extent extent_of(const ForeignMission& mission) {
  Extent extent;
  Vector2d at = mission.legs.front().points.front();
  for (const ForeignLeg& leg : mission.legs) {
    double& limit = leg.is_altitude ? extent.highest_altitude : extent.deepest;
    limit = std::max(limit, leg.z);
    if (leg.is_altitude) extent.lowest_altitude = std::min(extent.lowest_altitude, leg.z);
    extent.longest_timeout_s = std::max(extent.longest_timeout_s, leg.timeout_s);
    extent.path_m += length_of(leg, at);
    at = leg.points.back();
  }
  return extent;
}

std::string write_leg(const ForeignLeg& leg, std::size_t number, std::size_t count,
                      const Vector2d& from, const ImportOptions& options) {
  const std::string next = number == count ? "ascend" : fmt::format("leg{}", number + 1);
  const double needed = length_of(leg, from) / options.speed;
  const double timeout = leg.timeout_s > 0.0 ? leg.timeout_s : kSlack * needed + 60.0;
  const char* units = leg.is_altitude ? "ALTITUDE" : "DEPTH";
  std::string text;
  const auto add_point = [&](const char* indent, const Vector2d& p) {
    text += fmt::format("{}x=\"{}\" y=\"{}\" z=\"{}\" z_units=\"{}\" capture_radius=\"{}\"", indent,
                        decimal(p.x()), decimal(p.y()), decimal(leg.z), units,
                        decimal(leg.capture_radius));
  };
  const bool single = leg.points.size() == 1;
  if (single) {
    text += fmt::format("    <goto id=\"leg{}\" ", number);
    add_point("", leg.points.front());
    text += fmt::format("\n          timeout=\"{:g}\" on_timeout=\"{}\">\n",
                        std::min(timeout, kLongestDay), next);
  } else {
    text += fmt::format("    <goal_sequence id=\"leg{}\" timeout=\"{:g}\" on_timeout=\"{}\">\n",
                        number, std::min(timeout, kLongestDay), next);
    for (std::size_t i = 0; i < leg.points.size(); ++i) {
      text += fmt::format("      <goal id=\"leg{}-{}\" ", number, i + 1);
      add_point("", leg.points[i]);
      text += "/>\n";
    }
  }
  if (!leg.payload.empty()) {
    text += "      <onentry>";
    for (const std::string& command : leg.payload) {
      text += fmt::format("<payload command=\"{}\"/>", escape_xml(command));
    }
    text += "</onentry>\n";
  }
  text += fmt::format(
      "      <transition event=\"done.state.leg{0} plan.failed.leg{0}\" "
      "target=\"{1}\"/>\n    </{2}>\n",
      number, next, single ? "goto" : "goal_sequence");
  return text;
}

}  // namespace

std::string as_id(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const bool needs_front = text.empty() || !is_letter(text.front());
  std::string id = needs_front ? "_" : "";
  for (const char c : text.substr(0, kLongest)) id += is_letter(c) || is_digit(c) ? c : '_';
  return id;
}

std::span<const Rule> import_rules() { return kRules; }

Imported write_mission(const ForeignMission& mission, const ImportOptions& options,
                       const std::string& from) {
  const Extent extent = extent_of(mission);
  const double least_seabed = std::max(extent.deepest, extent.highest_altitude) + kBelow;
  const double seabed = options.seabed_m > 0.0 ? options.seabed_m : least_seabed;
  const double deepest = std::max(extent.deepest, seabed - extent.lowest_altitude);
  const double max_depth = std::min(deepest + kSpareDepth, seabed);
  const double time =
      std::min(std::max(kSlack * extent.path_m / options.speed + 600.0, extent.longest_timeout_s),
               kLongestDay);
  const ForeignLeg& first = mission.legs.front();
  const Vector2d& start = first.points.front();

  Imported result;
  result.map_name = mission.id + ".sdf";
  result.mission_xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<!-- From {}. The map is a flat seabed at {:g} m: put the real one in its place. -->\n"
      "<mission xmlns=\"urn:dive:mission:1\" id=\"{}\">\n"
      "  <description>{}</description>\n"
      "  <vehicle model=\"aqua2\" speed=\"{:g}\"/>\n"
      "  <map file=\"{}\"/>\n"
      "  <start x=\"{}\" y=\"{}\" z=\"1\" z_units=\"DEPTH\" heading_deg=\"0\"/>\n"
      "  <limits max_depth=\"{:g}\" min_altitude=\"0.3\" clearance=\"{:g}\"\n"
      "          mission_timeout=\"{:g}\" battery_reserve=\"0.3\"/>\n"
      "  <states initial=\"leg1\">\n",
      escape_xml(from), seabed, mission.id, escape_xml(mission.description), options.speed,
      result.map_name, decimal(start.x()), decimal(start.y()), std::clamp(max_depth, 0.5, 200.0),
      options.clearance, time);
  Vector2d at = start;
  for (std::size_t i = 0; i < mission.legs.size(); ++i) {
    result.mission_xml += write_leg(mission.legs[i], i + 1, mission.legs.size(), at, options);
    at = mission.legs[i].points.back();
  }
  result.mission_xml +=
      "    <surface id=\"ascend\">\n"
      "      <transition event=\"done.state.ascend\" target=\"surfaced\"/>\n"
      "    </surface>\n"
      "    <final id=\"surfaced\"/>\n"
      "  </states>\n"
      "</mission>\n";
  result.map_sdf = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<sdf version=\"1.6\">\n"
      "  <world name=\"{}\">\n"
      "    <model name=\"seabed\"><static>true</static><pose>0 0 {:g} 0 0 0</pose><link "
      "name=\"link\">\n"
      "      <collision name=\"flat\"><geometry><plane><normal>0 0 1</normal><size>1000 "
      "1000</size></plane></geometry></collision>\n"
      "    </link></model>\n"
      "  </world>\n"
      "</sdf>\n",
      mission.id, -seabed);
  return result;
}

void report_defects(const ForeignMission& mission, const SourceText& source,
                    Diagnostics& diagnostics) {
  Vector2d at = mission.legs.front().points.front();
  for (const ForeignLeg& leg : mission.legs) {
    const double length = length_of(leg, at);
    at = leg.points.back();
    if (leg.speed > 0.0 && leg.timeout_s > 0.0 && length / leg.speed > leg.timeout_s) {
      diagnostics.warning(
          "IMP-TIMEOUT", source, leg.span,
          fmt::format("{:.0f} m at {:g} m/s take {:.0f} s, and the timeout is {:g} s", length,
                      leg.speed, length / leg.speed, leg.timeout_s),
          "it is cut off on the way, and the next one begins elsewhere than it thinks");
    }
    if (leg.speed > kFastest) {
      diagnostics.warning(
          "IMP-SPEED", source, leg.span,
          fmt::format("{:g} m/s is more than the aqua2 swims ({:g} m/s)", leg.speed, kFastest));
    }
  }
  const ForeignLeg& last = mission.legs.back();
  if (last.is_altitude || last.z > kSurfaced) {
    diagnostics.warning("IMP-SUBMERGED", source, last.span,
                        fmt::format("the mission ends here, at {:g} m {}", last.z,
                                    last.is_altitude ? "above the ground" : "depth"),
                        "ours surfaces afterwards");
  }
}

}  // namespace dive::mission
