#include "behaviors/orbit.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "test/behaviors/plan_answer.h"

namespace dive::behaviors {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurnRate = 0.8;  // rad/s
constexpr double kTick = 0.02;     // s

std::vector<LegGoal> stations_round(const OrbitCircle& circle, int count, double first, double step,
                                    double dwell_s) {
  std::vector<LegGoal> stations;
  for (int i = 0; i < count; ++i) {
    const double angle = first + i * step;
    LegGoal goal;
    goal.id = std::to_string(i + 1);
    goal.position_W = {circle.centre_W.x() + circle.radius * std::cos(angle),
                       circle.centre_W.y() + circle.radius * std::sin(angle), -3.0};
    goal.capture_radius = 0.3;
    goal.dwell_s = dwell_s;
    stations.push_back(goal);
  }
  return stations;
}

LegSettings settings() {
  LegSettings result;
  result.limits.attitude = planning::AttitudeMode::kHorizontal;
  result.limits.min_z = -10.0;
  return result;
}

// Moves along its bow as commanded, turns at a limited rate, and gets a straight path for each
// request.
class Vehicle {
 public:
  explicit Vehicle(const Vector3d& p_W) {
    estimate_.valid = true;
    estimate_.X_WB.p = p_W;
  }
  BehaviorOutput tick(Orbit& orbit) {
    now_ += from_seconds(kTick);
    BehaviorInput input;
    input.now = now_;
    input.estimate = &estimate_;
    input.plan = plan_ ? &*plan_ : nullptr;
    const BehaviorOutput output = orbit.step(input);
    plan_.reset();
    if (output.plan_request) {
      const std::vector<Pose> path = {output.plan_request->start, output.plan_request->goal};
      plan_ = testing::plan_answer(planning::PlanStatus::kSuccess, "", path, 1.0);
    }
    const double off = wrap_angle(to_rpy(output.command.o).z() - yaw());
    const double turned = yaw() + std::clamp(off, -kTurnRate * kTick, kTurnRate * kTick);
    estimate_.X_WB.q = from_rpy(0.0, 0.0, turned);
    estimate_.X_WB.p += estimate_.X_WB.q * Vector3d(kTick * output.command.v, 0.0, 0.0);
    estimate_.X_WB.p.head<2>() += kTick * current_W;
    estimate_.X_WB.p.z() = -output.command.d;
    estimate_.v_WB_B = {output.command.v, 0.0, 0.0};
    return output;
  }
  void move_to(const Vector2d& p_W) { estimate_.X_WB.p.head<2>() = p_W; }
  Vector2d current_W = Vector2d::Zero();  // m/s; not in the estimated velocity
  [[nodiscard]] const Vector3d& position() const { return estimate_.X_WB.p; }
  [[nodiscard]] double yaw() const { return to_rpy(estimate_.X_WB.q).z(); }
  [[nodiscard]] double off_bearing(const Vector2d& point) const {
    const Vector2d way = point - position().head<2>();
    return std::abs(wrap_angle(std::atan2(way.y(), way.x()) - yaw()));
  }

