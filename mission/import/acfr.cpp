// Element semantics follow ACFR's own parser (acfr-lcm, global-planner/mission.cpp): names in any
// case, a timeout for each primitive, commands sent when the vehicle departs for it.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/suggest.h"
#include "common/xml.h"
#include "mission/import/acfr_elements.h"
#include "mission/import/acfr_points.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

constexpr XmlLimits kLimits{};
constexpr std::size_t kMaxDescription = 3900;
constexpr std::size_t kMaxWord = 60;  // length of a payload command: see as_id()
constexpr std::array<std::string_view, 6> kRead = {"goto",         "leg",          "zambonie",
                                                   "spiralinward", "inwardspiral", "command"};
constexpr std::array<std::string_view, 2> kDropped = {"inwardspiral", "command"};

// Names of the primitives in other dialects.
constexpr std::array<std::pair<std::string_view, std::string_view>, 15> kOtherNames{
    {{"waypoint", "goto"},
     {"point", "goto"},
     {"wp", "goto"},
     {"transect", "leg"},
     {"line", "leg"},
     {"lawnmower", "zambonie"},
     {"lawnmow", "zambonie"},
     {"mow", "zambonie"},
     {"grid", "zambonie"},
     {"rows", "zambonie"},
     {"survey", "zambonie"},
     {"coverage", "zambonie"},
     {"boustrophedon", "zambonie"},
     {"inwardspiral", "spiralinward"},
     {"payload", "command"}}};

// Known names, for hints.
const std::vector<std::string>& known_names() {
  static const std::vector<std::string> names{
      "desc",       "global",   "location",  "turn_radius",      "drop_distance",
      "drop_angle", "timeout",  "primitive", "position",         "mission_timeout",
      "heading",    "rotation", "depth",     "velocity",         "command",
      "length",     "width",    "spacing",   "offset",           "pitch",
      "direction",  "overlap",  "loops",     "min_width_length", "altitude_change"};
  return names;
}

void lower_names(XmlElement& element) {
  element.name = lower_case(std::move(element.name));
  for (XmlAttribute& attribute : element.attributes) {
    attribute.name = lower_case(std::move(attribute.name));
  }
  for (XmlElement& child : element.children) lower_names(child);
}

std::string squeezed(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
    if (!blank) result += c;
    if (blank && !result.empty() && result.back() != ' ') result += ' ';
  }
  if (!result.empty() && result.back() == ' ') result.pop_back();
  return result;
}

std::string hint_for_primitive(const std::string& name) {
  if (name == "gotoandcircle" || name == "spiral") {
    return "ACFR's software has it, but it has no counterpart here: write its points as 'goto'";
  }
  std::string plain = name;
  std::erase_if(plain, [](char c) { return c == '_' || c == '-'; });
  for (const auto& [other, ours] : kOtherNames) {
    if (plain == other) return fmt::format("ACFR's name for it is '{}'", ours);
  }
  const std::vector<std::string> names(kRead.begin(), kRead.end());
  return did_you_mean(plain, names);
}

class Reader {
 public:
  explicit Reader(ImportReport& report) : report_(report), elements_(report) {}

  std::optional<ForeignMission> read(const XmlElement& root) {
    if (root.name != "mission") {
      elements_.error(root.span,
                      fmt::format("this is not an ACFR mission: the root is '{}'", root.name));
      return std::nullopt;
    }
    ForeignMission mission;
    mission.speed_name = "'velocity' x";
    mission.timeout_name = "'timeout' t";
    read_description(root, mission);
    for (const XmlElement& element : root.children) {
      if (element.name == "global") read_global(element, mission);
      if (element.name == "location") {
        elements_.leave_out(element, "ACFR's software reads it in 'global' only");
      }
    }
    for (const XmlElement& primitive : root.children) {
      if (primitive.name != "primitive") continue;
      elements_.account().take(primitive);
      for (const XmlElement& element : primitive.children) add(element, mission);
    }
    mission.payload = std::move(commands_);
    count_points(root, mission);
    if (!report_.ok()) return std::nullopt;  // the erroneous part was not read to its end
    elements_.account().report_rest(root, known_names(), report_);
    return mission;
  }

 private:
  void count_points(const XmlElement& root, const ForeignMission& mission) {
    std::size_t points = 0;
    for (const ForeignLeg& leg : mission.legs) points += leg.points.size();
    if (mission.legs.empty()) {
      elements_.error(root.span, "the mission has no primitive that can be swum");
    } else if (points > kMaxAcfrPoints) {
      elements_.error(root.span, fmt::format("the mission has {} waypoints, more than {}", points,
                                             kMaxAcfrPoints));
    }
  }

