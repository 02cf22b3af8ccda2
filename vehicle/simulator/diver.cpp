#include "vehicle/simulator/diver.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"

namespace dive::vehicle {
namespace {

// Steps are this short, so that no move passes a vehicle undetected.
constexpr Utime kStep = 20'000;

bool within(double value, double low, double high) {
  return value >= low && value <= high;  // false for NaN
}

// Distance from the vehicle to the skin of the capsule.
double gap(const Pose& X_WD, const Eigen::Vector3d& vehicle_W) {
  Eigen::Vector3d p_D = X_WD.inverse() * vehicle_W;
  p_D.x() -= std::clamp(p_D.x(), -0.5 * Diver::kLength, 0.5 * Diver::kLength);
  return p_D.norm() - Diver::kRadius;
}

}  // namespace

std::string DiverTrack::validate() const {
  constexpr double kFar = 1e5;
  constexpr double kLong = 1e6;
  if (waypoints.empty()) return "a diver needs a waypoint";
  for (const auto& [p_W, pause] : waypoints) {
    if (!within(p_W.x(), -kFar, kFar) || !within(p_W.y(), -kFar, kFar) ||
        !within(p_W.z(), -kFar, 0.0)) {
      return fmt::format("a diver's waypoint is {}, {}, {} but must be under water, within {} m",
                         p_W.x(), p_W.y(), p_W.z(), kFar);
    }
    if (!within(pause, 0.0, kLong)) {
      return fmt::format("a diver's pause is {} s but must be from 0 to {}", pause, kLong);
    }
  }
  if (!within(speed, 0.01, 3.0)) {
    return fmt::format("a diver's speed is {} m/s but must be from 0.01 to 3", speed);
  }
  if (!within(start_s, 0.0, kLong)) {
    return fmt::format("a diver's start is {} s but must be from 0 to {}", start_s, kLong);
  }
  if (!within(keeps_m, 0.0, 100.0)) {
    return fmt::format("a diver keeps {} m away but must keep from 0 to 100", keeps_m);
  }
  return {};
}

Diver::Diver(DiverTrack track) : track_(std::move(track)) {
  DIVE_DEMAND(track_.validate().empty());
  utime_ = from_seconds(track_.start_s);
  now_.X_WD.p = track_.waypoints.front().p_W;
  now_.pause_s = track_.waypoints.front().pause_s;
  face(now_);
}

void Diver::face(Progress& progress) const {
  if (progress.next >= track_.waypoints.size()) return;
  const Eigen::Vector3d to_goal = track_.waypoints[progress.next].p_W - progress.X_WD.p;
  constexpr double kUpright = 1e-6;  // m: too short to define a heading
  if (std::hypot(to_goal.x(), to_goal.y()) < kUpright) return;
  progress.X_WD.q = from_rpy(0.0, 0.0, std::atan2(to_goal.y(), to_goal.x()));
}

Diver::Progress Diver::after(double dt) const {
  Progress progress = now_;
  while (dt > 0.0) {
    if (progress.pause_s > 0.0) {
      const double paused = std::min(dt, progress.pause_s);
      progress.pause_s -= paused;
      dt -= paused;
      continue;
    }
    if (progress.next >= track_.waypoints.size()) break;
    face(progress);
    const auto& [goal, pause] = track_.waypoints[progress.next];
    const Eigen::Vector3d to_goal = goal - progress.X_WD.p;
    const double left = to_goal.norm();
    if (left > track_.speed * dt) {
      progress.X_WD.p += to_goal * (track_.speed * dt / left);
      break;
    }
    progress.X_WD.p = goal;
    progress.pause_s = pause;
    ++progress.next;
    dt -= left / track_.speed;
  }
  return progress;
}

void Diver::advance(Utime now, const Eigen::Vector3d& vehicle_W) {
  DIVE_DEMAND(vehicle_W.allFinite());
  while (utime_ < now) {
    const Utime dt = std::min(kStep, now - utime_);
    utime_ += dt;
    const Progress next = after(to_seconds(dt));
    const double next_gap = gap(next.X_WD, vehicle_W);
    if (next_gap >= std::min(track_.keeps_m, gap(now_.X_WD, vehicle_W))) now_ = next;
  }
}

planning::Obstacle Diver::shape() {
  const Pose X_DO{Eigen::Vector3d::Zero(), from_rpy(0.0, 0.5 * std::numbers::pi, 0.0)};
  return {"diver", planning::Capsule{kRadius, kLength}, X_DO};
}

}  // namespace dive::vehicle
