#include "mission/executive/failsafe_words.h"

#include <fmt/format.h>

namespace dive::mission {

using behaviors::FailsafeKind;
using behaviors::SensorLoss;

namespace {

std::string describe(SensorLoss loss, const char* quantity, double limit_s) {
  switch (loss) {
    case SensorLoss::kSilent:
      return fmt::format("no plausible {} for {:g} s", quantity, limit_s);
    case SensorLoss::kFrozen:
      return fmt::format("the {} has not changed for {:g} s: the sensor is frozen", quantity,
                         behaviors::kFrozenSeconds);
    case SensorLoss::kContradicted:
      return fmt::format("the {} does not change although the vehicle rises or sinks", quantity);
  }
  return {};
}

}  // namespace

// Longer than a screen because it is a table: one case per failsafe.
std::string describe(FailsafeKind kind, const Mission& mission, const Situation& situation) {
  const double limit = mission.failsafes.threshold[static_cast<std::size_t>(kind)];
  const behaviors::Progress& progress = situation.progress;
  switch (kind) {
    case FailsafeKind::kLeak:
      return "water in the hull";
    case FailsafeKind::kBattery:
      return fmt::format("{:.0f} % of charge left, less than {:.0f} %",
                         100.0 * situation.health.battery_fraction, 100.0 * limit);
    case FailsafeKind::kTemperature:
      return fmt::format("{:.0f} degrees in the hull, more than {:g}",
                         situation.health.temperature_c, limit);
    case FailsafeKind::kOverdepth:
      return fmt::format("deeper than {:g} m", mission.limits.max_depth.value);
    case FailsafeKind::kMinAltitude:
      return fmt::format("{:.2f} m above the ground, less than {:g} m",
                         situation.altitude_m.value_or(0.0), mission.limits.min_altitude.value);
    case FailsafeKind::kGeofence:
      return fmt::format("({:.1f}, {:.1f}) is outside of the fence", situation.estimate.X_WB.p.x(),
                         situation.estimate.X_WB.p.y());
    case FailsafeKind::kMissionTimeout:
      return fmt::format("longer than the mission's limit of {:g} s",
                         mission.limits.mission_timeout.value);
    case FailsafeKind::kLegTimeout:
      return fmt::format("{:.0f} s on a leg of {:.0f} s", progress.elapsed_s, progress.expected_s);
    case FailsafeKind::kStuck:
      return fmt::format("in the same place for {:g} s", limit);
    case FailsafeKind::kImuLost:
      return describe(situation.imu_loss, "attitude", limit);
    case FailsafeKind::kDepthLost:
      return describe(situation.depth_loss, "depth", limit);
    case FailsafeKind::kHealthLost:
      return fmt::format("no battery and leak data for {:g} s", limit);
    case FailsafeKind::kRangeLost:
      return fmt::format("no new range data for {:g} s", limit);
    case FailsafeKind::kEstimatorDiverged:
      return fmt::format("estimated depth {:.1f} m, measured {:.1f} m",
                         -situation.estimate.X_WB.p.z(), situation.sensors.depth_m);
    case FailsafeKind::kLocalisationLost:
      return fmt::format(
          "at ({:.1f}, {:.1f}, {:.1f}) {:.2f} m are left, and the position is uncertain by {:.2f} "
          "m: {:.1f} sigma, less than {:g}",
          situation.margin.place_W.x(), situation.margin.place_W.y(), situation.margin.place_W.z(),
          situation.margin.clearance_m, situation.margin.sigma_m, situation.margin.margin_sigma,
          limit);
    case FailsafeKind::kWrongMap:
      return fmt::format(
          "the scans of {:g} s show another place than the map: of the places in view, {} lack the "
          "surface that is mapped there, {} have one that is not mapped, and {} are as mapped",
          behaviors::MapEvidence::kSeconds, situation.map_agreement.missing,
          situation.map_agreement.unmapped, situation.map_agreement.confirmed);
    case FailsafeKind::kPlannerFailure:
      return situation.out_of_replans ? "no replans are left for this leg"
                                      : fmt::format("{} plans failed in a row, the last one: {}",
                                                    progress.plan_failures, progress.plan_failure);
    case FailsafeKind::kCommsLost:
      return fmt::format("no heartbeat from topside for {:g} s", limit);
    case FailsafeKind::kOperatorAbort:
      return situation.operator_abort;
    case FailsafeKind::kLogLost:
      return fmt::format("{} ticks of the log and {} commits of the journal are lost",
                         situation.loss.ticks, situation.loss.commits);
    case FailsafeKind::kRetraceFailure:
      return fmt::format("there is no exit path: {}", situation.retrace_failure);
    case FailsafeKind::kInternalError:
      return situation.internal_error;
  }
  return {};
}

}  // namespace dive::mission
