#include "vehicle/simulator/diver.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::vehicle {
namespace {

const Eigen::Vector3d kFarAway(0, 0, -500);

Pose at(double x, double y, double z) {
  return {Eigen::Vector3d(x, y, z), Eigen::Quaterniond::Identity()};
}

void expect_at(const Diver& diver, const Eigen::Vector3d& p_W, double yaw) {
  EXPECT_NEAR((diver.pose().p - p_W).norm(), 0.0, 1e-9) << diver.pose().p.transpose();
  EXPECT_NEAR((to_rpy(diver.pose().q) - Eigen::Vector3d(0, 0, yaw)).norm(), 0.0, 1e-9);
}

TEST(Diver, SwimsItsTrackAndPauses) {
  Diver diver(
      {.waypoints = {{{0, 0, -5}, 1.0}, {{0, 4, -5}, 2.0}, {{0, 4, -7}, 0}, {{3, 4, -3}, 9}},
       .speed = 0.5,
       .start_s = 10.0});
  const double north = 0.5 * std::numbers::pi;
  const auto advance_to = [&](double t) { diver.advance(from_seconds(t), kFarAway); };
  advance_to(9.0);
  expect_at(diver, {0, 0, -5}, north);
  advance_to(11.0);  // started, and pausing
  expect_at(diver, {0, 0, -5}, north);
  advance_to(13.0);
  expect_at(diver, {0, 1, -5}, north);
  advance_to(12.0);
  expect_at(diver, {0, 1, -5}, north);
  advance_to(20.5);  // arrived at 19 s
  expect_at(diver, {0, 4, -5}, north);
  advance_to(22.0);  // straight down, level
  expect_at(diver, {0, 4, -5.5}, north);
  advance_to(30.0);  // turned by 25 s; the next segment is 5 m long
  expect_at(diver, {1.5, 4, -5}, 0.0);
  advance_to(300.0);
  expect_at(diver, {3, 4, -3}, 0.0);
}

// Stops before a vehicle in its path, in ticks of any length; continues once it has left.
TEST(Diver, WaitsForTheVehicle) {
  for (const double tick : {0.02, 0.13, 30.0}) {
    Diver diver({.waypoints = {{{0, 0, -5}, 0}, {{20, 0, -5}, 0}}, .speed = 0.5, .keeps_m = 1.5});
    const Eigen::Vector3d vehicle_W(10, 0.2, -5);
    for (int i = 1; i * tick <= 60.0; ++i) diver.advance(from_seconds(i * tick), vehicle_W);
    const Eigen::Vector3d head = diver.pose() * Eigen::Vector3d(0.6, 0, 0);
    EXPECT_GE((vehicle_W - head).norm() - 0.3, 1.5);
    EXPECT_LE((vehicle_W - head).norm() - 0.3, 1.52);
    diver.advance(from_seconds(200.0), kFarAway);
    expect_at(diver, {20, 0, -5}, 0.0);
  }
}

// Turning on the spot would move its legs nearer.
TEST(Diver, DoesNotTurnTowardsTheVehicle) {
  const Eigen::Vector3d vehicle_W(4, 2.2, -5);
  Diver diver({.waypoints = {{{0, 0, -5}, 0}, {{4, 0, -5}, 0}, {{4, -4, -5}, 0}}, .speed = 0.5});
  diver.advance(from_seconds(60.0), vehicle_W);
  expect_at(diver, {4, 0, -5}, 0.0);
}

TEST(Diver, MovesAwayFromAVehicleThatCameTooNear) {
  Diver diver({.waypoints = {{{0, 0, -5}, 0}, {{4, 0, -5}, 0}}, .speed = 0.5});
  diver.advance(from_seconds(4.0), {-0.5, 0, -5});
  expect_at(diver, {2, 0, -5}, 0.0);
}

TEST(Diver, IsACapsuleAlongX) {
  const planning::ConvexSolid speck{"speck", {{0, 0, 0}, {1e-4, 0, 0}, {0, 1e-4, 0}, {0, 0, 1e-4}}};
  const ClearanceMeter meter({{Diver::shape()}}, {{speck}});
  EXPECT_NEAR(meter.clearance(at(2, 0, 0)), 1.1, 0.002);
  EXPECT_NEAR(meter.clearance(at(-2, 0, 0)), 1.1, 0.002);
  EXPECT_NEAR(meter.clearance(at(0.5, 2, 0)), 1.7, 0.002);
  EXPECT_NEAR(meter.clearance(at(-0.5, 0, -2)), 1.7, 0.002);
}

TEST(Diver, RefusesWhatCannotBeSwum) {
  const DiverTrack good{.waypoints = {{{0, 0, -5}, 0}}};
  EXPECT_EQ(good.validate(), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](auto change) {
    DiverTrack track = good;
    change(track);
    EXPECT_NE(track.validate(), "");
  };
  refuses([](DiverTrack& t) { t.waypoints.clear(); });
  refuses([&](DiverTrack& t) { t.waypoints[0].p_W.y() = nan; });
  refuses([](DiverTrack& t) { t.waypoints[0].p_W.z() = 1.0; });
  refuses([](DiverTrack& t) { t.waypoints[0].pause_s = -1.0; });
  refuses([](DiverTrack& t) { t.speed = 0.0; });
  refuses([&](DiverTrack& t) { t.start_s = nan; });
  refuses([](DiverTrack& t) { t.keeps_m = -1.0; });
}

}  // namespace
}  // namespace dive::vehicle
