#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/import/qgc_items.h"

namespace dive::mission {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxCorners = 64;  // maximum for a geofence in a mission

void error(ImportReport& report, Span span, std::string message, std::string hint = {}) {
  report.error("IMP-QGC", span, std::move(message), std::move(hint));
}

/// Keys that are irrelevant to the dive.
constexpr std::array<std::string_view, 14> kBookkeeping{"fileType",
                                                        "groundStation",
                                                        "version",
                                                        "firmwareType",
                                                        "vehicleType",
                                                        "doJumpId",
                                                        "type",
                                                        "Altitude",
                                                        "AltitudeMode",
                                                        "AMSLAltAboveTerrain",
                                                        "complexItemType",
                                                        "globalPlanAltitudeMode",
                                                        "cruiseSpeed",
                                                        "hoverSpeed"};
constexpr std::array<std::string_view, 14> kUsed{
    "geoFence",     "rallyPoints", "mission",
    "items",        "points",      "polygon",
    "polygons",     "circles",     "plannedHomePosition",
    "autoContinue", "command",     "coordinate",
    "frame",        "params"};

class PlanReader {
 public:
  explicit PlanReader(ImportReport& report) : report_(report) {}

  QgcPlan read() {
    const json plan = parse();
    if (!report_.ok()) return {};
    if (!plan.is_object() || !plan.contains("mission") || !plan["mission"].is_object() ||
        !plan["mission"].contains("items") || !plan["mission"]["items"].is_array()) {
      error(report_, Span{1, 1, 1}, "this is not a QGroundControl plan: it has no mission.items");
      return {};
    }
    report_keys(plan);
    report_keys(plan["mission"]);
    constexpr int kArduPilot = 3;  // MAV_AUTOPILOT
    const json& firmware = plan["mission"].contains("firmwareType")
                               ? plan["mission"]["firmwareType"]
                               : plan["mission"]["items"];
    plan_.yaw_zero_is_open = firmware.is_number_integer() && firmware == kArduPilot;
    if (plan["mission"].contains("plannedHomePosition")) {
      report_.note("IMP-LEFT-OUT", span_of("plannedHomePosition"),
                   fmt::format("'plannedHomePosition' {} is left out: the vehicle starts at the "
                               "first waypoint",
                               plan["mission"]["plannedHomePosition"].dump()));
    }
    read_items(plan["mission"]["items"], false);
    if (plan.contains("geoFence") && plan["geoFence"].is_object()) read_fence(plan["geoFence"]);
    if (plan.contains("rallyPoints") && plan["rallyPoints"].is_object()) {
      read_rally_points(plan["rallyPoints"]);
    }
    return std::move(plan_);
  }

 private:
  json parse() {
    const std::string& text = report_.source().content();
    try {
      return json::parse(text);
    } catch (const json::parse_error& problem) {
      const std::size_t at = problem.byte > 0 ? problem.byte - 1 : 0;
      const std::size_t begin = text.find_first_not_of(" \t\r\n");
      const bool is_json = begin != std::string::npos && text[begin] == '{';
      error(report_, report_.source().span_at(at, 1),
            is_json ? "the JSON of the plan is broken here"
                    : "this is neither a plan (JSON) nor a waypoint file (QGC WPL 110)");
    } catch (const json::out_of_range&) {
      error(report_, Span{1, 1, 1}, "the plan has a number that is too large");
    }
    return {};
  }

  // Span of the first occurrence of the key in the text; JSON values have no positions.
  [[nodiscard]] Span span_of(std::string_view key) const {
    const std::string quoted = fmt::format("\"{}\"", key);
    const std::size_t at = report_.source().content().find(quoted);
    return at == std::string::npos ? Span{1, 1, 1} : report_.source().span_at(at, quoted.size());
  }

  Span next_command() {
    const std::size_t at = report_.source().content().find("\"command\"", from_);
    if (at == std::string::npos) return Span{1, 1, 1};
    from_ = at + 1;
    return report_.source().span_at(at, 9);
  }

  // Reports unused keys of an object, each at its first occurrence.
  void report_keys(const json& object, std::string_view name = {}) {
    for (const auto& [key, value] : object.items()) {
      if (std::ranges::find(kUsed, key) != kUsed.end()) continue;
      const std::string of = name.empty() ? "" : fmt::format(" of {}", name);
      if (std::ranges::find(kBookkeeping, key) != kBookkeeping.end()) {
        report_.note("IMP-LEFT-OUT", span_of(key),
                     fmt::format("'{}' is left out: it is for QGroundControl only", key));
        continue;
      }
      report_.warning("IMP-UNKNOWN", span_of(key),
                      fmt::format("'{}'{} is not understood and left out", key, of));
    }
  }

