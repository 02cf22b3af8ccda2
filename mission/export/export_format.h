#pragma once
// The formats of `dive export`, and what each kind of file can become.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mission/export/exported.h"

namespace dive::mission {

enum class ExportFormat { kGeoJson, kKml, kCsv, kPly, kGltf, kMcap };

/// The kinds of files that can be exported.
enum class ExportKind { kMission, kPlan, kLog, kMap, kCloud };

/// "geojson", ...
[[nodiscard]] const char* to_string(ExportFormat format);
/// The names of all formats.
[[nodiscard]] std::vector<std::string> format_names();
/// Demands one of format_names().
[[nodiscard]] ExportFormat find_format(std::string_view name);

/// What a kind of file can become: a map has no track, and a plan no time.
[[nodiscard]] std::span<const ExportFormat> formats_of(ExportKind kind);
/// True if the format has latitudes and longitudes, and needs Exported::origin.
[[nodiscard]] bool needs_origin(ExportFormat format);

/// The content of the file. Demands an origin where the format needs one.
[[nodiscard]] std::string export_as(ExportFormat format, const Exported& exported);

// One for each format.

/// RFC 7946: points, planned paths, the fence and the tracks; the third coordinate is z in W (m).
[[nodiscard]] std::string to_geojson(const Exported& exported);
/// KML 2.2 (OGC 07-147r2): the same; altitudes are absolute, below the surface negative.
[[nodiscard]] std::string to_kml(const Exported& exported);
/// RFC 4180, with a header line that states units: the track of a log, the waypoints of a plan.
[[nodiscard]] std::string to_csv(const Exported& exported);
/// PLY 1.0, binary little-endian: the map as triangles, paths and cloud as coloured vertices, in W.
[[nodiscard]] std::string to_ply(const Exported& exported);
/// glTF 2.0 with an embedded buffer: map, paths and cloud. glTF's y is up, so (x, y, z) of W
/// becomes (x, z, -y).
[[nodiscard]] std::string to_gltf(const Exported& exported);
/// MCAP with JSON messages, ten samples a second: see mcap_schemas.h for its topics.
[[nodiscard]] std::string to_mcap(const Exported& exported);

}  // namespace dive::mission
