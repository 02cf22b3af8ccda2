#include "mission/fit/recorded_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/se3.h"
#include "estimation/motion_fit/driven_motion.h"
#include "estimation/planar.h"
#include "mission/record/log.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMinMapFixes = 10;  // fewer are chance; then cameras are used
constexpr Utime kVisionPeriod = 500'000;  // us between two of their poses that count
constexpr double kVisionSigma = 0.02;     // m, of their motion over a window
constexpr double kVisionHeading_deg = 1.0;
constexpr double kMaxStep_s = 1.0;     // s between two of their poses of one motion
constexpr Utime kMaxImuAge = 100'000;  // us
constexpr double kMinEffort = 1e-3;

/// True if a correction lies between the two estimates.
bool is_corrected(const estimation::VisionEstimate& before, const estimation::VisionEstimate& now) {
  return now.loops.count != before.loops.count || now.init_utime != before.init_utime ||
         now.tag.result == estimation::TagResult::kUsed;
}

bool has_efforts(const estimation::MotionRecord& motion) {
  return std::ranges::any_of(motion.ticks, [](const estimation::MotionTick& tick) {
    return tick.efforts.cwiseAbs().maxCoeff() > kMinEffort;
  });
}

// What a dive lacks to be of use; empty if nothing.
std::string shortcoming(const estimation::MotionRecord& motion) {
  if (motion.ticks.empty()) return "the log has no tick: give the log of a dive";
  if (!has_efforts(motion)) {
    return "the log has no efforts of the flippers: give a dive in which the vehicle swam under "
           "the executive's commands";
  }
  if (motion.fixes.empty()) {
    return "the log has no fixes: dive in a known map with the range camera (without "
           "fixes=\"off\"), or with estimator=\"visual_inertial\"";
  }
  const estimation::WindowOptions windows;
  if (estimation::usable_windows(motion, windows) > 0) return {};
  return fmt::format(
      "the log is too short: it has no {:g} s under water with attitude, depth and at least {} "
      "fixes; dive longer in view of what the map contains",
      windows.length_s, windows.min_fixes);
}

}  // namespace

void MotionCollector::add(const StepInputs& inputs, const StepOutputs& outputs) {
  record_.ticks.push_back(
      {inputs.now, inputs.imu, inputs.depth, {outputs.rates.surge, outputs.rates.heave}});
  if (inputs.imu) imu_ = inputs.imu;
  if (inputs.map_fix && inputs.map_fix->problem == MapFixProblem::kNone) {
    record_.fixes.push_back(*inputs.map_fix);
  }
  if (inputs.vision && inputs.vision->is_good()) add_vision(*inputs.vision);
}

void MotionCollector::add_vision(const estimation::VisionEstimate& vision) {
  const estimation::StateEstimate& now = vision.estimate;
  if (vision_ && is_corrected(*vision_, vision)) {
    const estimation::StateEstimate& before = vision_->estimate;
    const double dt = to_seconds(now.utime - before.utime);
    const Eigen::Vector3d expected = before.X_WB.p + (before.X_WB.q * before.v_WB_B) * dt;
    if (dt < kMaxStep_s) steps_W_ += (now.X_WB.p - expected).head<2>();
  }
  vision_ = vision;
  const bool is_due =
      vision_fixes_.empty() || now.utime - vision_fixes_.back().scan_utime >= kVisionPeriod;
  if (!is_due || !imu_ || std::abs(now.utime - imu_->utime) > kMaxImuAge) return;
  const Eigen::Quaterniond compass =
      imu_->q_WB * so3_exp(to_seconds(now.utime - imu_->utime) * imu_->gyro_B);
  MapFix fix;
  fix.scan_utime = now.utime;
  fix.position_W = now.X_WB.p.head<2>() - steps_W_;
  fix.heading_correction = estimation::turn_between(now.X_WB.q, compass);
  fix.information.diagonal() << 1.0 / (kVisionSigma * kVisionSigma),
      1.0 / (kVisionSigma * kVisionSigma), std::pow(deg_to_rad(kVisionHeading_deg), -2);
  vision_fixes_.push_back(fix);
}

estimation::MotionRecord MotionCollector::take() {
  if (record_.fixes.size() < kMinMapFixes) record_.fixes = std::move(vision_fixes_);
  std::ranges::sort(record_.fixes, {}, &MapFix::scan_utime);
  return std::move(record_);
}

tl::expected<RecordedMotion, NoMotion> read_motion(const std::string& log_path) {
  tl::expected<LogReader, std::string> log = LogReader::open(log_path);
  if (!log) return tl::unexpected(NoMotion{log.error()});
  if (!log->header()) {
    return tl::unexpected(NoMotion{fmt::format(
        "{}: the header of the log is damaged: the vehicle is not known; leave this log out",
        log_path)});
  }
  RecordedMotion result;
  result.vehicle = SourceText(log_path + " (vehicle)", log->header()->vehicle_urdf);
  MotionCollector collector(log_path);
  while (const std::optional<LoggedTick> tick = log->next()) {
    collector.add(tick->inputs, tick->outputs);
  }
  result.motion = collector.take();
  const std::string problem = shortcoming(result.motion);
  if (!problem.empty()) {
    return tl::unexpected(NoMotion{fmt::format("{}: {}", log_path, problem), true});
  }
  return result;
}

}  // namespace dive::mission
