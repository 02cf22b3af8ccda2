#include "vehicle/simulator/simulator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "common/random.h"
#include "vehicle/aqua2_figures.h"
#include "vehicle/simulator/dynamics/dynamics.h"
#include "vehicle/simulator/dynamics/flippers.h"
#include "vehicle/simulator/horizontal_draw.h"
#include "vehicle/simulator/sensors/sensors.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;

constexpr int kSubsteps = 2;  // per tick: the surface is stiff (5 rad/s), the rest is slower
constexpr double kSecondsPerHour = 3600.0;
constexpr std::uint64_t kSpeedStream = 0x59eed;
constexpr std::uint64_t kHullStream = 0x4011;
constexpr std::uint64_t kPlaceStream = 0x97ace;
constexpr std::uint64_t kWaterStream = 0x3a7e4;
// s: correlation time of the drawn part of the current. Eddies behind a headland or a hull take
// minutes, the tide hours.
constexpr double kCurrentTime = 600.0;

std::uint64_t vehicle_seed(const Conditions& conditions, std::uint64_t seed) {
  const auto hull_seed = static_cast<std::uint64_t>(conditions.hull_seed);
  return hull_seed == 0 ? seed : hull_seed;
}

// The figures of this vehicle: no two are alike, and none is the one that was measured.
Aqua2Figures drawn_figures(const Conditions& conditions, std::uint64_t seed) {
  Random random(vehicle_seed(conditions, seed), kHullStream);
  Aqua2Figures figures;
  const auto scatter = [&](double& figure) {
    figure *= std::clamp(1.0 + conditions.hull_scatter * random.normal(), 0.5, 1.5);
  };
  for (double& mass : figures.added_mass) scatter(mass);
  for (double& drag : figures.body_drag) scatter(drag);
  scatter(figures.flipper_drag);
  scatter(figures.thrust_coefficient);
  scatter(figures.tail_lift);
  scatter(figures.metacentric_height);
  figures.spare_buoyancy_kg += conditions.buoyancy_sigma_n * random.normal() / kGravity;
  return figures;
}

}  // namespace

struct Simulator::Impl {
  Impl(const Model& model, const Pose& start_X_WB, Conditions conditions_in, std::uint64_t seed)
      : figures(drawn_figures(conditions_in, seed)),
        conditions(std::move(conditions_in)),
        dynamics(model, figures),
        flippers(model.hips_B, figures),
        sensors(conditions, seed, kTick),
        undeclared_W(conditions.current_W),
        water(seed, kWaterStream) {
    Random random(vehicle_seed(conditions, seed), kSpeedStream);
    flippers.set_speed_scale(std::max(0.0, 1.0 + conditions.speed_scale_sigma * random.normal()));
    Random place(seed, kPlaceStream);
    const Vector3d off_W = horizontal_draw(place, conditions.start_sigma_m);
    drawn_W = horizontal_draw(place, conditions.current_sigma);
    current_W = declared_at(0) + undeclared_W + drawn_W;
    state.X_WB = Pose{start_X_WB.p + off_W, start_X_WB.q.normalized()};
    state.v.setZero();  // released in the water, which carries it
    truth.X_WB = state.X_WB;
    truth.v_WB_B = state.X_WB.q.conjugate() * velocity_W();
  }

  SensorSamples step(const PseudoRates& rates) {
    flippers.command(rates);
    const Vector3d p_before = state.X_WB.p;
    const Vector3d v_before_W = velocity_W();
    for (int i = 0; i < kSubsteps; ++i) {
      flippers.advance(kTick / kSubsteps);
      const Dynamics::State before = state;
      dynamics.advance(state, flippers.forces(), current_W, kTick / kSubsteps);
      if (conditions.inertial_unit) sample_imu(before, i);
    }
    DIVE_DEMAND(state.X_WB.is_finite() && state.v.allFinite() && state.omega.allFinite());
    truth.utime += from_seconds(kTick);
    vary_current();
    truth.X_WB = state.X_WB;
    truth.v_WB_B = state.X_WB.q.conjugate() * velocity_W();
    truth.omega_WB_B = state.omega;
    truth.distance_swum_m += (state.X_WB.p - p_before).norm();
    truth.energy_used_wh += (figures.hotel_load_w + flippers.power()) * kTick / kSecondsPerHour;

    const Vector3d acceleration_W = (velocity_W() - v_before_W) / kTick;
    const Vector3d specific_force_B =
        state.X_WB.q.conjugate() * (acceleration_W + kGravity * Vector3d::UnitZ());
    if (conditions.inertial_unit) {
      truth.gyro_bias_B = sensors.inertial_unit()->gyro_bias();
      truth.accel_bias_B = sensors.inertial_unit()->accel_bias();
    }
    return sensors.sample(truth, specific_force_B, health());
  }

