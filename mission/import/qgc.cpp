// Converts MAVLink's mission items to legs. Commands and frames:
// https://mavlink.io/en/messages/common.html

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "mission/import/foreign_mission.h"
#include "mission/import/qgc_items.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMaxBytes = 4U << 20U;
constexpr double kMaxDwell = 86400.0;  // s

constexpr const char* kTooFar = "more than 20 km from the first waypoint";
constexpr const char* kTooFarHint = "divide the plan, or correct the position";

constexpr int kWaypoint = 16;
constexpr int kLoiterTime = 19;
constexpr int kReturn = 20;
constexpr int kLand = 21;
constexpr int kTakeoff = 22;
constexpr int kSpline = 82;
constexpr int kNavDelay = 93;
constexpr int kChangeSpeed = 178;

enum class Meaning { kLeaveOut, kGoto, kDelay, kSpeed, kPayload };

struct Command {
  int number;
  const char* name;
  Meaning meaning;
  const char* why = "";  ///< Why it is omitted, or how it differs.
};

constexpr Command kCommands[] = {
    {kWaypoint, "NAV_WAYPOINT", Meaning::kGoto},
    {17, "NAV_LOITER_UNLIM", Meaning::kLeaveOut, "a mission does not wait for ever"},
    {18, "NAV_LOITER_TURNS", Meaning::kLeaveOut, "the aqua2 holds station without circling"},
    {kLoiterTime, "NAV_LOITER_TIME", Meaning::kGoto},
    {kReturn, "NAV_RETURN_TO_LAUNCH", Meaning::kLeaveOut, "the mission surfaces at its last goal"},
    {kLand, "NAV_LAND", Meaning::kLeaveOut, "the mission surfaces at its last goal"},
    {kTakeoff, "NAV_TAKEOFF", Meaning::kLeaveOut, "nothing takes off under water"},
    {kSpline, "NAV_SPLINE_WAYPOINT", Meaning::kGoto, "the leg to it is straight"},
    {kNavDelay, "NAV_DELAY", Meaning::kDelay},
    {112, "CONDITION_DELAY", Meaning::kLeaveOut, "commands are given at waypoints"},
    {115, "CONDITION_YAW", Meaning::kLeaveOut, "headings are those of waypoints"},
    {177, "DO_JUMP", Meaning::kLeaveOut, "each leg is swum once"},
    {kChangeSpeed, "DO_CHANGE_SPEED", Meaning::kSpeed},
    {181, "DO_SET_RELAY", Meaning::kPayload},
    {183, "DO_SET_SERVO", Meaning::kPayload},
    {195, "DO_SET_ROI_LOCATION", Meaning::kLeaveOut, "the cameras are fixed to the hull"},
    {201, "DO_SET_ROI", Meaning::kLeaveOut, "the cameras are fixed to the hull"},
    {203, "DO_DIGICAM_CONTROL", Meaning::kPayload},
    {205, "DO_MOUNT_CONTROL", Meaning::kLeaveOut, "the cameras are fixed to the hull"},
    {206, "DO_SET_CAM_TRIGG_DIST", Meaning::kPayload},
    {2000, "IMAGE_START_CAPTURE", Meaning::kPayload},
    {2001, "IMAGE_STOP_CAPTURE", Meaning::kPayload},
    {2500, "VIDEO_START_CAPTURE", Meaning::kPayload},
    {2501, "VIDEO_STOP_CAPTURE", Meaning::kPayload},
};

constexpr Command kOther{0, "", Meaning::kLeaveOut, "it has no counterpart in a mission"};

const Command& meaning_of(int number) {
  const auto* at = std::ranges::find(kCommands, number, &Command::number);
  return at == std::end(kCommands) ? kOther : *at;
}

/// The reference of a waypoint's height; empty for frames without latitude and longitude.
enum class Datum { kSeaLevel, kHome, kGround };

std::optional<Datum> datum_of(int frame) {
  switch (frame) {
    case 0:
    case 5:
      return Datum::kSeaLevel;
    case 3:
    case 6:
      return Datum::kHome;
    case 10:
    case 11:
      return Datum::kGround;
    default:
      return std::nullopt;
  }
}

class Builder {
 public:
  Builder(ImportReport& report, std::optional<double> depth_m)
      : report_(report), depth_m_(depth_m) {
    mission_.speed_name = "the speed of DO_CHANGE_SPEED";
  }

  std::optional<ForeignMission> build(const QgcPlan& plan) {
    yaw_zero_is_open_ = plan.yaw_zero_is_open;
    for (const QgcItem& item : plan.items) take(item);
    if (mission_.legs.empty() && report_.ok()) {
      report_.error("IMP-QGC", Span{1, 1, 1}, "there is no waypoint that can be swum");
    }
    if (!report_.ok()) return std::nullopt;
    for (const GeoPoint& corner : plan.fence) {
      const auto p = to_plane(*mission_.origin, corner);
      if (!p) {
        report_.error("IMP-QGC", Span{1, 1, 1},
                      fmt::format("the corner of the geofence at {}, {} is {}", corner.latitude_deg,
                                  corner.longitude_deg, kTooFar),
                      kTooFarHint);
        return std::nullopt;
      }
      mission_.fence.push_back(*p);
    }
    mission_.payload = std::move(payload_);
    return std::move(mission_);
  }

