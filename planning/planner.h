#pragma once
// The planner: optimise, certify, and where the certificate fails, warm-start and try again
// (Xanthidis et al. 2020, section III-C). A path is handed on only with its certified clearance.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/se3.h"
#include "planning/certify/certify.h"
#include "planning/trajopt/trajopt.h"
#include "planning/warm_start/warm_start.h"
#include "planning/world/world.h"

namespace dive::planning {

struct PlannerOptions {
  double waypoint_spacing_m = 1.5;
  int max_warm_starts = 12;
  TrajoptOptions trajopt;
  CertifyOptions certify;

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

struct PlanRequest {
  Pose start;
  Pose goal;
  bool goal_attitude_fixed = false;
  AttitudeMode attitude = AttitudeMode::kFree;
  double clearance = 0.6;  ///< D_min, m.
  double min_z = -50.0;    ///< Depth limit, m.
  double max_z = 0.0;      ///< m; the surface.
  std::uint64_t seed = 1;
  double min_altitude = 0.0;    ///< m above what is straight below; beyond D_min a soft demand.
  double goal_tolerance = 0.0;  ///< m that a goal which lacks clearance may be moved by.
  std::vector<Pose> previous;   ///< A path to start from (replanning); may be empty.
};

inline constexpr double kMaxGoalTolerance = 5.0;  ///< m
inline constexpr double kMaxAltitude = 100.0;     ///< m

/// Of D_min: a start that has less may lose nothing on its way to where there is D_min again, ...
inline constexpr double kRoomAtStart = 0.85;
inline constexpr double kWayToRoom = 2.0;  ///< ... which must not be farther off than that, m.

enum class PlanStatus {
  kSuccess,  ///< The path is certified at `clearance` or better; from a start that lacks it, the
             ///< way out of there at no less than the start has.
  kNoPath,   ///< None: blocked, too tight, or none found within the bound; see `reason`.
  kInvalid,  ///< The question makes no sense: NaN, start or goal in collision, out of limits.
};

[[nodiscard]] const char* to_string(PlanStatus status);

struct StageTimes {
  double optimise_ms = 0.0;
  double warm_start_ms = 0.0;
  double certify_ms = 0.0;
  double total_ms = 0.0;
};

struct PlanResult {
  PlanStatus status = PlanStatus::kInvalid;
  std::string reason;           ///< Empty on success.
  std::vector<Pose> waypoints;  ///< On kNoPath the best that was found, to be looked at only.
  double clearance_m = 0.0;     ///< Certified, of `waypoints`: on kNoPath what would have worked.
  double length_m = 0.0;
  int warm_starts = 0;
  int iterations = 0;  ///< Of the optimiser, all attempts.
  StageTimes times;    ///< Depends on the machine: never logged.
};

/// One per thread.
class Planner {
 public:
  /// `clock` is for StageTimes only: the same request and seed give the same path on any machine.
  Planner(const World& world, const RobotHull& hull, PlannerOptions options, Clock& clock);
  Planner(Planner&&) noexcept;
  ~Planner();

  [[nodiscard]] PlanResult plan(const PlanRequest& request);
  /// Certified clearance of any motion, e.g. a retrace.
  [[nodiscard]] Certificate certify(std::span<const Pose> waypoints);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
