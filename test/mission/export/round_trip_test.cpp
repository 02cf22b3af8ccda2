// Positions of a mission, through GeoJSON and KML and back into a mission by latitude and
// longitude.

#include <regex>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <rapidcheck/gtest.h>

#include "mission/document/mission.h"
#include "mission/document/state_index.h"
#include "mission/export/export_format.h"
#include "mission/export/read_exported.h"

namespace dive::mission {
namespace {

constexpr const char* kOrigin = "<origin latitude=\"-33.839459\" longitude=\"151.25438\"/>";

// The goals of a mission; `goals` are their elements.
std::optional<Mission> parse(const std::string& goals) {
  Diagnostics diagnostics;
  const std::string text = fmt::format(
      "<mission xmlns=\"urn:dive:mission:1\" id=\"m\">{}<vehicle model=\"aqua2\" speed=\"0.4\"/>"
      "<map file=\"maps/window.sdf\"/><start x=\"0\" y=\"0\" z=\"1\" z_units=\"DEPTH\" "
      "heading_deg=\"0\"/><limits max_depth=\"100\" min_altitude=\"0\" clearance=\"0.6\" "
      "mission_timeout=\"900\" battery_reserve=\"0.2\"/><states initial=\"a\"><goal_sequence "
      "id=\"a\" timeout=\"600\" on_timeout=\"up\">{}<transition event=\"done.state.a\" "
      "target=\"up\"/></goal_sequence><surface id=\"up\"><transition event=\"done.state.up\" "
      "target=\"end\"/></surface><final id=\"end\"/></states></mission>\n",
      kOrigin, goals);
  const std::string path = DIVE_SOURCE_DIR "/missions/window.xml";
  auto mission = parse_mission(SourceText(path, text), diagnostics);
  for (const Diagnostic& d : diagnostics.list()) {
    if (d.severity == Severity::kError) ADD_FAILURE() << render(d, false);
  }
  return mission;
}

std::string goal(std::size_t number, const std::string& place) {
  return fmt::format("<goal id=\"g{}\" {} z=\"5\" z_units=\"DEPTH\"/>", number, place);
}

// Longitude and latitude, as written, of each point.
using Written = std::vector<std::pair<std::string, std::string>>;

Written points_of_geojson(const std::string& text) {
  Written written;
  const auto json = nlohmann::json::parse(text);
  for (const auto& feature : json.at("features")) {
    if (feature.at("geometry").at("type") != "Point") continue;
    if (feature.at("properties").at("kind") != "goal") continue;
    const auto& p = feature.at("geometry").at("coordinates");
    EXPECT_NEAR(p.at(2).get<double>(), -5.0, 1e-3);
    written.emplace_back(fmt::format("{:.12f}", p.at(0).get<double>()),
                         fmt::format("{:.12f}", p.at(1).get<double>()));
  }
  return written;
}

Written points_of_kml(const std::string& text) {
  Written written;
  const std::regex point("<Point>.*<coordinates>([^,]*),([^,]*),.*</Point>");
  for (std::sregex_iterator at(text.begin(), text.end(), point), end; at != end; ++at) {
    written.emplace_back((*at)[1], (*at)[2]);
  }
  if (!written.empty()) written.erase(written.begin());  // the start
  return written;
}

RC_GTEST_PROP(ExportRoundTrip, PositionsComeBackWithinAMillimetre, ()) {
  const auto metres = [] { return *rc::gen::inRange(-4'000'000, 4'000'001) * 1e-3; };
  std::vector<Eigen::Vector2d> places;
  std::string goals;
  for (std::size_t i = 0; i < 5; ++i) {
    const double x = metres();
    places.emplace_back(x, metres());
    goals += goal(i, fmt::format("x=\"{:.3f}\" y=\"{:.3f}\"", places[i].x(), places[i].y()));
  }
  const auto mission = parse(goals);
  RC_ASSERT(mission.has_value());
  const Exported exported = exported_mission(*mission, {}, {}, std::nullopt);
  for (const Written& written :
       {points_of_geojson(to_geojson(exported)), points_of_kml(to_kml(exported))}) {
    RC_ASSERT(written.size() == places.size());
    std::string again;
    for (std::size_t i = 0; i < written.size(); ++i) {
      again += goal(
          i, fmt::format("longitude=\"{}\" latitude=\"{}\"", written[i].first, written[i].second));
    }
    const auto back = parse(again);
    RC_ASSERT(back.has_value());
    const auto reached = goals_of(back->states.at(0));
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Position& p = reached.at(i)->position;
      RC_ASSERT((Eigen::Vector2d(p.x.value, p.y.value) - places[i]).norm() < 1e-3);
    }
  }
}

}  // namespace
}  // namespace dive::mission