 private:
  static std::string in_words(const QgcItem& item) {
    const Command& command = meaning_of(item.command);
    std::string words = fmt::format("command {}", item.command);
    if (command.number != 0) words += fmt::format(" ({})", command.name);
    for (std::size_t i = 0; i < item.parameters.size(); ++i) {
      const std::optional<double>& value = item.parameters[i];
      if (value && *value != 0.0) words += fmt::format(" param{}={}", i + 1, *value);
    }
    return words;
  }

  void take(const QgcItem& item) {
    const Command& command = meaning_of(item.command);
    if (!item.goes_on) {
      report_.warning("IMP-COMMAND", item.span,
                      "the item has no autocontinue: the mission goes on without waiting");
    }
    switch (command.meaning) {
      case Meaning::kGoto:
        return add_leg(item, command);
      case Meaning::kDelay:
        return add_delay(item);
      case Meaning::kSpeed:
        return set_speed(item);
      case Meaning::kPayload:
        return add_payload(item, command);
      case Meaning::kLeaveOut:
        report_.warning("IMP-COMMAND", item.span,
                        fmt::format("{} is left out: {}", in_words(item), command.why));
    }
  }

  void left_out(const QgcItem& item, std::size_t parameter) {
    const std::optional<double>& value = item.parameters[parameter - 1];
    if (!value || *value == 0.0) return;
    report_.warning("IMP-COMMAND", item.span,
                    fmt::format("param{}={} of command {} ({}) is left out", parameter, *value,
                                item.command, meaning_of(item.command).name));
  }

  // --- commands ---

  void add_delay(const QgcItem& item) {
    const double seconds = item.parameters[0].value_or(0.0);
    const bool is_possible = !mission_.legs.empty() && seconds > 0.0 &&
                             mission_.legs.back().dwell_s + seconds <= kMaxDwell;
    if (!is_possible) {
      report_.warning("IMP-COMMAND", item.span,
                      fmt::format("{} is left out: only a positive delay after a waypoint has a "
                                  "counterpart",
                                  in_words(item)));
      return;
    }
    mission_.legs.back().dwell_s += seconds;
    for (std::size_t i = 2; i <= 7; ++i) left_out(item, i);
  }

  void set_speed(const QgcItem& item) {
    const double speed = item.parameters[1].value_or(0.0);
    if (!(speed > 0.0)) {
      report_.warning("IMP-COMMAND", item.span,
                      fmt::format("{} is left out: it sets no speed", in_words(item)));
      return;
    }
    speed_ = speed;
    speed_span_ = item.span;
    for (const std::size_t i : {1U, 3U, 4U, 5U, 6U, 7U}) left_out(item, i);
  }

  void add_payload(const QgcItem& item, const Command& command) {
    std::string word = command.name;
    for (const std::optional<double>& value : item.parameters) {
      if (value && *value != 0.0) word += fmt::format("_{:g}", *value);
    }
    payload_.push_back(as_id(word));
    report_.note("IMP-PAYLOAD", item.span,
                 fmt::format("{} becomes the payload command '{}', which the payload must accept",
                             in_words(item), payload_.back()));
  }

  // --- waypoints ---

  void add_leg(const QgcItem& item, const Command& command) {
    const auto& [p1, p2, p3, p4, latitude, longitude, altitude] = item.parameters;
    if (!latitude || !longitude || !altitude) {
      return error(item, "a waypoint has no latitude, longitude and altitude that are numbers");
    }
    if (!(std::abs(*latitude) <= 90.0 && std::abs(*longitude) <= 180.0 &&
          std::isfinite(*altitude))) {
      return error(item, "the position is not on the earth");
    }
    if (*latitude == 0.0 && *longitude == 0.0) {
      return error(item, "latitude 0 and longitude 0 stand for where the vehicle is then",
                   "give the position");
    }
    const auto p = in_world({*latitude, *longitude});
    if (!p) return error(item, fmt::format("the waypoint is {}", kTooFar), kTooFarHint);
    ForeignLeg leg;
    leg.span = item.span;
    leg.points = {*p};
    if (!set_height(item, *altitude, leg)) return;
    set_arrival(item, leg);
    leg.speed = speed_;
    leg.speed_span = speed_span_;
    leg.payload = std::exchange(payload_, {});
    if (*command.why != '\0') {
      report_.warning("IMP-PATTERN", item.span,
                      fmt::format("command {} ({}): {}", item.command, command.name, command.why));
    }
    mission_.legs.push_back(std::move(leg));
  }

