#pragma once
// QGroundControl's two file formats, as the MAVLink mission items they contain.

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "common/geodesy.h"
#include "mission/import/import_report.h"

namespace dive::mission {

/// MISSION_ITEM of MAVLink. Parameters that are null or NaN are absent.
struct QgcItem {
  int frame = 3;    ///< MAV_FRAME: meaning of the last three parameters.
  int command = 0;  ///< MAV_CMD
  std::array<std::optional<double>, 7> parameters;
  bool goes_on = true;  ///< autocontinue
  Span span;
};

inline constexpr std::size_t kMaxQgcItems = 990;  ///< Limit for one of our missions.

struct QgcPlan {
  std::vector<QgcItem> items;
  std::vector<GeoPoint> fence;    ///< The single inclusion polygon; empty: none.
  bool yaw_zero_is_open = false;  ///< A waypoint with param4 = 0 has no yaw, as in ArduPilot.
};

/// True for a number that a frame or command may be, which both formats write as any number.
[[nodiscard]] inline bool is_whole(double value) {
  return value >= 0.0 && value <= 65535.0 && value == std::floor(value);
}
inline constexpr const char* kNotWhole = "frame and command are whole numbers from 0 to 65535";

/// Reads the text of `report`, which receives the errors.
[[nodiscard]] QgcPlan read_qgc_lines(ImportReport& report);
[[nodiscard]] QgcPlan read_qgc_json(ImportReport& report);

}  // namespace dive::mission
