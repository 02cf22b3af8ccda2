#pragma once
// Where the vehicle is: the estimator that the mission asks for, or the two of them and who of them
// is believed. Private to mission/executive.

#include <array>
#include <optional>
#include <string>

#include "common/tag.h"
#include "estimation/hand_over.h"
#include "estimation/primitive.h"
#include "mission/document/guard.h"

namespace dive::mission {

class Navigator {
 public:
  Navigator(EstimatorName estimator, const estimation::PrimitiveOptions& options,
            const Eigen::Vector3d& position_W, double position_sigma_m);

  void add(const ImuSample& sample) { primitive_.add(sample); }
  void add(const DepthSample& sample) { primitive_.add(sample); }
  /// That has come at `now`; nothing in a mission that does not ask for it.
  void add(Utime now, const estimation::VisionEstimate& vision);
  /// As PrimitiveEstimator has them.
  void expect(double speed, double heave);
  void went_on(const Eigen::Vector2d& by_W, double sigma_m, double surge);
  void moved(const Eigen::Vector2d& by_W);

  /// Once a tick. Allocates nothing.
  [[nodiscard]] const estimation::StateEstimate& update(Utime now);

  /// For people, where it is not what was said of that tag before.
  [[nodiscard]] std::optional<std::string> describe_tag(const estimation::TagSight& sight);

  /// In the last update() another estimator has taken over.
  [[nodiscard]] bool has_switched() const { return has_switched_; }
  /// For people, why: "visual_inertial: the cameras see well".
  [[nodiscard]] std::string describe_switch() const;

 private:
  estimation::PrimitiveEstimator primitive_;
  std::optional<estimation::HandOver> hand_over_;
  estimation::EstimatorKind source_ = estimation::EstimatorKind::kPrimitive;
  bool has_switched_ = false;
  std::array<estimation::TagVerdict, Tag::kCodes> told_of_tags_{};
};

[[nodiscard]] EstimatorName name_of(estimation::EstimatorKind kind);

}  // namespace dive::mission
