#include "mission/executive/localization.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "estimation/planar.h"
#include "mission/executive/position_priors.h"

namespace dive::mission {

namespace {

constexpr double kLoopReport_s = 10.0;  // s after which a loop closure is reported again

// In a known map the fixes of the range camera correct the odometry.
estimation::FrameCorrectionOptions correction_options(const Mission& mission,
                                                      const MotionModel& motion) {
  estimation::FrameCorrectionOptions options;
  if (uses_map_fixes(mission)) options.fixes = map_fix_options(mission, motion);
  return options;
}

constexpr double kMaxHeightSigma = 0.1;  // m: a less certain height is not used
constexpr double kLoopReport_m = 0.05;   // m: a correction of this size is reported at once

}  // namespace

Localization::Localization(const Mission& mission, const MotionModel& motion,
                           const Eigen::Vector3d& position_W, double position_sigma_m)
    : uses_vision_(uses_visual_inertial(mission)),
      uses_fixes_(uses_map_fixes(mission)),
      map_variance_(mission.priors.map_m * mission.priors.map_m),
      odometry_(odometry_options(mission, {.motion = motion}), position_W, position_sigma_m),
      correction_(correction_options(mission, motion), {.motion = motion}) {}

std::optional<std::string> Localization::propose(const MapFix& fix, bool depth_is_fresh) {
  if (!uses_fixes_) return std::nullopt;
  if (!depth_is_fresh && fix.height_sigma_m > 0.0 && fix.height_sigma_m <= kMaxHeightSigma) {
    odometry_.add(DepthSample{fix.scan_utime, -fix.height_W});
  }
  const MapFixProblem before = std::exchange(fix_problem_, fix.problem);
  const bool is_used = correction_.propose(fix);
  if (fix.problem == before) return std::nullopt;
  if (is_used) return "map fixes again";
  switch (fix.problem) {
    case MapFixProblem::kNone:
      return std::nullopt;
    case MapFixProblem::kFewPoints:
      return fmt::format("no map fix: {} points of the scan lie on the map, {} do not", fix.used,
                         fix.gated);
    case MapFixProblem::kAmbiguous:
      return fmt::format("no map fix: another place fits the scan {:.0f} % as well",
                         100.0 * fix.ambiguity);
    case MapFixProblem::kNoScan:
      return "no map fix: the range camera repeats its scan, or sends no ranges";
  }
  return std::nullopt;
}

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

void Localization::expect(const vehicle::PseudoRates& efforts, double heave) {
  odometry_.set_efforts(efforts.surge, efforts.heave);
  odometry_.set_expected_heave(heave);
}

void Localization::expect_current(const Eigen::Vector2d& current_W) {
  odometry_.set_current(current_W);
  correction_.set_current(current_W);
}

void Localization::expect_stop(double heave) {
  odometry_.set_commanded_speed(0.0);
  odometry_.set_expected_heave(heave);
}

Eigen::Vector3d Localization::v_B() const {
  const estimation::UnmodelledMotion unmodelled = correction_.unmodelled();
  const Eigen::Vector3d slip_B =
      correction_.estimate().X_WB.q.conjugate() * estimation::lifted(unmodelled.slip_W);
  return odometry_.v_B() + unmodelled.speed_scale * odometry_.by_scale_B() + slip_B;
}

void Localization::dead_reckon(const Eigen::Vector2d& by_W, double sigma_m, double surge) {
  odometry_.dead_reckon(by_W, sigma_m, surge);
}

Eigen::Matrix2d Localization::covariance_among_obstacles() const {
  if (const auto covariance = correction_.covariance_among_obstacles()) return *covariance;
  return correction_.estimate().covariance.topLeftCorner<2, 2>() +
         map_variance_ * Eigen::Matrix2d::Identity();
}

const estimation::StateEstimate& Localization::update(Utime now) {
  const estimation::StateEstimate& published =
      correction_.update(odometry_.update(now), odometry_.errors());
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
