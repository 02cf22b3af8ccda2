#include "estimation/motion_fit/open_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimation/planar.h"
#include "estimation/primitive.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxSigma = 0.1;                         // m, of a fix that counts
constexpr double kTolerance = 0.3;                        // s, of the time between two fixes
constexpr double kDriftHorizon = 10.0;                    // s over which the current is averaged
constexpr std::array<double, 2> kSlipHorizons{2.0, 8.0};  // s
constexpr double kMinWeight = 20.0;                       // of horizontal samples of an axis

/// The open-loop state at the time of a fix, and what the fix shows.
struct Compared {
  Utime utime = 0;
  Vector2d odometry = Vector2d::Zero();  ///< m
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  ShownPosition shown;
};

std::vector<Compared> compare(const MotionRecord& record, const MotionModel& model) {
  std::vector<Compared> result;
  PrimitiveEstimator estimator({.motion = model}, Vector3d::Zero(), 0.0);
  StateEstimate before;
  auto fix = record.fixes.begin();
  for (const MotionTick& tick : record.ticks) {
    if (tick.imu) estimator.add(*tick.imu);
    if (tick.depth) estimator.add(*tick.depth);
    const StateEstimate now = estimator.update(tick.now);
    estimator.set_efforts(tick.efforts.x(), tick.efforts.y());
    for (; fix != record.fixes.end() && fix->scan_utime <= tick.now; ++fix) {
      if (!before.valid || fix->scan_utime < before.utime) continue;
      const std::optional<ShownPosition> shown = shown_position(*fix);
      if (!shown || shown->sigma_m > kMaxSigma) continue;
      const double dt = std::max(to_seconds(now.utime - before.utime), 1e-6);
      const double share = to_seconds(fix->scan_utime - before.utime) / dt;
      const Vector3d p = before.X_WB.p + share * (now.X_WB.p - before.X_WB.p);
      result.push_back({fix->scan_utime, p.head<2>(), now.X_WB.q, *shown});
    }
    before = now;
  }
  return result;
}

/// An error of the motion between two fixes.
struct MotionError {
  Vector2d off_W = Vector2d::Zero();  ///< Open-loop motion less that between the fixes, m.
  double dt = 0.0;                    ///< s
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< In the middle.
};

std::vector<MotionError> errors_over(const std::vector<Compared>& compared, double horizon_s) {
  std::vector<MotionError> errors;
  for (std::size_t i = 0, j = 0; i < compared.size(); ++i) {
    const Utime due = compared[i].utime + from_seconds(horizon_s);
    while (j < compared.size() && compared[j].utime < due) ++j;
    if (j == compared.size()) break;
    const Compared& a = compared[i];
    const Compared& b = compared[j];
    if (to_seconds(b.utime - due) > kTolerance) continue;
    const double heading =
        0.5 * (a.shown.heading_correction + a.shown.heading_correction +
               wrap_angle(b.shown.heading_correction - a.shown.heading_correction));
    MotionError& error = errors.emplace_back();
    error.off_W =
        turned(heading) * (b.odometry - a.odometry) - (b.shown.position_W - a.shown.position_W);
    error.dt = to_seconds(b.utime - a.utime);
    error.q_WB = from_rpy(0.0, 0.0, heading) * compared[(i + j) / 2].q_WB;
  }
  return errors;
}

// Mean velocity of the error.
Vector2d current_in(const std::vector<Compared>& compared) {
  const std::vector<MotionError> errors = errors_over(compared, kDriftHorizon);
  Vector2d sum = Vector2d::Zero();
  for (const MotionError& error : errors) sum += error.off_W / error.dt;
  return errors.empty() ? sum : Vector2d(sum / static_cast<double>(errors.size()));
}

// Mean squares of the errors along the axes of B, m^2, over one horizon. An axis counts by how
// horizontal it is: along the vertical the depth sensor corrects the motion.
struct MeanSquares {
  Vector3d sums = Vector3d::Zero();
  Vector3d weights = Vector3d::Zero();

  void add(const MotionError& error, const Vector2d& current_W) {
    const Vector3d off_B = error.q_WB.conjugate() * lifted(error.off_W - current_W * error.dt);
    const Vector3d up_B = error.q_WB.conjugate() * Vector3d::UnitZ();
    const Vector3d horizontal = Vector3d::Ones() - up_B.cwiseAbs2();
    sums += horizontal.cwiseProduct(off_B.cwiseAbs2());
    weights += horizontal.cwiseAbs2();
  }
};

// Mean square of the way over t that a Gauss-Markov velocity of unit variance and correlation time
// T makes: t^2 2 (x - 1 + exp(-x)) / x^2, with x = t / T.
double growth(double t, double T) {
  const double x = t / T;
  return t * t * 2.0 * (x - 1.0 + std::exp(-x)) / (x * x);
}

}  // namespace

double OpenLoopError::quantile(double share) const {
  if (errors_m.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = errors_m;
  const auto at =
      static_cast<std::size_t>(std::lround(share * static_cast<double>(sorted.size() - 1)));
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(at));
  return sorted[at];
}

std::vector<OpenLoopError> open_loop_errors(std::span<const MotionRecord> records,
                                            const MotionModel& model,
                                            std::span<const double> horizons_s, Drift drift) {
  std::vector<OpenLoopError> result;
  for (const double horizon_s : horizons_s) result.push_back({horizon_s, {}});
  for (const MotionRecord& record : records) {
    const std::vector<Compared> compared = compare(record, model);
    const Vector2d current_W =
        drift == Drift::kIsCurrent ? current_in(compared) : Vector2d::Zero().eval();
    for (OpenLoopError& all : result) {
      for (const MotionError& error : errors_over(compared, all.horizon_s)) {
        all.errors_m.push_back((error.off_W - current_W * error.dt).norm());
      }
    }
  }
  return result;
}

std::array<std::optional<double>, 3> slip_sigmas(std::span<const MotionRecord> records,
                                                 const MotionModel& model) {
  std::array<MeanSquares, kSlipHorizons.size()> squares;
  for (const MotionRecord& record : records) {
    const std::vector<Compared> compared = compare(record, model);
    const Vector2d current_W = current_in(compared);
    for (std::size_t k = 0; k < squares.size(); ++k) {
      for (const MotionError& error : errors_over(compared, kSlipHorizons[k])) {
        squares[k].add(error, current_W);
      }
    }
  }
  const double grown =
      growth(kSlipHorizons[1], model.slip_time_s) - growth(kSlipHorizons[0], model.slip_time_s);
  std::array<std::optional<double>, 3> sigmas;
  for (int i = 0; i < 3; ++i) {
    if (squares[0].weights[i] < kMinWeight || squares[1].weights[i] < kMinWeight) continue;
    const double more =
        squares[1].sums[i] / squares[1].weights[i] - squares[0].sums[i] / squares[0].weights[i];
    sigmas[static_cast<std::size_t>(i)] = std::sqrt(std::max(more, 0.0) / grown);
  }
  return sigmas;
}

}  // namespace dive::estimation
