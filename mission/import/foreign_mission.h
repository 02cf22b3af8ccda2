#pragma once
// What other people's mission files have in common, and how it is written as one of ours.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "mission/document/rules.h"

namespace dive::mission {

/// A stretch of a foreign mission: positions to be swum one after the other.
struct ForeignLeg {
  std::vector<Eigen::Vector2d> points;  ///< x east, y north, m.
  double z = 0.0;                       ///< m, depth or altitude.
  bool is_altitude = false;
  double speed = 0.0;  ///< m/s, as written.
  double timeout_s = 0.0;
  double capture_radius = 0.5;       ///< m
  std::vector<std::string> payload;  ///< Commands on entry.
  Span span;
};

struct ForeignMission {
  std::string id;
  std::string description;
  std::vector<ForeignLeg> legs;  ///< At least one.
};

struct ImportOptions {
  double speed = 0.4;      ///< m/s of our vehicle.
  double seabed_m = 0.0;   ///< Depth of the flat seabed that is assumed; 0: below the deepest leg.
  double clearance = 0.6;  ///< m
};

/// Our mission and a flat seabed as its map: two files' contents.
struct Imported {
  std::string mission_xml;
  std::string map_sdf;
  std::string map_name;  ///< Beneath the mission's folder.
};

/// The nearest thing to `text` that is an id of ours.
[[nodiscard]] std::string as_id(std::string_view text);

[[nodiscard]] Imported write_mission(const ForeignMission& mission, const ImportOptions& options,
                                     const std::string& from);

/// Defects that any foreign mission can have, each at the leg that has it (codes IMP-*): legs that
/// cannot finish within their own timeout at their own speed, speeds that our vehicle does not
/// swim, an end below the surface.
void report_defects(const ForeignMission& mission, const SourceText& source,
                    Diagnostics& diagnostics);

/// ACFR's XML of its Sirius-class vehicles (x north, y east, headings from north): goto, leg,
/// zambonie, inwardspiral. Nothing when there was an error, which is reported at its line.
[[nodiscard]] std::optional<ForeignMission> read_acfr(const std::string& path,
                                                      Diagnostics& diagnostics, SourceText& source);

/// QGroundControl's .plan (JSON) or a waypoint file ("QGC WPL 110"). Positions are taken relative
/// to the first one. Altitudes above the surface are refused, unless `depth_m` says where to swim
/// instead.
[[nodiscard]] std::optional<ForeignMission> read_qgc(const std::string& path,
                                                     std::optional<double> depth_m,
                                                     Diagnostics& diagnostics, SourceText& source);

/// The IMP-* rules.
[[nodiscard]] std::span<const Rule> import_rules();

}  // namespace dive::mission
