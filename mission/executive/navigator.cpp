#include "mission/executive/navigator.h"

#include <utility>

#include <fmt/format.h>

namespace dive::mission {

EstimatorName name_of(estimation::EstimatorKind kind) {
  return kind == estimation::EstimatorKind::kPrimitive ? EstimatorName::kPrimitive
                                                       : EstimatorName::kVisualInertial;
}

Navigator::Navigator(EstimatorName estimator, const estimation::PrimitiveOptions& options,
                     const Eigen::Vector3d& position_W, double position_sigma_m)
    : primitive_(options, position_W, position_sigma_m) {
  if (estimator == EstimatorName::kVisualInertial) {
    hand_over_.emplace(estimation::HandOverOptions{}, options);
  }
}

void Navigator::add(Utime now, const estimation::VisionEstimate& vision) {
  if (hand_over_) hand_over_->add(now, vision);
}

void Navigator::expect(double speed, double heave) {
  primitive_.set_commanded_speed(speed);
  primitive_.set_expected_heave(heave);
}

void Navigator::went_on(const Eigen::Vector2d& by_W, double sigma_m, double surge) {
  primitive_.went_on(by_W, sigma_m, surge);
}

void Navigator::moved(const Eigen::Vector2d& by_W) {
  if (hand_over_) {
    hand_over_->moved(by_W);
  } else {
    primitive_.moved(by_W);
  }
}

const estimation::StateEstimate& Navigator::update(Utime now) {
  const estimation::StateEstimate& primitive = primitive_.update(now);
  const estimation::StateEstimate& published =
      hand_over_ ? hand_over_->update(primitive) : primitive;
  has_switched_ = published.source != source_;
  source_ = published.source;
  return published;
}

std::string Navigator::describe_switch() const {
  if (!hand_over_) return {};
  return fmt::format("{}: {}", estimation::to_string(source_),
                     estimation::to_sentence(hand_over_->fault()));
}

std::optional<std::string> Navigator::describe_tag(const estimation::TagSight& sight) {
  const bool is_one = sight.id >= 0 && sight.id < Tag::kCodes;
  if (!hand_over_ || !is_one || sight.verdict == estimation::TagVerdict::kNone) return std::nullopt;
  estimation::TagVerdict& told = told_of_tags_[static_cast<std::size_t>(sight.id)];
  if (std::exchange(told, sight.verdict) == sight.verdict) return std::nullopt;
  return estimation::to_sentence(sight);
}

}  // namespace dive::mission
