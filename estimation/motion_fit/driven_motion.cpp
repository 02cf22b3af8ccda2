#include "estimation/motion_fit/driven_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr double kMaxGap = 0.1;      // s between two ticks of a window
constexpr double kMaxTurn = 3.0;     // rad/s: a faster change of attitude is a correction
constexpr double kBinHeights = 0.2;  // s: short, because a mean is not where the path curves
constexpr double kMaxOpen = 1.0;     // m

std::vector<ImuSample> imu_samples(const MotionRecord& record) {
  std::vector<ImuSample> samples;
  for (const MotionTick& tick : record.ticks) {
    if (!tick.imu || (!samples.empty() && tick.imu->utime <= samples.back().utime)) continue;
    samples.push_back(*tick.imu);
  }
  return samples;
}

Vector3d turn_between(const ImuSample& a, const ImuSample& b) {
  return so3_log(a.q_WB.conjugate() * b.q_WB);
}

// Mean difference of the turn rate and that of the attitudes, which have no drift.
Vector3d gyro_bias(const std::vector<ImuSample>& samples) {
  Vector3d sum = Vector3d::Zero();
  double time = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const ImuSample& a = samples[i - 1];
    const ImuSample& b = samples[i];
    const double dt = to_seconds(b.utime - a.utime);
    if (dt > kMaxGap) continue;
    const Vector3d off = 0.5 * (a.gyro_B + b.gyro_B) - turn_between(a, b) / dt;
    if (off.cwiseAbs().maxCoeff() > kMaxTurn) continue;
    sum += dt * off;
    time += dt;
  }
  return time > 0.0 ? Vector3d(sum / time) : Vector3d::Zero();
}

std::vector<MeanHeight> heights_between(const MotionRecord& record, Utime from, Utime to) {
  std::vector<MeanHeight> heights;
  const Utime bin = from_seconds(kBinHeights);
  double sum_z = 0.0;
  double sum_t = 0.0;
  int count = 0;
  Utime end = from + bin;
  const auto close = [&] {
    if (count > 0) {
      heights.push_back({from + static_cast<Utime>(std::llround(sum_t / count)), sum_z / count});
    }
    sum_z = sum_t = 0.0;
    count = 0;
  };
  auto tick = std::lower_bound(record.ticks.begin(), record.ticks.end(), from,
                               [](const MotionTick& t, Utime utime) { return t.now < utime; });
  for (; tick != record.ticks.end() && tick->now <= to; ++tick) {
    if (!tick->depth || tick->depth->utime < from || tick->depth->utime > to) continue;
    while (tick->depth->utime >= end) {
      close();
      end += bin;
    }
    sum_z -= tick->depth->depth_m;
    sum_t += static_cast<double>(tick->depth->utime - from);
    ++count;
  }
  close();
  return heights;
}

bool is_usable(const MotionWindow& window, std::span<const DrivenTick> ticks,
               const WindowOptions& options) {
  if (window.fixes.size() < options.min_fixes || window.heights.size() < options.min_fixes) {
    return false;
  }
  const Utime length = ticks[window.last].utime - ticks[window.first].utime;
  const Utime shown = window.fixes.back().scan_utime - window.fixes.front().scan_utime;
  const bool is_deep = std::ranges::all_of(
      window.heights, [&](const MeanHeight& h) { return h.z < -options.min_depth_m; });
  return is_deep && 2 * shown >= length;
}

}  // namespace

std::optional<ShownPosition> shown_position(const MapFix& fix) {
  if (fix.problem != MapFixProblem::kNone) return std::nullopt;
  const Eigen::Matrix2d position = fix.information.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(position);
  const double least = eigen.eigenvalues().minCoeff();
  if (!(least > 1.0 / (kMaxOpen * kMaxOpen))) return std::nullopt;
  // At the heading of the linearisation: what heading and position share is second order there.
  const Eigen::Vector2d step =
      eigen.eigenvectors() * (eigen.eigenvectors().transpose() * fix.gradient.head<2>())
                                 .cwiseQuotient(eigen.eigenvalues());
  return ShownPosition{fix.position_W + step, fix.heading_correction, 1.0 / std::sqrt(least)};
}

std::vector<DrivenTick> driven_ticks(const MotionRecord& record) {
  const std::vector<ImuSample> samples = imu_samples(record);
  const Vector3d bias = gyro_bias(samples);
  std::vector<DrivenTick> ticks;
  std::size_t next = 0;  // the first sample after the middle of the interval
  for (std::size_t i = 1; i < record.ticks.size(); ++i) {
    const Utime from = record.ticks[i - 1].now;
    const Utime to = record.ticks[i].now;
    const Utime middle = from + (to - from) / 2;
    while (next < samples.size() && samples[next].utime <= middle) ++next;
    if (next == 0 || next == samples.size()) continue;
    const ImuSample& a = samples[next - 1];
    const ImuSample& b = samples[next];
    const double between = to_seconds(b.utime - a.utime);
    if (between > kMaxGap) continue;
    const double share = to_seconds(middle - a.utime) / between;
    DrivenTick& tick = ticks.emplace_back();
    tick.utime = to;
    tick.dt = to_seconds(to - (ticks.size() == 1 ? from : ticks[ticks.size() - 2].utime));
    tick.efforts = record.ticks[i - 1].efforts;
    tick.omega_B = a.gyro_B + share * (b.gyro_B - a.gyro_B) - bias;
    tick.q_WB = (a.q_WB * so3_exp(share * turn_between(a, b))).normalized();
  }
  return ticks;
}

std::vector<MotionWindow> windows_of(const MotionRecord& record, std::span<const DrivenTick> ticks,
                                     std::size_t dive, const WindowOptions& options) {
  std::vector<MotionWindow> windows;
  std::size_t first = 0;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    if (ticks[i].dt > kMaxGap) {
      first = i;
      continue;
    }
    if (to_seconds(ticks[i].utime - ticks[first].utime) < options.length_s) continue;
    MotionWindow window{dive, first, i, {}, {}};
    const Utime from = ticks[first].utime;
    const Utime to = ticks[i].utime;
    for (const MapFix& fix : record.fixes) {
      if (fix.scan_utime >= from && fix.scan_utime <= to) window.fixes.push_back(fix);
    }
    window.heights = heights_between(record, from, to);
    if (is_usable(window, ticks, options)) windows.push_back(std::move(window));
    first = i;
  }
  return windows;
}

int usable_windows(const MotionRecord& record, const WindowOptions& options) {
  const std::vector<DrivenTick> ticks = driven_ticks(record);
  return static_cast<int>(windows_of(record, ticks, 0, options).size());
}

}  // namespace dive::estimation
