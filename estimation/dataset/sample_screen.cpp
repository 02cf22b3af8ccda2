#include "estimation/dataset/sample_screen.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

constexpr double kMaxRemovedShare = 0.05;
constexpr double kMinMedianForce = 5.0;  // m/s^2; gravity is 9.8, in any attitude
constexpr double kMaxMedianForce = 20.0;

// The greatest value of three would hide a NaN.
std::string problem(const ImuSample& sample) {
  if (!sample.gyro_B.allFinite()) return "an angular rate that is not finite";
  if (!sample.accel_B.allFinite()) return "a specific force that is not finite";
  const double rate = sample.gyro_B.cwiseAbs().maxCoeff();
  if (rate > kMaxRate) {
    return fmt::format("an angular rate of {:g} rad/s; no IMU measures more than {:g}", rate,
                       kMaxRate);
  }
  const double force = sample.accel_B.cwiseAbs().maxCoeff();
  if (force > kMaxAcceleration) {
    return fmt::format("a specific force of {:g} m/s^2; no IMU measures more than {:g}", force,
                       kMaxAcceleration);
  }
  return {};
}

std::string problem(const DepthSample& sample) {
  if (!std::isfinite(sample.depth_m)) return "a depth that is not finite";
  if (std::abs(sample.depth_m) <= kMaxDepth_m) return {};
  return fmt::format("a depth of {:g} m; the sea is at most {:g} m deep", sample.depth_m,
                     kMaxDepth_m);
}

std::string problem(const VelocitySample& sample) {
  if (!sample.v_B.allFinite()) return "a velocity that is not finite";
  const double speed = sample.v_B.cwiseAbs().maxCoeff();
  if (speed <= kMaxVelocity) return {};
  return fmt::format("a velocity of {:g} m/s; at most {:g} are expected", speed, kMaxVelocity);
}

std::string problem(const TruePose& pose) {
  if (!pose.X_WB.p.allFinite()) return "a true position that is not finite";
  if (!is_attitude(pose.X_WB.q)) return "a true attitude whose quaternion is not of length 1";
  const double distance = pose.X_WB.p.cwiseAbs().maxCoeff();
  if (distance > kMaxTrueDistance_m) {
    return fmt::format("a true position {:g} m from the origin; at most {:g} m are expected",
                       distance, kMaxTrueDistance_m);
  }
  if (pose.v_W && !pose.v_W->allFinite()) return "a true velocity that is not finite";
  if (pose.v_W && pose.v_W->cwiseAbs().maxCoeff() > kMaxTrueDistance_m) {
    return fmt::format("a true velocity of {:g} m/s", pose.v_W->cwiseAbs().maxCoeff());
  }
  if (pose.bias && !(pose.bias->gyro.allFinite() && pose.bias->accel.allFinite())) {
    return "a true bias that is not finite";
  }
  return {};
}

// Removes samples with a problem; warns of them at the first, and returns their number.
template <typename Sample>
std::size_t remove_wrong(std::vector<Sample>& samples, SampleOrigin& origin, const char* code,
                         Diagnostics& diagnostics) {
  std::size_t kept = 0;
  std::optional<Diagnostic> warning;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (const std::string wrong = problem(samples[i]); !wrong.empty()) {
      if (!warning) warning = origin.at(i, Severity::kWarning, code, wrong, "");
      continue;
    }
    samples[kept] = samples[i];
    if (i < origin.lines.size()) origin.lines[kept] = origin.lines[i];
    ++kept;
  }
  const std::size_t removed = samples.size() - kept;
  origin.refused = removed;
  if (!warning) return 0;
  warning->message += removed == 1
                          ? "; the sample is refused"
                          : fmt::format("; it and {} more such samples are refused", removed - 1);
  diagnostics.add(std::move(*warning));
  samples.resize(kept);
  origin.lines.resize(std::min(kept, origin.lines.size()));
  return removed;
}

// Adds an error if the unit of the specific force cannot be m/s^2.
void check_force(const Recording& recording, Diagnostics& diagnostics) {
  std::vector<double> forces;
  forces.reserve(recording.imu.size());
  for (const ImuSample& sample : recording.imu) forces.push_back(sample.accel_B.norm());
  if (forces.empty()) return;
  const auto middle = forces.begin() + static_cast<std::ptrdiff_t>(forces.size() / 2);
  std::nth_element(forces.begin(), middle, forces.end());
  if (*middle >= kMinMedianForce && *middle <= kMaxMedianForce) return;
  diagnostics.add(recording.imu_origin.of_all(
      Severity::kError, "IMU-UNIT",
      fmt::format("the median specific force is {:.3g} m/s^2, and gravity is 9.8", *middle),
      "give the specific force in m/s^2, gravity included"));
}

}  // namespace

bool is_attitude(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1.0) <= 1e-2; }

void screen_samples(Recording& recording) {
  Diagnostics& diagnostics = recording.diagnostics;
  const std::size_t samples = recording.imu.size();
  const std::size_t removed =
      remove_wrong(recording.imu, recording.imu_origin, "IMU-RANGE", diagnostics);
  if (static_cast<double>(removed) > kMaxRemovedShare * static_cast<double>(samples)) {
    diagnostics.add(recording.imu_origin.of_all(
        Severity::kError, "IMU-RANGE",
        fmt::format("{} of {} samples are not what an IMU measures", removed, samples),
        "give angular rates in rad/s and specific forces in m/s^2"));
  }
  check_force(recording, diagnostics);
  remove_wrong(recording.depth, recording.depth_origin, "DEPTH-RANGE", diagnostics);
  remove_wrong(recording.velocity, recording.velocity_origin, "VELOCITY-RANGE", diagnostics);
  remove_wrong(recording.truth, recording.truth_origin, "TRUTH-RANGE", diagnostics);
}

}  // namespace dive::estimation
