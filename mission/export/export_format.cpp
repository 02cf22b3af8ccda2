#include "mission/export/export_format.h"

#include <algorithm>
#include <array>

#include "common/assert.h"

namespace dive::mission {
namespace {

using enum ExportFormat;

constexpr std::array<const char*, 6> kNames{"geojson", "kml", "csv", "ply", "gltf", "mcap"};
constexpr std::array kOfLogs{kGeoJson, kKml, kCsv, kPly, kGltf, kMcap};
constexpr std::array kOfMissions{kGeoJson, kKml, kCsv, kPly, kGltf};
constexpr std::array kOfPlans{kCsv, kPly, kGltf};
constexpr std::array kOfShapes{kPly, kGltf};

}  // namespace

const char* to_string(ExportFormat format) { return kNames[static_cast<std::size_t>(format)]; }

std::vector<std::string> format_names() { return {kNames.begin(), kNames.end()}; }

ExportFormat find_format(std::string_view name) {
  const auto* const found = std::ranges::find(kNames, name);
  DIVE_DEMAND(found != kNames.end());
  return static_cast<ExportFormat>(found - kNames.begin());
}

std::span<const ExportFormat> formats_of(ExportKind kind) {
  switch (kind) {
    case ExportKind::kLog:
      return kOfLogs;
    case ExportKind::kMission:
      return kOfMissions;
    case ExportKind::kPlan:
      return kOfPlans;
    case ExportKind::kMap:
    case ExportKind::kCloud:
      break;
  }
  return kOfShapes;
}

bool needs_origin(ExportFormat format) { return format == kGeoJson || format == kKml; }

std::string export_as(ExportFormat format, const Exported& exported) {
  DIVE_DEMAND(exported.origin || !needs_origin(format));
  switch (format) {
    case kGeoJson:
      return to_geojson(exported);
    case kKml:
      return to_kml(exported);
    case kCsv:
      return to_csv(exported);
    case kPly:
      return to_ply(exported);
    case kGltf:
      return to_gltf(exported);
    case kMcap:
      break;
  }
  return to_mcap(exported);
}

}  // namespace dive::mission
