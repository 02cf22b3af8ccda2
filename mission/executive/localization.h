#pragma once
// Localisation: the odometry, and the correction from it to the map. It publishes the only position
// of the vehicle, which all other code reads. Private to mission/executive.

#include <array>
#include <optional>
#include <string>

#include "common/tag.h"
#include "estimation/frame_correction.h"
#include "estimation/primitive.h"
#include "mission/document/mission.h"
#include "vehicle/command.h"
#include "vehicle/predicted_attitude.h"

namespace dive::mission {

class Localization {
 public:
  Localization(const Mission& mission, const MotionModel& motion, const Eigen::Vector3d& position_W,
               double position_sigma_m);

  void add(const ImuSample& sample) { odometry_.add(sample); }
  void add(const DepthSample& sample) { odometry_.add(sample); }
  /// Adds an estimate received at `now`. Ignored if the mission does not use vision.
  void add(Utime now, const estimation::VisionEstimate& vision);
  /// Called while the attitude sensor is silent.
  void predict_attitude(Utime now, const vehicle::PredictedAttitude& attitude);
  /// See PrimitiveEstimator.
  void expect(const vehicle::PseudoRates& efforts, double heave);
  /// The vehicle stops by itself: the efforts are unknown.
  void expect_stop(double heave);
  /// Sets the declared current of this tick, m/s: the mean of the estimators' current.
  void expect_current(const Eigen::Vector2d& current_W);
  void dead_reckon(const Eigen::Vector2d& by_W, double sigma_m, double surge);
  /// See FrameCorrection.
  void propose_alignment(const Eigen::Vector2d& by_W) { correction_.propose_alignment(by_W); }
  void move(const PlanarTransform& by) { correction_.move(by); }
  /// Proposes a fix; ignored if the mission uses none. Its height is used while depth samples are
  /// not fresh. Returns a message if fixes begin or cease to be used.
  [[nodiscard]] std::optional<std::string> propose(const MapFix& fix, bool depth_is_fresh);
  /// See FrameCorrection.
  [[nodiscard]] bool has_jumped() const { return correction_.has_jumped(); }

  /// Called once per tick. Allocates nothing.
  [[nodiscard]] const estimation::StateEstimate& update(Utime now);

  /// A message; empty if the status of that tag has not changed.
  [[nodiscard]] std::optional<std::string> describe_tag(
      const estimation::TagObservation& observation);

  /// Velocity through the water, in B, m/s: expected, and as fixes have corrected it.
  [[nodiscard]] Eigen::Vector3d v_B() const;
  [[nodiscard]] double surge() const { return v_B().x(); }

  /// Covariance of the horizontal position among the obstacles of the known map, m^2.
  [[nodiscard]] Eigen::Matrix2d covariance_among_obstacles() const;

  /// See FrameCorrection.
  [[nodiscard]] estimation::UnmodelledMotion unmodelled() const { return correction_.unmodelled(); }

  /// A message about a loop closure; empty if there is none, or none worth a report: along a known
  /// path every keyframe closes a loop.
  [[nodiscard]] std::optional<std::string> describe_loop(Utime now,
                                                         const estimation::ClosedLoops& loops);

  /// True if the last update() changed the active estimator.
  [[nodiscard]] bool has_switched() const { return has_switched_; }
  /// Reason of the change, for messages: "primitive: the images are blurred".
  [[nodiscard]] std::string describe_switch() const;

 private:
  bool uses_vision_;
  bool uses_fixes_;
  double map_variance_;  ///< Of the position of the known map, per axis, m^2.
  estimation::PrimitiveEstimator odometry_;
  estimation::FrameCorrection correction_;
  estimation::EstimatorKind source_ = estimation::EstimatorKind::kPrimitive;
  bool has_switched_ = false;
  MapFixProblem fix_problem_ = MapFixProblem::kNone;  ///< Reported last.
  int loops_closed_ = 0;
  std::optional<Utime> loop_reported_;  ///< us
  std::array<estimation::TagResult, Tag::kCodes> reported_tags_{};
};

}  // namespace dive::mission