  void read_description(const XmlElement& root, ForeignMission& mission) {
    const XmlElement* desc = elements_.account().child(root, "desc");
    if (desc == nullptr) return;
    mission.description = squeezed(elements_.account().text(*desc));
    if (mission.description.size() <= kMaxDescription) return;
    std::size_t end = kMaxDescription;  // not inside a UTF-8 character
    while (end > 0 && (static_cast<unsigned char>(mission.description[end]) & 0xC0U) == 0x80U) {
      --end;
    }
    mission.description.resize(end);
    report_.warning("IMP-CHANGED", desc->span,
                    fmt::format("the text of 'desc' is cut after {} bytes", end));
  }

  void read_global(const XmlElement& global, ForeignMission& mission) {
    elements_.account().take(global);
    for (const XmlElement& element : global.children) {
      if (element.name == "drop_distance") {
        elements_.account().take(element);
        drop_m_ = elements_.number(element, {"m"}).value_or(drop_m_);
      } else if (element.name == "location") {
        read_location(element, mission);
      } else if (element.name == "turn_radius") {
        elements_.leave_out(element, "the planner uses the aqua2's own limits of turning");
      } else if (element.name == "drop_angle") {
        elements_.leave_out(element, "a goal is reached by distance alone");
      } else if (element.name == "mission_timeout") {
        elements_.leave_out(element,
                            "it is ACFR's timeout for primitives without one, not the limits' "
                            "mission_timeout");
      }
    }
  }

  void read_location(const XmlElement& element, ForeignMission& mission) {
    elements_.account().take(element);
    const auto latitude = elements_.number(element, {"lat"});
    const auto longitude = elements_.number(element, {"lon"});
    if (!latitude || !longitude) return;
    if (std::abs(*latitude) > 90.0 || std::abs(*longitude) > 180.0) {
      return elements_.error(element.span, fmt::format("{} is not on the earth", in_words(element)),
                             "latitudes are -90 to 90 degrees, longitudes -180 to 180");
    }
    mission.origin = GeoPoint{*latitude, *longitude};
    report_.note("IMP-ORIGIN", element.span,
                 fmt::format("{} is the origin of x and y", in_words(element)));
  }

  void add(const XmlElement& element, ForeignMission& mission) {
    if (std::ranges::find(kRead, element.name) == kRead.end()) {
      elements_.account().take(element);
      return elements_.error(element.span, fmt::format("unknown primitive '{}'", element.name),
                             hint_for_primitive(element.name));
    }
    if (std::ranges::find(kDropped, element.name) != kDropped.end()) {
      report_.warning("IMP-PRIMITIVE", element.span,
                      fmt::format("ACFR's own software has no primitive '{}' and drops it: it is "
                                  "imported by its name",
                                  element.name),
                      {}, element.name == "command" ? "" : hint_for_primitive(element.name));
    }
    elements_.account().take(element);
    if (element.name == "command") return keep_commands(element);
    ForeignLeg leg;
    leg.span = element.span;
    read_capture_radius(element, leg);
    read_pace(element, leg);
    read_depth_mode(element, leg);
    keep_commands(element);
    leg.payload = std::exchange(commands_, {});
    const bool has_points = read_points(elements_, element, leg);
    leave_out_parts(element);
    if (!has_points) return;
    if (leg.timeout_s == 0.0) return pass(std::move(leg), mission);
    mission.legs.push_back(std::move(leg));
  }

  // ACFR's vehicles skip a primitive without time immediately.
  void pass(ForeignLeg&& leg, ForeignMission& mission) {
    const bool is_start = mission.legs.empty() && !mission.start;
    if (is_start) mission.start = ForeignStart{leg.points.front(), leg.heading_deg};
    commands_ = std::move(leg.payload);
    report_.note("IMP-LEFT-OUT", leg.timeout_span,
                 fmt::format("a timeout of 0 s lets ACFR's vehicles pass on at once: the waypoint "
                             "is {}, and its commands are given with the next leg",
                             is_start ? "where the mission starts" : "not swum to"));
  }

  void read_capture_radius(const XmlElement& primitive, ForeignLeg& leg) {
    double drop_m = drop_m_;
    if (const XmlElement* own = elements_.account().child(primitive, "drop_distance")) {
      drop_m = elements_.number(*own, {"m"}).value_or(drop_m);
    }
    leg.capture_radius = std::clamp(drop_m, kMinCaptureRadius, kMaxCaptureRadius);
    if (leg.capture_radius == drop_m) return;
    report_.warning("IMP-CHANGED", primitive.span,
                    fmt::format("'drop_distance' m: {:g} m becomes a capture_radius of {:g} m: it "
                                "may be {:g} to {:g} m",
                                drop_m, leg.capture_radius, kMinCaptureRadius, kMaxCaptureRadius));
  }

