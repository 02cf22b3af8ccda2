#include "mission/executive/localization.h"

#include <utility>

#include <fmt/format.h>

namespace dive::mission {

namespace {

constexpr double kLoopReport_s = 10.0;  // s after which a loop closure is reported again
constexpr double kLoopReport_m = 0.05;  // m: a correction of this size is reported at once

}  // namespace

Localization::Localization(EstimatorName estimator, const estimation::PrimitiveOptions& options,
                           const Eigen::Vector3d& position_W, double position_sigma_m)
    : uses_vision_(estimator == EstimatorName::kVisualInertial),
      odometry_(options, position_W, position_sigma_m),
      correction_({}, options) {}

void Localization::add(Utime now, const estimation::VisionEstimate& vision) {
  if (uses_vision_) correction_.propose(now, vision);
}

// When the prediction is no longer trusted, the vehicle is assumed to be at rest and upright.
void Localization::predict_attitude(Utime now, const vehicle::PredictedAttitude& attitude) {
  if (attitude.is_trusted()) {
    odometry_.predict_attitude(now, attitude.q_WB(), attitude.omega_B());
  } else {
    const double yaw = to_rpy(attitude.q_WB()).z();
    odometry_.predict_attitude(now, from_rpy(0.0, 0.0, yaw), Eigen::Vector3d::Zero());
  }
}

void Localization::expect(double speed, double heave) {
  odometry_.set_commanded_speed(speed);
  odometry_.set_expected_heave(heave);
}

void Localization::dead_reckon(const Eigen::Vector2d& by_W, double sigma_m, double surge) {
  odometry_.dead_reckon(by_W, sigma_m, surge);
}

const estimation::StateEstimate& Localization::update(Utime now) {
  const estimation::StateEstimate& published = correction_.update(odometry_.update(now));
  has_switched_ = published.source != source_;
  source_ = published.source;
  return published;
}

std::string Localization::describe_switch() const {
  return fmt::format("{}: {}", estimation::to_string(source_),
                     estimation::to_sentence(correction_.fault()));
}

std::optional<std::string> Localization::describe_loop(Utime now,
                                                       const estimation::ClosedLoops& loops) {
  if (!uses_vision_ || std::exchange(loops_closed_, loops.count) >= loops.count) return {};
  if (loop_reported_ && to_seconds(now - *loop_reported_) < kLoopReport_s &&
      loops.moved_m < kLoopReport_m) {
    return std::nullopt;
  }
  loop_reported_ = now;
  return fmt::format(
      "recognised the place of {:.0f} s before: corrected by {:.3f} m and {:.2f} deg",
      to_seconds(loops.recognised - loops.first_observed), loops.moved_m,
      rad_to_deg(loops.turned_rad));
}

std::optional<std::string> Localization::describe_tag(
    const estimation::TagObservation& observation) {
  const bool is_one = observation.id >= 0 && observation.id < Tag::kCodes;
  if (!uses_vision_ || !is_one || observation.result == estimation::TagResult::kNone)
    return std::nullopt;
  estimation::TagResult& reported = reported_tags_[static_cast<std::size_t>(observation.id)];
  if (std::exchange(reported, observation.result) == observation.result) return std::nullopt;
  return estimation::to_sentence(observation);
}

}  // namespace dive::mission
