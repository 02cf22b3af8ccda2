#include "bench/track_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <fmt/format.h>

#include "bench/quantile.h"

namespace dive::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFar = 60.0;
constexpr std::array<int, 8> kAges{1, 2, 4, 8, 16, 32, 64, 128};
constexpr std::array<double, 6> kDepths{0.0, 1.0, 2.0, 3.0, 5.0, 10.0};

// Standard deviation of a normal variable, by its median.
double robust_sigma(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return quantile(std::move(values), 0.5) / 0.6745;
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

double share_above(const std::vector<double>& values, double limit) {
  const auto count = std::count_if(values.begin(), values.end(),
                                   [&](double value) { return std::abs(value) > limit; });
  return values.empty() ? 0.0
                        : 100.0 * static_cast<double>(count) / static_cast<double>(values.size());
}

void print_errors(const std::vector<double>& errors) {
  fmt::print("sigma by the median {:.3f}, RMS {:.3f} px, beyond 3 px {:.1f} %, {} values\n",
             robust_sigma(errors), rms(errors), share_above(errors, 3.0), errors.size());
}

}  // namespace

TrackTruth::TrackTruth(const planning::World& world, const CameraModel& left,
                       const CameraModel& right)
    : world_(world), left_(left), right_(right) {}

TrackTruth::Observation TrackTruth::first_observation(const Vector2d& n, const Pose& X_WC) const {
  const Vector3d d = (X_WC.q * n.homogeneous()).normalized();
  const double range = world_.range(X_WC.p, d, 0.05, kFar);
  const Vector3d p_W = X_WC.p + range * d;
  // The water's surface is not a landmark.
  if (!std::isfinite(range) || p_W.z() > -0.01) return {};
  return {true, p_W, images_};
}

void TrackTruth::add(const estimation::FeatureFrame& frame, const Pose& X_WB) {
  ++images_;
  const Pose X_WL = X_WB * left_.X_BC;
  const Pose X_WR = X_WB * right_.X_BC;
  std::map<std::int64_t, std::vector<Vector2d>> now;
  for (const estimation::FeatureObservation& feature : frame.features) {
    auto [it, is_new] = seen_.try_emplace(feature.id);
    if (is_new) {
      it->second = first_observation(feature.left, X_WL);
      ++tracks_;
      solid_ += it->second.is_solid ? 1 : 0;
    }
    if (feature.right) {
      const Observation here = first_observation(feature.left, X_WL);
      const Vector3d c = X_WR.inverse() * here.p_W;
      if (here.is_solid && c.z() > 0.05) {
        stereo_.push_back(
            {(X_WL.inverse() * here.p_W).z(),
             right_.jacobian(*feature.right) * (*feature.right - Vector2d(c.hnormalized()))});
      }
    }
    if (!it->second.is_solid) continue;
    const Vector3d c = X_WL.inverse() * it->second.p_W;
    if (c.z() < 0.05) continue;
    const Vector2d error =
        left_.jacobian(feature.left) * (feature.left - Vector2d(c.hnormalized()));
    std::vector<Vector2d>& history = now[feature.id];
    if (const auto before = now_.find(feature.id); before != now_.end()) {
      history = std::move(before->second);
    }
    history.push_back(error);
    for (const int age : kAges) {
      if (images_ - it->second.first == age) {
        by_age_[age].insert(by_age_[age].end(), {error.x(), error.y()});
      }
      if (history.size() <= static_cast<std::size_t>(age)) continue;
      const Vector2d step = error - history[history.size() - 1 - static_cast<std::size_t>(age)];
      steps_[age].insert(steps_[age].end(), {step.x(), step.y()});
    }
  }
  now_ = std::move(now);
}

estimation::FeatureFrame TrackTruth::moved_to_truth(const estimation::FeatureFrame& frame,
                                                    const Pose& X_WB, double sigma,
                                                    Random& random) const {
  estimation::FeatureFrame moved;
  moved.utime = frame.utime;
  const auto in = [&](const CameraModel& camera, const Vector3d& p_W) {
    const Vector3d c = (X_WB * camera.X_BC).inverse() * p_W;
    const double x = random.normal();
    const double y = random.normal();
    const Vector2d n = c.hnormalized();
    return Vector2d(n + sigma * camera.jacobian(n).inverse() * Vector2d(x, y));
  };
  for (const estimation::FeatureObservation& feature : frame.features) {
    const auto it = seen_.find(feature.id);
    if (it == seen_.end() || !it->second.is_solid) continue;
    estimation::FeatureObservation at{feature.id, in(left_, it->second.p_W), std::nullopt};
    if (feature.right) at.right = in(right_, it->second.p_W);
    moved.features.push_back(at);
  }
  return moved;
}

void TrackTruth::print() const {
  fmt::print("  {} tracks, {:.1f} % of them of something solid\n", tracks_,
             100.0 * static_cast<double>(solid_) /
                 static_cast<double>(std::max<std::int64_t>(1, tracks_)));
  for (const auto& [age, errors] : by_age_) {
    fmt::print("  {:3} images after the first observation: ", age);
    print_errors(errors);
  }
  for (const auto& [age, errors] : steps_) {
    fmt::print("  how the error changes over {:3} images: ", age);
    print_errors(errors);
  }
  print_stereo();
}

void TrackTruth::print_stereo() const {
  for (std::size_t i = 0; i < kDepths.size(); ++i) {
    const double far = i + 1 < kDepths.size() ? kDepths[i + 1] : kFar;
    std::vector<double> along, across;
    for (const StereoError& match : stereo_) {
      if (match.depth < kDepths[i] || match.depth >= far) continue;
      along.push_back(match.error.x());
      across.push_back(match.error.y());
    }
    if (along.empty()) continue;
    const double bias_x = quantile(along, 0.5);
    const double bias_y = quantile(across, 0.5);
    fmt::print("  right of left, {:g} to {:g} m, bias {:.3f} {:.3f} px: along ", kDepths[i], far,
               bias_x, bias_y);
    print_errors(along);
    fmt::print("    across: ");
    print_errors(across);
  }
}

}  // namespace dive::bench