  void read_pace(const XmlElement& primitive, ForeignLeg& leg) {
    leg.timeout_s = elements_.part(primitive, "timeout", {"t"});
    leg.speed = elements_.part(primitive, "velocity", {"x"});
    if (const XmlElement* timeout = primitive.child("timeout")) leg.timeout_span = timeout->span;
    if (const XmlElement* velocity = primitive.child("velocity")) leg.speed_span = velocity->span;
    if (leg.timeout_s && *leg.timeout_s < 0.0) {
      elements_.error(leg.timeout_span,
                      fmt::format("a timeout of {:g} s is negative", *leg.timeout_s));
    }
    if (!leg.speed || *leg.speed > 0.0) return;
    report_.warning("IMP-SPEED", leg.speed_span,
                    fmt::format("'velocity' x=\"{:g}\" never arrives: it is replaced by the "
                                "mission's speed, and the timeout stays as it is",
                                *leg.speed));
    leg.speed.reset();
  }

  void read_depth_mode(const XmlElement& element, ForeignLeg& leg) {
    const XmlElement* depth = elements_.account().child(element, "depth");
    const XmlAttribute* mode =
        depth == nullptr ? nullptr : elements_.account().attribute(*depth, "mode");
    if (mode == nullptr) {
      report_.warning(
          "IMP-MODE", element.span,
          fmt::format("'{}' has no depth mode: its z is taken as a depth", element.name));
      return;
    }
    const std::string word = lower_case(mode->value);
    leg.is_altitude = word == "altitude";
    if (leg.is_altitude || word == "depth") return;
    const std::string hint = did_you_mean(word, std::vector<std::string>{"depth", "altitude"});
    elements_.error(mode->value_span, fmt::format("'{}' is no depth mode", mode->value),
                    hint.empty() ? "use depth or altitude" : hint);
  }

  void keep_commands(const XmlElement& primitive) {
    for (const XmlElement& command : primitive.children) {
      if (command.name == "command") keep_command(command);
    }
  }

  void keep_command(const XmlElement& element) {
    elements_.account().take(element);
    const XmlAttribute* device = elements_.account().attribute(element, "device");
    if (device == nullptr || element.attributes.size() < 2) {
      return elements_.error(element.span,
                             "a command needs a device, and onoff or another setting for it");
    }
    std::string word = device->value;
    if (const XmlAttribute* state = elements_.account().attribute(element, "onoff"))
      word += "_" + state->value;
    for (const XmlAttribute& attribute : element.attributes) {
      if (attribute.name == "device" || attribute.name == "onoff") continue;
      elements_.account().attribute(element, attribute.name);
      word += fmt::format("_{}_{}", attribute.name, attribute.value);
    }
    if (word.size() > kMaxWord) {
      return elements_.error(element.span,
                             fmt::format("{} is too long to be a payload command: more than {} "
                                         "characters",
                                         in_words(element), kMaxWord));
    }
    commands_.push_back(as_id(word));
    report_.note("IMP-PAYLOAD", element.span,
                 fmt::format("{} becomes the payload command '{}', which the payload must accept",
                             in_words(element), commands_.back()));
  }

  void leave_out_parts(const XmlElement& primitive) {
    constexpr std::array<std::pair<std::string_view, const char*>, 6> kParts{
        {{"pitch", "the pattern is swum level"},
         {"altitude_change", "the pattern is swum level"},
         {"overlap", "rows are swum back and forth"},
         {"loops", "the whole area is covered"},
         {"min_width_length", "the whole area is covered"},
         {"drop_angle", "a goal is reached by distance alone"}}};
    for (const auto& [name, why] : kParts) {
      if (const XmlElement* element = primitive.child(name)) elements_.leave_out(*element, why);
    }
  }

  ImportReport& report_;
  AcfrElements elements_;
  double drop_m_ = 0.5;
  std::vector<std::string> commands_;
};

}  // namespace

std::optional<ForeignMission> read_acfr(const std::string& path, ImportReport& report) {
  Diagnostics found;
  std::optional<XmlDocument> document = read_xml(path, kLimits, found);
  report.add(found);
  if (!document) return std::nullopt;
  report.set_source(std::move(document->source));
  lower_names(document->root);
  return Reader(report).read(document->root);
}

}  // namespace dive::mission
