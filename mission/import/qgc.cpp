#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/se3.h"
#include "mission/import/foreign_mission.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMaxBytes = 4U << 20U;
constexpr std::size_t kMaxItems = 1000;
constexpr double kEarthRadius = 6'378'137.0;  // m, WGS 84's larger axis
constexpr int kWaypoint = 16;                 // MAV_CMD_NAV_WAYPOINT
constexpr int kTakeoff = 22;                  // MAV_CMD_NAV_TAKEOFF

struct Item {
  int command = 0;
  double latitude = 0.0;
  double longitude = 0.0;
  double altitude = 0.0;  ///< m above home: negative under water.
  Span span;
};

class Builder {
 public:
  Builder(const SourceText& source, Diagnostics& diagnostics)
      : source_(source), diagnostics_(diagnostics) {}

  void error(Span span, std::string message, std::string hint = {}) {
    is_broken_ = true;
    diagnostics_.error("IMP-QGC", source_, span, std::move(message), std::move(hint));
  }

  std::optional<ForeignMission> build(const std::vector<Item>& items) {
    ForeignMission mission;
    const Item* home = nullptr;
    for (const Item& item : items) {
      if (item.command != kWaypoint) {
        diagnostics_.warning("IMP-PRIMITIVE", source_, item.span,
                             fmt::format("the command {} is left out", item.command),
                             item.command == kTakeoff ? "nothing takes off under water"
                                                      : "only waypoints (16) are imported");
        continue;
      }
      if (!(std::abs(item.latitude) <= 90.0 && std::abs(item.longitude) <= 180.0 &&
            std::isfinite(item.altitude))) {
        error(item.span, "the position is not on the earth");
        continue;
      }
      if (item.altitude > 0.0) {
        error(item.span, fmt::format("the waypoint is {:g} m above the surface", item.altitude),
              "give all of them a depth with --depth");
        continue;
      }
      if (home == nullptr) home = &item;
      mission.legs.push_back(leg(item, *home));
    }
    if (mission.legs.empty() && !is_broken_) {
      error(Span{1, 1, 1}, "there is no waypoint that can be swum");
    }
    if (is_broken_) return std::nullopt;
    return mission;
  }

  [[nodiscard]] bool is_broken() const { return is_broken_; }

 private:
  static ForeignLeg leg(const Item& item, const Item& home) {
    const double north = kEarthRadius * deg_to_rad(item.latitude - home.latitude);
    const double east = kEarthRadius * std::cos(deg_to_rad(home.latitude)) *
                        deg_to_rad(item.longitude - home.longitude);
    ForeignLeg leg;
    leg.points = {{east, north}};
    leg.z = -item.altitude;
    leg.span = item.span;
    return leg;
  }

  const SourceText& source_;
  Diagnostics& diagnostics_;
  bool is_broken_ = false;
};

// "INDEX CURRENT FRAME COMMAND P1 P2 P3 P4 LATITUDE LONGITUDE ALTITUDE AUTOCONTINUE"
void read_lines(const SourceText& source, Builder& builder, std::vector<Item>& items) {
  for (int number = 2; number <= source.line_count(); ++number) {
    std::istringstream line{std::string(source.line(number))};
    const Span span{number, 1, std::max(static_cast<int>(source.line(number).size()), 1)};
    double value[12];
    int read = 0;
    while (read < 12 && line >> value[read]) ++read;
    if (read == 0) continue;
    if (read < 12) {
      builder.error(span, fmt::format("a waypoint has 12 numbers, this line has {}", read));
      continue;
    }
    // The first is where home is, not where to swim.
    const bool is_home = items.empty() && value[0] == 0.0;
    if (!is_home) {
      items.push_back({static_cast<int>(value[3]), value[8], value[9], value[10], span});
    }
    if (items.size() > kMaxItems) return builder.error(span, "there are more than 1000 waypoints");
  }
}

Span span_of_command(const SourceText& source, std::size_t& from) {
  const std::size_t at = source.content().find("\"command\"", from);
  if (at == std::string::npos) return Span{1, 1, 1};
  from = at + 1;
  return source.span_at(at, 9);
}

/// Latitude, longitude, altitude: the last three of seven parameters, in older files apart from
/// them.
std::optional<std::array<double, 3>> place_of(const nlohmann::json& item) {
  for (const auto& [key, size] : {std::pair("coordinate", 3U), std::pair("params", 7U)}) {
    if (!item.contains(key) || !item[key].is_array() || item[key].size() != size) continue;
    std::array<double, 3> place{};
    for (std::size_t i = 0; i < 3; ++i) {
      const nlohmann::json& value = item[key][size - 3 + i];
      if (!value.is_number()) return std::nullopt;
      place[i] = value.get<double>();
    }
    return place;
  }
  return std::nullopt;
}

void read_items(const nlohmann::json& list, bool in_survey, const SourceText& source,
                std::size_t& from, Builder& builder, std::vector<Item>& items) {
  for (const nlohmann::json& item : list) {
    // A survey carries the waypoints it was turned into, but no other survey.
    if (!in_survey && item.is_object() && item.contains("TransectStyleComplexItem")) {
      const nlohmann::json& survey = item["TransectStyleComplexItem"];
      if (survey.is_object() && survey.contains("Items") && survey["Items"].is_array()) {
        read_items(survey["Items"], true, source, from, builder, items);
        continue;
      }
    }
    const Span span = span_of_command(source, from);
    if (items.size() > kMaxItems) return builder.error(span, "there are more than 1000 waypoints");
    if (!item.is_object() || !item.contains("command") || !item["command"].is_number_integer()) {
      builder.error(span, "an item has no command", "complex items must be turned into waypoints");
      continue;
    }
    Item read{item["command"].get<int>(), 0.0, 0.0, 0.0, span};
    if (const auto place = place_of(item)) {
      read.latitude = (*place)[0];
      read.longitude = (*place)[1];
      read.altitude = (*place)[2];
    } else if (read.command == kWaypoint) {
      builder.error(span, "a waypoint has no latitude, longitude and altitude that are numbers");
      continue;
    }
    items.push_back(read);
  }
}

void read_plan(const SourceText& source, Builder& builder, std::vector<Item>& items) {
  const nlohmann::json plan = nlohmann::json::parse(source.content(), nullptr, false);
  if (!plan.is_object() || !plan.contains("mission") || !plan["mission"].is_object() ||
      !plan["mission"].contains("items") || !plan["mission"]["items"].is_array()) {
    return builder.error(Span{1, 1, 1},
                         "this is not a plan of QGroundControl's: it has no mission.items");
  }
  std::size_t from = 0;
  read_items(plan["mission"]["items"], false, source, from, builder, items);
}

}  // namespace

std::optional<ForeignMission> read_qgc(const std::string& path, std::optional<double> depth_m,
                                       Diagnostics& diagnostics, SourceText& source) {
  tl::expected<SourceText, std::string> text = read_source_text(path, kMaxBytes);
  if (!text) {
    diagnostics.error("FILE-UNREADABLE", SourceText(path, ""), Span{},
                      fmt::format("the file cannot be read: {}", text.error()));
    return std::nullopt;
  }
  source = std::move(*text);
  Builder builder(source, diagnostics);
  std::vector<Item> items;
  if (source.content().starts_with("QGC WPL ")) {
    read_lines(source, builder, items);
  } else {
    read_plan(source, builder, items);
  }
  if (builder.is_broken()) return std::nullopt;
  if (depth_m) {
    for (Item& item : items) item.altitude = -*depth_m;
  }
  return builder.build(items);
}

}  // namespace dive::mission
