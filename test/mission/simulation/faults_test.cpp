// What is injected reaches the executive, and what appears is solid to everyone.

#include "mission/simulation/faults.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dive::mission {
namespace {

StepInputs healthy(Utime now) {
  StepInputs inputs;
  inputs.now = now;
  inputs.imu = ImuSample{};
  inputs.depth = DepthSample{now, 3.0 + to_seconds(now)};
  inputs.health = HealthSample{now, 0.9, 20.0, false};
  PlanReply reply;
  reply.plan.status = planning::PlanStatus::kSuccess;
  reply.plan.accepted = true;
  reply.plan.waypoints.resize(2);
  inputs.plan = reply;
  inputs.obstacles.push_back({planning::ObstacleSource::kMapper, now, {}});
  inputs.free_ahead = planning::FreeAhead{now, 5.0};
  inputs.pose_correction = planning::PoseCorrection{now, {0.1, 0.0}};
  inputs.map_correction = MapCorrection{{{now, {}}}};
  return inputs;
}

struct Injected : StepInputs {
  std::vector<AppearingObstacle> appearing;
};

Injected injected(FaultKind kind, double seconds) {
  FaultInjector injector({{kind, 5.0}});
  Injected inputs;
  for (double t = 0.0; t <= seconds; t += 0.5) {
    vehicle::GroundTruth truth;
    truth.utime = from_seconds(t);
    truth.X_WB.p = {t, 0, -3};
    inputs = {healthy(truth.utime), {}};
    injector.apply(truth, inputs, inputs.appearing);
  }
  return inputs;
}

TEST(FaultInjector, ChangesNothingBeforeItsTime) {
  for (std::size_t i = 0; i < kFaultCount; ++i) {
    const auto kind = static_cast<FaultKind>(i);
    EXPECT_EQ(find_fault(to_string(kind)), kind);
    const Injected inputs = injected(kind, 4.5);
    EXPECT_TRUE(inputs.imu && inputs.imu->q_WB.coeffs().allFinite()) << to_string(kind);
    EXPECT_EQ(inputs.depth->depth_m, 7.5) << to_string(kind);
    EXPECT_TRUE(inputs.health && !inputs.health->leak) << to_string(kind);
    EXPECT_EQ(inputs.health->battery_fraction, 0.9) << to_string(kind);
    EXPECT_EQ(inputs.plan->plan.status, planning::PlanStatus::kSuccess) << to_string(kind);
    EXPECT_TRUE(inputs.free_ahead && inputs.pose_correction && inputs.map_correction)
        << to_string(kind);
    EXPECT_EQ(inputs.obstacles.size(), 1U) << to_string(kind);
    EXPECT_TRUE(inputs.appearing.empty() && !inputs.operator_command) << to_string(kind);
  }
}

TEST(FaultInjector, SpoilsWhatItNames) {
  EXPECT_TRUE(injected(FaultKind::kLeak, 6).health->leak);
  EXPECT_EQ(injected(FaultKind::kBattery, 6).health->battery_fraction, 0.0);
  EXPECT_GT(injected(FaultKind::kTemperature, 6).health->temperature_c, 80.0);
  EXPECT_FALSE(injected(FaultKind::kImuSilent, 6).imu);
  EXPECT_FALSE(injected(FaultKind::kImuNan, 6).imu->q_WB.coeffs().allFinite());
  EXPECT_FALSE(injected(FaultKind::kDepthSilent, 6).depth);
  EXPECT_TRUE(std::isnan(injected(FaultKind::kDepthNan, 6).depth->depth_m));
  EXPECT_EQ(injected(FaultKind::kDepthFrozen, 6).depth->depth_m, 8.0);
  EXPECT_FALSE(injected(FaultKind::kHealthSilent, 6).health);
  const Injected blind = injected(FaultKind::kRangeSilent, 6);
  EXPECT_TRUE(blind.obstacles.empty() && !blind.free_ahead);
  EXPECT_TRUE(!blind.pose_correction && !blind.map_correction);
  EXPECT_EQ(injected(FaultKind::kPlannerFails, 6).plan->plan.status, planning::PlanStatus::kNoPath);
  EXPECT_FALSE(injected(FaultKind::kPlannerSilent, 6).plan);
  EXPECT_EQ(injected(FaultKind::kAbort, 5).operator_command, OperatorCommand::kAbort);
  EXPECT_FALSE(injected(FaultKind::kAbort, 6).operator_command) << "sent once";
}

TEST(FaultInjector, AnInertialUnitFailsWithTheOther) {
  const auto received = [](FaultKind kind) {
    FaultInjector injector({{kind, 5.0}});
    StepInputs inputs = healthy(from_seconds(6.0));
    vehicle::GroundTruth truth;
    truth.utime = inputs.now;
    std::vector<AppearingObstacle> appearing;
    injector.apply(truth, inputs, appearing);
    vehicle::InertialSamples samples;
    samples.count = 4;
    injector.apply(samples);
    return samples;
  };
  EXPECT_EQ(received(FaultKind::kImuSilent).count, 0U);
  EXPECT_FALSE(received(FaultKind::kImuNan).samples[3].gyro_B.allFinite());
  EXPECT_TRUE(received(FaultKind::kCameraMissing).samples[3].gyro_B.allFinite());
}

TEST(FaultInjector, DropsSomethingIntoTheTrailBehind) {
  const Injected inputs = injected(FaultKind::kBlocked, 5);
  ASSERT_EQ(inputs.appearing.size(), 1U);
  EXPECT_LT(inputs.appearing[0].X_WO.p.x(), 4.0);
  EXPECT_GT(inputs.appearing[0].X_WO.p.x(), 0.0);
  EXPECT_TRUE(injected(FaultKind::kBlocked, 6).appearing.empty()) << "once";
}

// Where the vehicle swims there and back, the point 2 m back along the trail is its own position.
TEST(FaultInjector, DropsNothingOntoTheVehicle) {
  FaultInjector injector({{FaultKind::kBlocked, 0.5}, {FaultKind::kBlocked, 5.0}});
  std::vector<double> dropped_s;
  for (int tick = 0; tick <= 100; ++tick) {
    const double t = 0.1 * tick;
    vehicle::GroundTruth truth;
    truth.utime = from_seconds(t);
    truth.X_WB.p = {t < 4.0 ? t : 8.0 - t, 0, -3};  // turns about at 4 s
    StepInputs inputs = healthy(truth.utime);
    std::vector<AppearingObstacle> appearing;
    injector.apply(truth, inputs, appearing);
    for (const AppearingObstacle& obstacle : appearing) {
      dropped_s.push_back(t);
      EXPECT_GE((obstacle.X_WO.p - truth.X_WB.p).norm(), 1.5);
    }
  }
  ASSERT_EQ(dropped_s.size(), 2U);
  EXPECT_NEAR(dropped_s[0], 1.5, 0.11);
  EXPECT_GT(dropped_s[1], 5.5);
}

}  // namespace
}  // namespace dive::mission
