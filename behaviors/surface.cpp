#include "behaviors/surface.h"

#include <algorithm>
#include <cmath>

namespace dive::behaviors {
namespace {

constexpr double kKnownSigma = 0.3;     // m: a position that is known
constexpr double kAtRest = 0.12;        // m/s
constexpr double kPlaceRadius = 0.15;   // m from its place that are not worth a turn
constexpr double kPlaceGain = 0.5;      // m/s per m from its place
constexpr double kMaxPlaceSpeed = 0.2;  // m/s

}  // namespace

Surface::Surface(SurfaceOptions options)
    : options_(options), back_off_(options.clearance, options.back_off) {
  progress_.goal = "surface";
}

// Empty if there is clearance, or no path to a place with clearance.
std::optional<vehicle::Command> Surface::back_off(const BehaviorInput& input) {
  if (!input.depth_known || !input.attitude_known) may_back_off_ = false;
  if (!may_back_off_ || options_.clearance <= 0.0) return std::nullopt;
  if (!back_off_.is_under_way()) {
    BehaviorInput now = input;
    now.map_changed = input.observed != nullptr;  // measures the clearance at once
    may_back_off_ =
        back_off_.is_needed(now) &&
        back_off_.begin(now, {.max_distance_m = options_.back_off.max_distance_to_ascend_m,
                              .needs_open_water = true});
    if (!may_back_off_) return std::nullopt;
  }
  std::optional<vehicle::Command> command = back_off_.follow(input);
  may_back_off_ = command.has_value();  // only once
  return command;
}

void Surface::keep_place(const BehaviorInput& input, vehicle::Command& command) {
  const estimation::StateEstimate& estimate = *input.estimate;
  if (!input.attitude_known || !input.depth_known) return;
  if (estimation::horizontal_sigma(estimate) > kKnownSigma) return;
  const Eigen::Vector2d p_W = estimate.X_WB.p.head<2>();
  if (!place_W_) {
    // At rest, or whatever the estimate after some seconds.
    const double speed = (estimate.X_WB.q * estimate.v_WB_B).head<2>().norm();
    if (speed > kAtRest && to_seconds(input.now - *entered_at_) < vehicle::kComesToRest) return;
    place_W_ = p_W;
  }
  const Eigen::Vector2d back_W = *place_W_ - p_W;
  if (back_W.norm() < kPlaceRadius) return;
  const double bearing = std::atan2(back_W.y(), back_W.x());
  const double ahead = std::cos(wrap_angle(bearing - yaw_of(estimate.X_WB)));
  command.o = from_rpy(0.0, 0.0, bearing);
  command.v = std::clamp(kPlaceGain * ahead * back_W.norm(), 0.0, kMaxPlaceSpeed);
}

BehaviorOutput Surface::step(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const double depth = -X_WB.p.z();
  if (const std::optional<vehicle::Command> command = back_off(input)) {
    BehaviorOutput output;
    output.command = *command;
    progress_.distance_to_go_m = std::max(depth, 0.0);
    return output;
  }
  if (!entered_at_) {
    entered_at_ = input.now;
    entry_depth_ = depth;
  }
  const double yaw = drift_stop_.heading(X_WB.q, input.estimate->v_WB_B);
  const double risen = options_.ascent_rate * to_seconds(input.now - *entered_at_);
  BehaviorOutput output;
  output.command = station_keeping(std::max(entry_depth_ - risen, 0.0), yaw);
  output.done = depth < options_.surfaced_depth;
  if (!input.depth_known) {  // ascends for the expected time, whatever the estimate
    output.command = station_keeping(vehicle::kAboveSurface, yaw);
    output.done = to_seconds(input.now - *entered_at_) >
                  vehicle::blind_ascent_s(entry_depth_, options_.ascent_rate);
  }
  keep_place(input, output.command);
  progress_.distance_to_go_m = std::max(depth, 0.0);
  return output;
}

}  // namespace dive::behaviors
