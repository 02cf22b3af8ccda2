#pragma once
// The common content of other systems' mission files, their readers, and the conversion to our
// format.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/geodesy.h"
#include "common/source_text.h"
#include "mission/document/rules.h"
#include "mission/import/import_report.h"

namespace dive::mission {

// Bounds of capture_radius in missions/mission.xsd, m.
inline constexpr double kMinCaptureRadius = 0.05;
inline constexpr double kMaxCaptureRadius = 20.0;

/// A part of a foreign mission: positions to be reached in sequence.
struct ForeignLeg {
  std::vector<Eigen::Vector2d> points;  ///< x east, y north, m; at least one.
  double z = 0.0;                       ///< m, depth or altitude, >= 0.
  bool is_altitude = false;
  std::optional<double> heading_deg;  ///< Heading from north at a single point, in [0, 360).
  double dwell_s = 0.0;               ///< Dwell at the last point.
  std::optional<double> speed;        ///< m/s, as written.
  std::optional<double> timeout_s;    ///< Timeout as written, s.
  double capture_radius = 0.5;        ///< m
  std::vector<std::string> payload;   ///< Payload commands on entry.
  Span span;
  Span speed_span;
  Span timeout_span;
};

/// Start of a foreign mission, if its file gives one.
struct ForeignStart {
  Eigen::Vector2d p = Eigen::Vector2d::Zero();  ///< x east, y north, m.
  std::optional<double> heading_deg;            ///< From north, in [0, 360).
};

struct ForeignMission {
  std::string id;
  std::string description;
  std::optional<GeoPoint> origin;      ///< Origin of x and y, where the file gives it.
  std::optional<ForeignStart> start;   ///< Absent: the first point of the first leg.
  std::vector<ForeignLeg> legs;        ///< At least one.
  std::vector<Eigen::Vector2d> fence;  ///< Corners, x east, y north, m; empty: none.
  std::vector<std::string> payload;    ///< Payload commands after the last leg.
  std::string speed_name;              ///< The format's name for the speed of a leg, for findings.
  std::string timeout_name;
};

struct ImportOptions {
  /// m/s. Absent: the speed of the slowest leg, if the Aqua2 can swim it.
  std::optional<double> speed;
  double seabed_m = 0.0;   ///< Assumed depth of the flat seabed; 0: below the deepest leg.
  double clearance = 0.6;  ///< m
};

/// The contents of two files: our mission, and a flat seabed as its map.
struct Imported {
  std::string mission_xml;
  std::string map_sdf;
  std::string map_name;  ///< Relative to the mission's folder.
  double speed = 0.0;    ///< m/s
};

/// The position from which the first leg starts, m.
[[nodiscard]] Eigen::Vector2d start_of(const ForeignMission& mission);

/// The valid id nearest to `text`.
[[nodiscard]] std::string as_id(std::string_view text);

/// Converts the mission to our format. Where the speed changes, every timeout is scaled by the same
/// ratio. Reports every difference from the file and every value that was added.
[[nodiscard]] Imported write_mission(const ForeignMission& mission, const ImportOptions& options,
                                     const std::string& from, ImportReport& report);

/// Reports defects possible in any foreign mission, each at its leg: legs that cannot finish within
/// their own timeout at their own speed, depths and altitudes that our vehicle cannot keep, an end
/// below the surface.
void report_defects(const ForeignMission& mission, ImportReport& report);

/// Reads ACFR's XML of its Sirius-class vehicles (x north, y east, headings from north): goto, leg,
/// zambonie, spiralinward. Returns nothing after an error, which is reported at its line.
[[nodiscard]] std::optional<ForeignMission> read_acfr(const std::string& path,
                                                      ImportReport& report);

/// Reads QGroundControl's .plan (JSON) or a waypoint file ("QGC WPL 110"). The first position
/// is the origin; all others are within 20 km of it. Altitudes above the surface are rejected,
/// unless `depth_m` gives the depth to swim at.
[[nodiscard]] std::optional<ForeignMission> read_qgc(const std::string& path,
                                                     std::optional<double> depth_m,
                                                     ImportReport& report);

/// The IMP-* rules.
[[nodiscard]] std::span<const Rule> import_rules();

}  // namespace dive::mission
