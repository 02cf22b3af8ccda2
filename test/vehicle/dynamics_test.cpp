// Physical laws of the equations of motion: conservation, dissipation, equilibrium.

#include "vehicle/simulator/dynamics/dynamics.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "test/common/arbitrary.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/dynamics/flippers.h"

namespace dive::vehicle {
namespace {

using Eigen::Vector3d;
using testing::aqua2;
using testing::arbitrary_pose;
using testing::arbitrary_vector;

const Vector3d kStill = Vector3d::Zero();
const FlipperForces kAdrift = FlipperForces::Zero();

// Frictionless water, and a neutrally buoyant body without a righting moment.
Aqua2Figures frictionless() {
  Aqua2Figures figures;
  figures.body_drag.setZero();
  figures.flipper_drag = 0.0;
  figures.tail_lift = 0.0;
  figures.metacentric_height = 0.0;
  figures.spare_buoyancy_kg = 0.0;
  return figures;
}

Dynamics::State arbitrary_state() {
  Dynamics::State state;
  state.X_WB = *arbitrary_pose();
  state.X_WB.p.z() -= 30.0;  // far from the surface
  state.v = *arbitrary_vector(1.0);
  state.omega = *arbitrary_vector(1.0);
  return state;
}

// Momentum of body and entrained water in W, about W's origin, from the figures alone.
Vector6d momentum_W(const Dynamics::State& state) {
  const Model model = aqua2();
  const Aqua2Figures figures;
  const Vector3d& c = model.centre_of_mass_B;
  const Vector3d v_c = state.v + state.omega.cross(c);
  Vector3d p_B = model.mass_kg * v_c;
  Vector3d l_B = c.cross(p_B) + model.inertia_B * state.omega;
  p_B += figures.added_mass.head<3>().cwiseProduct(state.v);
  l_B += figures.added_mass.tail<3>().cwiseProduct(state.omega);
  const Vector3d p_W = state.X_WB.q * p_B;
  Vector6d result;
  result << p_W, state.X_WB.q * l_B + state.X_WB.p.cross(p_W);
  return result;
}

RC_GTEST_PROP(Dynamics, KeepsEnergyAndMomentumWithoutFriction, ()) {
  const Dynamics dynamics(aqua2(), frictionless());
  Dynamics::State state = arbitrary_state();
  const double energy = dynamics.kinetic_energy(state);
  const Vector6d momentum = momentum_W(state);
  for (int i = 0; i < 500; ++i) dynamics.advance(state, kAdrift, kStill, 0.01);
  RC_ASSERT(std::abs(dynamics.kinetic_energy(state) - energy) < 1e-5 * (1.0 + energy));
  RC_ASSERT((momentum_W(state) - momentum).norm() < 1e-4 * (1.0 + momentum.norm()));
}

RC_GTEST_PROP(Dynamics, WaterOnlyTakesEnergyAway, ()) {
  Aqua2Figures figures = frictionless();
  figures.body_drag = Aqua2Figures{}.body_drag;
  figures.flipper_drag = Aqua2Figures{}.flipper_drag;
  const Dynamics dynamics(aqua2(), figures);
  Dynamics::State state = arbitrary_state();
  double energy = dynamics.kinetic_energy(state);
  for (int i = 0; i < 100; ++i) {
    dynamics.advance(state, kAdrift, kStill, 0.01);
    const double now = dynamics.kinetic_energy(state);
    RC_ASSERT(now <= energy * (1.0 + 1e-9));
    energy = now;
  }
}

RC_GTEST_PROP(Dynamics, ACurrentCarriesEverythingAlong, ()) {
  const Dynamics dynamics(aqua2(), Aqua2Figures{});
  const Vector3d current = *arbitrary_vector(0.5);
  Dynamics::State still = arbitrary_state();
  Dynamics::State carried = still;
  for (int i = 0; i < 300; ++i) {
    dynamics.advance(still, kAdrift, kStill, 0.01);
    dynamics.advance(carried, kAdrift, current, 0.01);
  }
  RC_ASSERT((carried.X_WB.p - still.X_WB.p - 3.0 * current).norm() < 1e-9);
  RC_ASSERT(angle_between(carried.X_WB.q, still.X_WB.q) < 1e-9);
}

TEST(Dynamics, RightsItselfAndRises) {
  const Dynamics dynamics(aqua2(), Aqua2Figures{});
  Dynamics::State state;
  state.X_WB = Pose{{0.0, 0.0, -20.0}, from_rpy(2.5, 0.4, 1.0)};
  for (int i = 0; i < 12000; ++i) dynamics.advance(state, kAdrift, kStill, 0.01);
  const Vector3d rpy = to_rpy(state.X_WB.q);
  EXPECT_LT(std::hypot(rpy.x(), rpy.y()), deg_to_rad(3.0));
  EXPECT_GT(state.X_WB.p.z(), -20.0 + 1.0);
}

TEST(Dynamics, FloatsWithTheHullMostlyUnderWater) {
  const Dynamics dynamics(aqua2(), Aqua2Figures{});
  Dynamics::State state;
  state.X_WB.p.z() = -0.5;
  for (int i = 0; i < 12000; ++i) dynamics.advance(state, kAdrift, kStill, 0.01);
  double share = 0.0;
  for (int i = 0; i < 6000; ++i) {  // it oscillates, by a millimetre
    dynamics.advance(state, kAdrift, kStill, 0.01);
    share += dynamics.submerged(state.X_WB) / 6000.0;
  }
  // Archimedes: the submerged fraction carries 16.4 kg with a reserve of 0.05 kg.
  EXPECT_NEAR(share, 16.4 / 16.45, 2e-3);
  EXPECT_LT(state.v.norm(), 0.01);
}

// The response per unit of pseudo-rate, with the sign that command.h states.
struct Push {
  PseudoRates rates;
  int axis;  // index in [v'; w'], 0 to 5
};

class Flipper : public ::testing::TestWithParam<Push> {};

TEST_P(Flipper, PushesInTheDirectionOfItsRateAndLittleElse) {
  const Model model = aqua2();
  Flippers flippers(model.hips_B, Aqua2Figures{});
  flippers.command(GetParam().rates);
  Vector6d wrench = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const Vector3d force = flippers.demand().col(i);
    wrench.head<3>() += force;
    wrench.tail<3>() += Vector3d(model.hips_B.col(i)).cross(force);
  }
  EXPECT_GT(wrench[GetParam().axis], 0.5);
  wrench[GetParam().axis] = 0.0;
  EXPECT_LT(wrench.norm(), 0.1) << wrench.transpose();
}

INSTANTIATE_TEST_SUITE_P(Rates, Flipper,
                         ::testing::Values(Push{{1.0, 0.0, 0.0, 0.0, 0.0}, 0},
                                           Push{{0.0, 1.0, 0.0, 0.0, 0.0}, 2},
                                           Push{{0.0, 0.0, 1.0, 0.0, 0.0}, 3},
                                           Push{{0.0, 0.0, 0.0, 1.0, 0.0}, 4},
                                           Push{{0.0, 0.0, 0.0, 0.0, 1.0}, 5}));

TEST(Flippers, GiveNoMoreThanTheLargestAmplitudeAndKeepTheDirection) {
  const Aqua2Figures figures;
  Flippers flippers(aqua2().hips_B, figures);
  flippers.command({1.0, 1.0, 1.0, 1.0, 1.0});
  const double most = figures.flipper_thrust(figures.max_amplitude);
  for (int i = 0; i < 6; ++i) EXPECT_LE(flippers.demand().col(i).norm(), most * (1.0 + 1e-12));
  const FlipperForces all_out = flippers.demand();
  flippers.command({7.0, 7.0, 7.0, 7.0, 7.0});
  EXPECT_TRUE(flippers.demand().isApprox(all_out)) << "rates beyond 1 mean 1";
  flippers.command({std::nan(""), 0.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(flippers.demand().norm(), 0.0) << "not a number means no effort";
}

TEST(Flippers, FollowTheDemandWithTheirLag) {
  const Aqua2Figures figures;
  Flippers flippers(aqua2().hips_B, figures);
  flippers.command({1.0, 0.0, 0.0, 0.0, 0.0});
  for (int i = 0; i < 12; ++i) flippers.advance(figures.motor_lag_s / 12.0);
  EXPECT_NEAR(flippers.forces()(0, 0) / flippers.demand()(0, 0), 1.0 - std::exp(-1.0), 1e-9);
}

}  // namespace
}  // namespace dive::vehicle
