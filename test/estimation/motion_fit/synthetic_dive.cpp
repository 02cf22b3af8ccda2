#include "test/estimation/motion_fit/synthetic_dive.h"

#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "common/random.h"

namespace dive::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTick = 0.02;
constexpr int kSubsteps = 10;

/// A sum of sines with random periods of 4 to 20 s.
class Wave {
 public:
  Wave(Random& random, double size) : size_(size) {
    for (auto& [rate, phase] : parts_) {
      rate = 2.0 * M_PI / random.uniform(4.0, 20.0);
      phase = random.uniform(0.0, 2.0 * M_PI);
    }
  }
  [[nodiscard]] double at(double t) const {
    double sum = 0.0;
    for (const auto& [rate, phase] : parts_) sum += std::sin(rate * t + phase);
    return size_ * sum / 3.0;
  }

 private:
  double size_;
  std::array<std::pair<double, double>, 3> parts_{};
};

/// A level that jumps to a new one every few seconds.
class Steps {
 public:
  Steps(double low, double high) : low_(low), high_(high) {}
  double at(double t, Random& random) {
    if (t >= next_) {
      level_ = random.uniform(low_, high_);
      next_ = t + random.uniform(3.0, 9.0);
    }
    return level_;
  }

 private:
  double low_, high_;
  double level_ = 0.0;
  double next_ = 0.0;
};

struct State {
  Vector3d p = Vector3d(0.0, 0.0, -60.0);
  Quaterniond q = Quaterniond::Identity();
  Vector3d v = Vector3d::Zero();
  Vector2d thrust = Vector2d::Zero();  // efforts after the lag
};

struct Rate {
  Vector3d p;
  Eigen::Vector4d q;
  Vector3d v;
  Vector2d thrust;
};

Vector3d acceleration(const MotionModel& m, const State& s, const Vector3d& omega) {
  const Vector3d k = s.q.toRotationMatrix().transpose().col(2);
  // Momentum over the surge mass: Kirchhoff's equations in their own form.
  const Vector3d mass(1.0, 1.0 / m.sway_mass_ratio, 1.0 / m.heave_mass_ratio);
  const Vector3d momentum = mass.cwiseProduct(s.v);
  Vector3d force = momentum.cross(omega) + m.buoyancy * k;
  const double surge = s.thrust.x() * m.full_speed * m.full_speed;
  const double heave = s.thrust.y() * m.full_heave * m.full_heave;
  const double tail = s.v.x() < 0.0 ? -m.tail_m : m.tail_m;
  force.x() += mass.x() * (surge - std::abs(s.v.x()) * s.v.x()) / m.coast_m.x();
  force.y() -= mass.y() * (std::abs(s.v.y()) * s.v.y() / m.coast_m.y() +
                           std::abs(s.v.x()) * (s.v.y() - tail * omega.z()) / m.tail_lift_m.x());
  force.z() += mass.z() * ((heave - std::abs(s.v.z()) * s.v.z()) / m.coast_m.z() -
                           std::abs(s.v.x()) * (s.v.z() + tail * omega.y()) / m.tail_lift_m.y());
  return force.cwiseQuotient(mass);
}

Rate rate_of(const SyntheticDive& dive, const State& s, const Vector3d& omega,
             const Vector2d& efforts) {
  const Quaterniond turn(0.0, 0.5 * omega.x(), 0.5 * omega.y(), 0.5 * omega.z());
  const Vector3d current(dive.current_W.x(), dive.current_W.y(), 0.0);
  return {s.q * s.v + current, (s.q * turn).coeffs(), acceleration(dive.truth, s, omega),
          (efforts - s.thrust) / dive.truth.thrust_lag_s};
}

State moved(const State& s, const Rate& r, double h) {
  State next = s;
  next.p += h * r.p;
  next.q.coeffs() += h * r.q;
  next.q.normalize();
  next.v += h * r.v;
  next.thrust += h * r.thrust;
  return next;
}

template <class Omega>
State advance(const SyntheticDive& dive, const State& s, const Omega& omega, double t,
              const Vector2d& efforts, double h) {
  const Rate a = rate_of(dive, s, omega(t), efforts);
  const Rate b = rate_of(dive, moved(s, a, 0.5 * h), omega(t + 0.5 * h), efforts);
  const Rate c = rate_of(dive, moved(s, b, 0.5 * h), omega(t + 0.5 * h), efforts);
  const Rate d = rate_of(dive, moved(s, c, h), omega(t + h), efforts);
  const Rate mean{(a.p + 2.0 * b.p + 2.0 * c.p + d.p) / 6.0,
                  (a.q + 2.0 * b.q + 2.0 * c.q + d.q) / 6.0,
                  (a.v + 2.0 * b.v + 2.0 * c.v + d.v) / 6.0,
                  (a.thrust + 2.0 * b.thrust + 2.0 * c.thrust + d.thrust) / 6.0};
  return moved(s, mean, h);
}

MapFix fix_of(const SyntheticDive& dive, const State& s, Utime utime, Random& random) {
  constexpr double kHeadingSigma = 0.01;
  MapFix fix;
  fix.scan_utime = utime;
  fix.position_W = s.p.head<2>() + dive.fix_sigma_m * Vector2d(random.normal(), random.normal());
  fix.heading_correction = -dive.heading_bias + kHeadingSigma * random.normal();
  const double information = 1.0 / (dive.fix_sigma_m * dive.fix_sigma_m);
  fix.information.diagonal() << information, information, 1.0 / (kHeadingSigma * kHeadingSigma);
  return fix;
}

}  // namespace

estimation::MotionRecord record_of(const SyntheticDive& dive) {
  Random random(dive.seed, 0xf17);
  const std::array<Wave, 3> turns{Wave(random, dive.turning), Wave(random, dive.turning),
                                  Wave(random, dive.turning)};
  const auto omega = [&](double t) {
    return Vector3d(turns[0].at(t), turns[1].at(t), turns[2].at(t));
  };
  Steps surge(-0.1, 0.7);
  Steps heave(-dive.heave, dive.heave);
  State state;
  estimation::MotionRecord record;
  record.name = fmt::format("synthetic dive {}", dive.seed);
  const auto ticks = static_cast<int>(dive.duration_s / kTick);
  for (int i = 0; i <= ticks; ++i) {
    const double t = kTick * i;
    const Utime now = from_seconds(t);
    ImuSample imu;
    imu.utime = now;
    imu.q_WB = Eigen::AngleAxisd(dive.heading_bias, Vector3d::UnitZ()) * state.q;
    imu.gyro_B = omega(t) + Vector3d::Constant(dive.gyro_bias);
    const DepthSample depth{now, -state.p.z() + 0.01 * random.normal()};
    const Vector2d efforts(surge.at(t, random), heave.at(t, random));
    record.ticks.push_back({now, imu, depth, efforts});
    if (i % 25 == 10) record.fixes.push_back(fix_of(dive, state, now, random));
    for (int k = 0; k < kSubsteps; ++k) {
      const double h = kTick / kSubsteps;
      state = advance(dive, state, omega, t + k * h, efforts, h);
    }
  }
  return record;
}

}  // namespace dive::testing