 private:
  Utime now_ = 0;
  estimation::StateEstimate estimate_;
  std::optional<planning::PlanResult> plan_;
};

constexpr double kThreeDegrees = 0.0524;

TEST(Orbit, VisitsItsStationsInOrderAndFacesTheCentreForTheDwell) {
  EXPECT_TRUE(rc::check([] {
    const OrbitCircle circle{{*rc::gen::inRange(-5, 5), *rc::gen::inRange(-5, 5)},
                             *rc::gen::inRange(20, 50) / 10.0};
    const int count = *rc::gen::inRange(2, 7);
    const double step = *rc::gen::element(-1.0, 1.0) * *rc::gen::inRange(30, 91) * M_PI / 180.0;
    const double dwell = *rc::gen::inRange(0, 5);
    const std::vector<LegGoal> stations =
        stations_round(circle, count, *rc::gen::inRange(0, 6), step, dwell);
    Orbit orbit(settings(), circle, stations);
    Vehicle vehicle({circle.centre_W.x() - 8.0, circle.centre_W.y(), -2.0});
    std::vector<double> faced(stations.size());
    std::vector<bool> met(stations.size());
    bool done = false;
    for (int tick = 0; tick < 60'000 && !done; ++tick) {
      const auto at = static_cast<std::size_t>(orbit.goals_done());
      const bool is_there = (vehicle.position() - stations[at].position_W).norm() < 0.3;
      if (is_there && vehicle.off_bearing(circle.centre_W) < kThreeDegrees) {
        faced[at] += kTick;
        met[at] = true;
      }
      done = vehicle.tick(orbit).done;
      const auto next = static_cast<std::size_t>(orbit.goals_done());
      RC_ASSERT(next == at || next == at + 1);
    }
    RC_ASSERT(done);
    RC_ASSERT(orbit.goals_done() + 1 == count);
    for (std::size_t i = 0; i < stations.size(); ++i) {
      RC_ASSERT(met[i]);
      RC_ASSERT(faced[i] >= dwell - 2.0 * kTick);
    }
  }));
}

// At the first station of two, with the bow to the centre.
struct AtStation {
  AtStation() {
    while (orbit.needs_free_ahead() || vehicle.off_bearing(circle.centre_W) > 0.01) {
      static_cast<void>(vehicle.tick(orbit));
    }
  }
  OrbitCircle circle{{0.0, 0.0}, 4.0};
  Orbit orbit{settings(), circle, stations_round(circle, 2, M_PI, M_PI / 3.0, 30.0)};
  Vehicle vehicle{{-4.0, -3.0, -3.0}};
};

TEST(Orbit, KeepsTheRadiusWhileItFacesTheCentre) {
  AtStation at;
  EXPECT_EQ(at.vehicle.tick(at.orbit).command.v, 0.0);
  at.vehicle.move_to({-4.5, 0.0});
  EXPECT_GT(at.vehicle.tick(at.orbit).command.v, 0.0) << "too far: ahead";
  at.vehicle.move_to({-3.5, 0.0});
  const double astern = at.vehicle.tick(at.orbit).command.v;
  EXPECT_LT(astern, 0.0) << "too near";
  EXPECT_GE(astern, -0.1) << "not what counts as under way";
}

// To the side of its station the centre is elsewhere.
TEST(Orbit, DwellsOnlyWhileItFacesTheCentre) {
  AtStation at;
  for (double t = 0.0; t < 20.0; t += kTick) EXPECT_FALSE(at.vehicle.tick(at.orbit).done);
  for (double t = 0.0; t < 20.0; t += kTick) {
    const Vector3d p_W = at.vehicle.position();
    at.vehicle.move_to({-4.0, p_W.y() > 0.0 ? -0.5 : 0.5});
    static_cast<void>(at.vehicle.tick(at.orbit));
  }
  EXPECT_EQ(at.orbit.goals_done(), 0);
  at.vehicle.move_to({-4.0, 0.0});
  double left = 0.0;
  for (; at.orbit.goals_done() == 0 && left < 60.0; left += kTick) {
    static_cast<void>(at.vehicle.tick(at.orbit));
  }
  EXPECT_NEAR(left, 12.0, 2.5) << "the rest of the dwell, and the turns before and after it";
}

TEST(Orbit, ReturnsToAStationThatItDriftsOffAndFinishesTheDwellThere) {
  AtStation at;
  at.vehicle.current_W = {0.0, 0.05};  // across the bow, which points to the centre
  double farthest = 0.0;
  double faced = 0.0;
  int plans = 0;
  for (double t = 0.0; t < 120.0 && at.orbit.goals_done() == 0; t += kTick) {
    plans += at.vehicle.tick(at.orbit).plan_request ? 1 : 0;
    farthest = std::max(farthest, std::abs(at.vehicle.position().y()));
    faced += at.vehicle.off_bearing({0.0, 0.0}) < kThreeDegrees ? kTick : 0.0;
  }
  EXPECT_EQ(at.orbit.goals_done(), 1);
  EXPECT_GE(plans, 3) << "two returns, and the leg to the next station";
  EXPECT_LT(farthest, 0.75);
  EXPECT_GE(faced, 30.0);
}

TEST(Orbit, LeavesAStationWhereTheCurrentLetsItNotStay) {
  AtStation at;
  double t = 0.0;
  for (; t < 200.0 && at.orbit.goals_done() == 0; t += kTick) {
    at.vehicle.current_W = {0.0, at.orbit.needs_free_ahead() ? 0.0 : 0.3};
    static_cast<void>(at.vehicle.tick(at.orbit));
  }
  EXPECT_EQ(at.orbit.goals_done(), 1);
  EXPECT_LT(t, 100.0);
}

TEST(Orbit, IsDoneWithAStationWhenTopsideSkipsIt) {
  AtStation at;
  EXPECT_EQ(at.orbit.progress().goal, "1");
  EXPECT_TRUE(at.orbit.skip());
  EXPECT_EQ(at.orbit.goals_done(), 1);
  EXPECT_TRUE(at.vehicle.tick(at.orbit).plan_request) << "on its way to the next";
  EXPECT_EQ(at.orbit.progress().goal, "2");
  EXPECT_FALSE(at.orbit.skip()) << "there is none after the last";
}

TEST(Orbit, BeginsWhereItWasBeforeARestart) {
  const OrbitCircle circle{{0.0, 0.0}, 4.0};
  Orbit orbit(settings(), circle, stations_round(circle, 4, 0.0, 1.0, 1.0), 2);
  EXPECT_EQ(orbit.goals_done(), 2);
  EXPECT_EQ(orbit.progress().goal, "3");
}

TEST(Orbit, NeedsFreeAheadOnlyWhileItSwims) {
  const OrbitCircle circle{{0.0, 0.0}, 4.0};
  Orbit orbit(settings(), circle, stations_round(circle, 2, 0.0, 1.0, 1.0));
  EXPECT_TRUE(orbit.needs_free_ahead());
  AtStation at;
  EXPECT_FALSE(at.orbit.needs_free_ahead());
  EXPECT_FALSE(at.orbit.request_alternative());
}

}  // namespace
}  // namespace dive::behaviors