  void error(const QgcItem& item, std::string message, std::string hint = {}) {
    report_.error("IMP-QGC", item.span, std::move(message), std::move(hint));
  }

  bool set_height(const QgcItem& item, double altitude, ForeignLeg& leg) {
    const std::optional<Datum> datum = datum_of(item.frame);
    if (!datum) {
      error(item, fmt::format("the frame {} gives no latitude and longitude", item.frame),
            "frames 0, 3 and 10 are read");
      return false;
    }
    if (depth_m_) {
      leg.z = *depth_m_;
      report_.note("IMP-CHANGED", item.span,
                   fmt::format("the altitude becomes a depth of {:g} m, as --depth demands", leg.z),
                   fmt::format("{} m", altitude));
      return true;
    }
    leg.is_altitude = *datum == Datum::kGround;
    leg.z = leg.is_altitude ? altitude : -altitude;
    if (leg.z < 0.0) {
      error(item,
            leg.is_altitude ? fmt::format("the waypoint is {:g} m in the ground", -leg.z)
                            : fmt::format("the waypoint is {:g} m above the surface", altitude),
            "give all of them a depth with --depth");
      return false;
    }
    if (!leg.is_altitude) {
      report_.note("IMP-DATUM", item.span,
                   *datum == Datum::kHome
                       ? "altitudes are above home: home is taken to be at the surface"
                       : "altitudes are above sea level: the surface is taken to be there");
    }
    return true;
  }

  // Hold, radius and yaw.
  void set_arrival(const QgcItem& item, ForeignLeg& leg) {
    leg.dwell_s = std::clamp(item.parameters[0].value_or(0.0), 0.0, kMaxDwell);
    if (leg.dwell_s != item.parameters[0].value_or(0.0)) left_out(item, 1);
    if (item.command == kWaypoint && item.parameters[1].value_or(0.0) > 0.0) {
      leg.capture_radius = std::clamp(*item.parameters[1], kMinCaptureRadius, kMaxCaptureRadius);
      if (leg.capture_radius != *item.parameters[1]) {
        report_.warning(
            "IMP-CHANGED", item.span,
            fmt::format("the acceptance radius may be {:g} to {:g} m", kMinCaptureRadius,
                        kMaxCaptureRadius),
            fmt::format("{} m becomes {:g} m", *item.parameters[1], leg.capture_radius));
      }
    } else {
      left_out(item, 2);
    }
    left_out(item, 3);
    if (item.command == kWaypoint) {
      set_heading(item, leg);
    } else {
      left_out(item, 4);
    }
  }

  void set_heading(const QgcItem& item, ForeignLeg& leg) {
    const std::optional<double>& yaw = item.parameters[3];
    if (!yaw) return;
    if (*yaw == 0.0 && yaw_zero_is_open_) {
      report_.note("IMP-LEFT-OUT", item.span,
                   "param4=0 of a waypoint, its yaw, is taken as not given");
      return;
    }
    leg.heading_deg = *yaw - 360.0 * std::floor(*yaw / 360.0);
  }

  // The first waypoint is the origin.
  std::optional<Eigen::Vector2d> in_world(const GeoPoint& point) {
    if (!mission_.origin) {
      mission_.origin = point;
      report_.note("IMP-ORIGIN", Span{1, 1, 1},
                   fmt::format("the first waypoint, latitude {}, longitude {}, is the origin of x "
                               "and y",
                               point.latitude_deg, point.longitude_deg));
    }
    return to_plane(*mission_.origin, point);
  }

  ImportReport& report_;
  std::optional<double> depth_m_;
  ForeignMission mission_;
  std::optional<double> speed_;
  Span speed_span_;
  bool yaw_zero_is_open_ = false;
  std::vector<std::string> payload_;
};

}  // namespace

std::optional<ForeignMission> read_qgc(const std::string& path, std::optional<double> depth_m,
                                       ImportReport& report) {
  tl::expected<SourceText, std::string> text = read_source_text(path, kMaxBytes);
  if (!text) {
    Diagnostics diagnostics;
    diagnostics.unreadable(path, text.error());
    report.add(diagnostics);
    return std::nullopt;
  }
  const bool has_lines = text->content().starts_with("QGC WPL");
  if (has_lines && !text->line(1).starts_with("QGC WPL 110")) {
    report.set_source(std::move(*text));
    report.error("IMP-QGC", Span{1, 9, 1}, "this version of waypoint files is not known",
                 "version 110 is read");
    return std::nullopt;
  }
  report.set_source(std::move(*text));
  const QgcPlan plan = has_lines ? read_qgc_lines(report) : read_qgc_json(report);
  if (!report.ok()) return std::nullopt;
  return Builder(report, depth_m).build(plan);
}

}  // namespace dive::mission
