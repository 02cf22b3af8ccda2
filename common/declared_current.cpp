#include "common/declared_current.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "common/se3.h"

namespace dive {
namespace {

constexpr double kRounding = 1e-9;  // relative

bool is_plausible(const DeclaredCurrent::Sample& sample) {
  return std::isfinite(sample.elapsed_s) && sample.velocity_W.allFinite() &&
         sample.velocity_W.norm() <= DeclaredCurrent::kMaxSpeed * (1.0 + kRounding);
}

}  // namespace

DeclaredCurrent::DeclaredCurrent(const Eigen::Vector2d& velocity_W) : samples_{{0.0, velocity_W}} {
  DIVE_DEMAND(is_plausible(samples_.front()));
}

DeclaredCurrent::DeclaredCurrent(std::vector<Sample> samples) : samples_(std::move(samples)) {
  DIVE_DEMAND(samples_.size() >= 2 && samples_.size() <= kMaxSamples);
  DIVE_DEMAND(std::ranges::all_of(samples_, is_plausible));
  const auto is_not_later = [](const Sample& a, const Sample& b) {
    return b.elapsed_s <= a.elapsed_s;
  };
  DIVE_DEMAND(std::ranges::adjacent_find(samples_, is_not_later) == samples_.end());
}

Eigen::Vector2d DeclaredCurrent::at(double elapsed_s) const {
  if (samples_.empty()) return Eigen::Vector2d::Zero();
  const auto after =
      std::ranges::upper_bound(samples_, elapsed_s, std::ranges::less{}, &Sample::elapsed_s);
  if (after == samples_.begin()) return samples_.front().velocity_W;
  if (after == samples_.end()) return samples_.back().velocity_W;
  const Sample& before = *(after - 1);
  const double share = (elapsed_s - before.elapsed_s) / (after->elapsed_s - before.elapsed_s);
  return before.velocity_W + share * (after->velocity_W - before.velocity_W);
}

bool DeclaredCurrent::covers(double from_s, double to_s) const {
  return samples_.size() < 2 ||
         (from_s >= samples_.front().elapsed_s && to_s <= samples_.back().elapsed_s);
}

DeclaredCurrent DeclaredCurrent::from(double elapsed_s) const {
  DeclaredCurrent result = *this;
  for (Sample& sample : result.samples_) sample.elapsed_s -= elapsed_s;
  return result;
}

bool DeclaredCurrent::is_still() const {
  return std::ranges::all_of(samples_,
                             [](const Sample& sample) { return sample.velocity_W.isZero(0.0); });
}

Eigen::Vector2d flow_towards(double speed, double towards_deg) {
  const double heading = deg_to_rad(towards_deg);
  return speed * Eigen::Vector2d(std::sin(heading), std::cos(heading));
}

}  // namespace dive