  void read_items(const json& list, bool in_survey) {
    for (const json& item : list) {
      // A survey contains the waypoints generated from it, but no other survey.
      if (!in_survey && item.is_object() && item.contains("TransectStyleComplexItem")) {
        const json& survey = item["TransectStyleComplexItem"];
        if (survey.is_object() && survey.contains("Items") && survey["Items"].is_array()) {
          report_.warning("IMP-PATTERN", span_of("TransectStyleComplexItem"),
                          "a survey is swum along the waypoints that it was turned into: its own "
                          "settings, the camera's among them, are left out");
          read_items(survey["Items"], true);
          continue;
        }
      }
      const Span span = next_command();
      if (plan_.items.size() >= kMaxQgcItems) {
        return error(report_, span, fmt::format("there are more than {} items", kMaxQgcItems));
      }
      if (!item.is_object() || !item.contains("command") || !item["command"].is_number_integer()) {
        error(report_, span, "an item has no command",
              "complex items must be turned into waypoints");
        continue;
      }
      report_keys(item, "an item");
      read_item(item, span);
    }
  }

  // Seven parameters; in older files four, with separate coordinates.
  void read_item(const json& item, Span span) {
    QgcItem read;
    read.span = span;
    if (!take_whole(item, "command", read.command) || !take_whole(item, "frame", read.frame)) {
      error(report_, span, kNotWhole);
      return;
    }
    if (item.contains("autoContinue") && item["autoContinue"].is_boolean()) {
      read.goes_on = item["autoContinue"].get<bool>();
    }
    const bool well_formed =
        take_numbers(item, "params", 0, 7, read) && take_numbers(item, "coordinate", 4, 3, read);
    if (!well_formed) {
      error(report_, span, "the parameters of an item must be numbers or null");
      return;
    }
    plan_.items.push_back(read);
  }

  // False if there is a number that is none of those: converted, 2^32 + 16 would become 16.
  static bool take_whole(const json& item, const char* key, int& value) {
    if (!item.contains(key) || !item[key].is_number_integer()) return true;
    const auto written = item[key].get<double>();
    if (!is_whole(written)) return false;
    value = static_cast<int>(written);
    return true;
  }

  static bool take_numbers(const json& item, const char* key, std::size_t first, std::size_t most,
                           QgcItem& read) {
    if (!item.contains(key)) return true;
    const json& list = item[key];
    if (!list.is_array() || list.size() > most) return false;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].is_null()) continue;
      if (!list[i].is_number()) return false;
      read.parameters[first + i] = list[i].get<double>();
    }
    return true;
  }

  // --- fence and rally points ---

  void read_fence(const json& fence) {
    report_keys(fence, "the geofence");
    std::vector<std::vector<GeoPoint>> inside;
    if (fence.contains("polygon") && !fence["polygon"].empty()) {
      inside.push_back(corners(fence["polygon"]));
    }
    for (const json& polygon : list_of(fence, "polygons")) {
      const bool keeps_out =
          polygon.is_object() && polygon.contains("inclusion") && polygon["inclusion"] == false;
      if (!keeps_out && polygon.is_object() && polygon.contains("polygon")) {
        inside.push_back(corners(polygon["polygon"]));
      } else {
        leave_out_of_fence("a polygon to stay out of");
      }
    }
    for (std::size_t i = 0; i < list_of(fence, "circles").size(); ++i)
      leave_out_of_fence("a circle");
    if (inside.empty()) return;
    const std::size_t count = inside.front().size();
    if (inside.size() == 1 && count >= 3 && count <= kMaxCorners) {
      plan_.fence = std::move(inside.front());
      return;
    }
    leave_out_of_fence(inside.size() > 1 ? "more than one polygon to stay in"
                                         : fmt::format("a polygon of {} corners", count));
  }

  void leave_out_of_fence(const std::string& what) {
    report_.warning("IMP-COMMAND", span_of("geoFence"),
                    fmt::format("{} of the 'geoFence' is left out: a mission's geofence is one "
                                "polygon of 3 to {} corners to stay in",
                                what, kMaxCorners),
                    {}, "put what must be kept away from into the map");
  }

  static const json& list_of(const json& object, const char* key) {
    static const json kNone = json::array();
    return object.contains(key) && object[key].is_array() ? object[key] : kNone;
  }

  std::vector<GeoPoint> corners(const json& list) {
    std::vector<GeoPoint> points;
    for (const json& point : list) {
      if (point.is_array() && point.size() >= 2 && point[0].is_number() && point[1].is_number()) {
        points.push_back({point[0].get<double>(), point[1].get<double>()});
        continue;
      }
      error(report_, span_of("geoFence"), "a corner of the geofence is not two numbers");
      return {};
    }
    return points;
  }

  void read_rally_points(const json& rally) {
    report_keys(rally, "the rally points");
    const std::size_t count = list_of(rally, "points").size();
    if (count == 0) return;
    report_.warning(
        "IMP-COMMAND", span_of("rallyPoints"),
        fmt::format("{} 'rallyPoints' are left out: an abort leads back along the trail "
                    "and up",
                    count));
  }

  ImportReport& report_;
  QgcPlan plan_;
  std::size_t from_ = 0;  // start of the search for the next "command"
};

}  // namespace

QgcPlan read_qgc_json(ImportReport& report) { return PlanReader(report).read(); }

}  // namespace dive::mission