  // Feeds the IMU for a finished substep that began at `before`. The flippers' forces are constant
  // within it, so that its midpoint is a shorter step of the same motion; at its end they jump, and
  // the sample uses the mean.
  void sample_imu(const Dynamics::State& before, int substep) {
    constexpr double kStep = kTick / kSubsteps;
    static_assert(InertialSamples::kPerTick == 2 * kSubsteps);
    Dynamics::State middle = before;
    dynamics.advance(middle, flippers.forces(), current_W, 0.5 * kStep);
    feel_at(middle, flippers.forces(), truth.utime + from_seconds((substep + 0.5) * kStep));
    Flippers next = flippers;
    next.advance(kStep);
    feel_at(state, 0.5 * (flippers.forces() + next.forces()),
            truth.utime + from_seconds((substep + 1) * kStep));
  }

  // The current is uniform and all but steady: the acceleration of B's origin is that through the
  // water.
  void feel_at(const Dynamics::State& at, const FlipperForces& forces, Utime utime) {
    const Vector3d rate = dynamics.acceleration(at, forces).head<3>();
    const Vector3d specific_force_B =
        rate + at.omega.cross(at.v) + at.X_WB.q.conjugate() * (kGravity * Vector3d::UnitZ());
    sensors.add_motion(utime, at.X_WB.q, at.omega, specific_force_B);
  }

  [[nodiscard]] Vector3d velocity_W() const { return state.X_WB.q * state.v + current_W; }

  [[nodiscard]] HealthSample health() const {
    HealthSample sample;
    sample.utime = truth.utime;
    sample.battery_fraction = std::max(
        0.0, conditions.battery_fraction - truth.energy_used_wh / conditions.battery_capacity_wh);
    sample.voltage_v = conditions.battery_voltage;
    sample.current_a = (figures.hotel_load_w + flippers.power()) / conditions.battery_voltage;
    return sample;
  }

  [[nodiscard]] Vector3d declared_at(Utime utime) const {
    Vector3d declared_W = Vector3d::Zero();
    declared_W.head<2>() = conditions.declared_current.at(to_seconds(utime));
    return declared_W;
  }

  void set_current(const Vector3d& current_in_W) {
    DIVE_DEMAND(current_in_W.allFinite());
    undeclared_W = current_in_W;
    flow(declared_at(truth.utime) + undeclared_W + drawn_W);
  }

  // What is drawn of the current is Gauss-Markov, with the same sigma at all times.
  void vary_current() {
    if (conditions.current_sigma > 0.0) {
      const double kept = std::exp(-kTick / kCurrentTime);
      drawn_W = kept * drawn_W +
                std::sqrt(1.0 - kept * kept) * horizontal_draw(water, conditions.current_sigma);
    }
    flow(declared_at(truth.utime) + undeclared_W + drawn_W);
  }

  void flow(const Vector3d& flow_W) {
    if (flow_W == current_W) return;
    state.v += state.X_WB.q.conjugate() * (current_W - flow_W);  // keeps momentum over ground
    current_W = flow_W;
  }

  Aqua2Figures figures;
  Conditions conditions;
  Dynamics dynamics;
  Flippers flippers;
  Sensors sensors;
  Vector3d undeclared_W;
  Vector3d drawn_W = Vector3d::Zero();
  Vector3d current_W;  ///< Velocity of the water now: declared, undeclared and drawn.
  Random water;
  Dynamics::State state;
  GroundTruth truth;
};

Simulator::Simulator(const Model& model, const Pose& start_X_WB, Conditions conditions,
                     std::uint64_t seed) {
  DIVE_DEMAND(conditions.validate().empty() && start_X_WB.is_finite());
  impl_ = std::make_unique<Impl>(model, start_X_WB, std::move(conditions), seed);
}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

SensorSamples Simulator::step(const PseudoRates& rates) { return impl_->step(rates); }
const GroundTruth& Simulator::truth() const { return impl_->truth; }
void Simulator::set_current(const Vector3d& current_W) { impl_->set_current(current_W); }

}  // namespace dive::vehicle
