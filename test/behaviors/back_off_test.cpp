#include "behaviors/back_off.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include <gtest/gtest.h>

namespace dive::behaviors {
namespace {

constexpr double kMinClearance = 0.8;  // D_min, m: 65 % are 0.52 m, 85 % are 0.68 m
constexpr double kTick = 0.1;          // s

// Clearance by pose; a motion has the least of its waypoints.
class FakeClearance final : public PathEvaluator {
 public:
  double clearance(std::span<const Pose> waypoints) override {
    double least = 10.0;
    for (const Pose& pose : waypoints) least = std::min(least, at(pose));
    return least;
  }
  double clearance_to_all(std::span<const Pose> waypoints) override { return clearance(waypoints); }
  std::function<double(const Pose&)> at = [](const Pose& /*pose*/) { return 1.2; };
};

// A vehicle that has swum 8 m east below an overhead and is where it is commanded to be at once.
class BackOffTest : public ::testing::Test {
 protected:
  BackOffTest() {
    estimate_.valid = true;
    swim_in({0, 0, -3}, {8, 0, -3});
  }

  // Drops a breadcrumb every half metre; leaves the vehicle at the end, bow ahead.
  void swim_in(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W,
               double open_until_x = -1.0) {
    const Eigen::Vector3d way = to_W - from_W;
    const int steps = static_cast<int>(std::round(way.head<2>().norm() / 0.5));
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d p_W = from_W + way * i / steps;
      trail_.add(p_W, p_W.x() < open_until_x);
    }
    estimate_.X_WB = {to_W, from_rpy(0, 0, std::atan2(way.y(), way.x()))};
  }
  void clearance_is(double clearance) {
    evaluator_.at = [=](const Pose& /*pose*/) { return clearance; };
  }
  void clearance_by_x(const std::function<double(double)>& at) {
    evaluator_.at = [=](const Pose& pose) { return at(pose.p.x()); };
  }
  [[nodiscard]] BehaviorInput input() {
    BehaviorInput input;
    input.now = now_;
    input.estimate = &estimate_;
    input.trail = &trail_;
    input.observed = &evaluator_;
    input.map_changed = true;
    return input;
  }
  void pass(double seconds) { now_ += from_seconds(seconds); }
  [[nodiscard]] bool is_needed() { return back_off_.is_needed(input()); }
  // Back and forth, so that the path grows and not the distance, and without a change of the map.
  void swim_about(double metres) {
    BehaviorInput unchanged = input();
    unchanged.map_changed = false;
    const int steps = static_cast<int>(std::round(metres / 0.05));
    for (int i = 0; i < steps; ++i) {
      p_W().x() += i % 2 == 0 ? 0.05 : -0.05;
      EXPECT_FALSE(back_off_.is_needed(unchanged));
    }
  }
  [[nodiscard]] bool begin(const BackOff::Criteria& asked = {}) {
    static_cast<void>(is_needed());  // measures the clearance where it is
    return back_off_.begin(input(), asked);
  }
  std::optional<vehicle::Command> tick() {
    const std::optional<vehicle::Command> command = back_off_.follow(input());
    pass(kTick);
    if (!command) return command;
    estimate_.X_WB.q = command->o;
    p_W() += command->o * Eigen::Vector3d(kTick * command->v, 0, 0);
    p_W().z() = -command->d;
    return command;
  }
  // Where it stops; nothing if it does not begin.
  [[nodiscard]] std::optional<Eigen::Vector3d> destination(const BackOff::Criteria& asked = {}) {
    if (!begin(asked)) return std::nullopt;
    for (int i = 0; i < 10'000 && tick(); ++i) {
    }
    EXPECT_FALSE(back_off_.is_under_way());
    return p_W();
  }
  // Breadcrumbs are half a metre apart and it stops 0.2 m before the last.
  void expect_goes_to(double x, const BackOff::Criteria& asked = {}) {
    const std::optional<Eigen::Vector3d> end_W = destination(asked);
    ASSERT_TRUE(end_W);
    EXPECT_NEAR(end_W->x(), x + 0.19, 0.02);
  }
  [[nodiscard]] Eigen::Vector3d& p_W() { return estimate_.X_WB.p; }
  void place_at(double x, double yaw = 0.0) { estimate_.X_WB = {{x, 0, -3}, from_rpy(0, 0, yaw)}; }

  Utime now_ = 0;
  estimation::StateEstimate estimate_;
  Trail trail_;
  FakeClearance evaluator_;
  BackOff back_off_{kMinClearance};
};

TEST_F(BackOffTest, IsNeededOnlyWhenTheMapHasChangedAndWithBothMapAndTrail) {
  clearance_is(0.4);
  BehaviorInput unchanged = input();
  unchanged.map_changed = false;
  EXPECT_FALSE(back_off_.is_needed(unchanged));
  BehaviorInput without_map = input();
  without_map.observed = nullptr;
  EXPECT_FALSE(back_off_.is_needed(without_map));
  EXPECT_FALSE(back_off_.begin(without_map, {}));
  pass(2.0);
  BehaviorInput without_trail = input();
  without_trail.trail = nullptr;
  EXPECT_FALSE(back_off_.is_needed(without_trail));
  EXPECT_FALSE(back_off_.begin(without_trail, {}));
  pass(2.0);
  EXPECT_TRUE(is_needed());
  EXPECT_EQ(back_off_.clearance_m(), 0.4);
}

TEST_F(BackOffTest, IsNeededAtOnceBelow65PercentOfTheClearance) {
  clearance_is(0.521);
  EXPECT_FALSE(is_needed());
  clearance_is(0.519);
  EXPECT_TRUE(is_needed());
}

TEST_F(BackOffTest, IsNeededAfterTwoMetresOfPathBelow85PercentOfTheClearance) {
  clearance_is(0.679);
  EXPECT_FALSE(is_needed());
  swim_about(1.95);
  EXPECT_FALSE(is_needed());
  swim_about(0.1);
  EXPECT_TRUE(is_needed());

  clearance_is(0.681);
  EXPECT_FALSE(is_needed()) << "and the path begins again";
  clearance_is(0.679);
  swim_about(1.95);
  EXPECT_FALSE(is_needed());
  swim_about(0.1);
  EXPECT_TRUE(is_needed());
}

// A turn here would leave 0.4 m too, since nowhere is nearer than here.
TEST_F(BackOffTest, BeginsIfTheWayBackLeavesNoLessThanAsked) {
  clearance_by_x([](double x) { return x > 7.2 ? 0.4 : 0.9; });
  BackOff::Criteria asked;
  asked.min_clearance_m = 0.401;
  EXPECT_FALSE(begin(asked));
  asked.min_clearance_m = 0.4;
  EXPECT_TRUE(begin(asked));
}

TEST_F(BackOffTest, IsNotNeededWithinTwoSecondsOfTheLastAttempt) {
  clearance_is(0.4);
  EXPECT_TRUE(is_needed());
  EXPECT_FALSE(begin()) << "nowhere is more";
  clearance_is(0.41);
  pass(1.99);
  EXPECT_FALSE(is_needed());
  EXPECT_EQ(back_off_.clearance_m(), 0.41) << "the clearance is measured";
  pass(0.01);
  EXPECT_TRUE(is_needed());

  clearance_by_x([](double x) { return x > 5.2 ? 0.4 : 0.9; });
  EXPECT_TRUE(begin());
  clearance_is(-0.1);
  EXPECT_FALSE(back_off_.follow(input())) << "blocked at once";
  pass(1.99);
  EXPECT_FALSE(is_needed());
  pass(0.01);
  EXPECT_TRUE(is_needed());
}

TEST_F(BackOffTest, NoticesClearanceWithinTwoSecondsOfTheLastAttempt) {
  clearance_is(0.6);
  EXPECT_FALSE(is_needed());
  swim_about(2.05);
  EXPECT_TRUE(is_needed());
  EXPECT_FALSE(begin());
  pass(1.0);
  clearance_is(0.7);
  EXPECT_FALSE(is_needed());
  pass(1.5);
  clearance_is(0.6);
  EXPECT_FALSE(is_needed()) << "the path begins where it had clearance";
}

TEST_F(BackOffTest, GoesToTheNearestBreadcrumbWith85PercentOfTheClearance) {
  clearance_by_x([](double x) {
    if (x > 7.8) return 0.5;
    if (x > 6.7) return 0.679;
    return x > 5.2 ? 0.681 : 0.9;
  });
  expect_goes_to(6.5);
}

TEST_F(BackOffTest, GoesWhereItHasMoreClearanceThanHere) {
  const auto at = [](double x) {
    if (x > 7.8) return 0.66;
    return x > 5.7 ? 0.7 : 0.72;
  };
  clearance_by_x(at);
  expect_goes_to(5.5);

  place_at(8);
  expect_goes_to(7.0, {.min_distance_m = 0.6});  // sent away, it takes what has clearance
}

TEST_F(BackOffTest, EvaluatesBreadcrumbsInItsPresentAttitude) {
  place_at(8, 0.3);
  evaluator_.at = [](const Pose& pose) {
    if (pose.p.x() > 5.2) return 0.5;
    return std::abs(yaw_of(pose) - 0.3) < 0.01 ? 0.9 : 0.1;
  };
  expect_goes_to(5.0);
}

TEST_F(BackOffTest, ElseGoesToTheNearestBreadcrumbWithMostClearance) {
  clearance_by_x([](double x) {
    if (x > 7.8) return 0.3;
    return std::abs(x - 6.0) < 0.2 || std::abs(x - 4.0) < 0.2 ? 0.6 : 0.5;
  });
  expect_goes_to(6.0);
}

TEST_F(BackOffTest, IsRefusedWhereNoneHasFiveCentimetresMoreThanHere) {
  const auto here_and_elsewhere = [this](double elsewhere) {
    clearance_by_x([=](double x) { return x > 7.8 ? 0.3 : elsewhere; });
  };
  here_and_elsewhere(0.349);
  EXPECT_FALSE(begin());
  EXPECT_FALSE(back_off_.is_under_way());
  here_and_elsewhere(0.351);
  EXPECT_TRUE(begin());
  EXPECT_TRUE(back_off_.is_under_way());
}

TEST_F(BackOffTest, IsRefusedWhereThePathIsBlocked) {
  const auto between = [this](double clearance) {
    clearance_by_x([=](double x) {
      if (x > 7.2) return 0.5;
      return x > 5.2 ? clearance : 0.9;
    });
  };
  between(0.0);
  EXPECT_FALSE(begin());
  EXPECT_FALSE(back_off_.is_under_way());
  between(0.001);
  EXPECT_TRUE(begin());
  EXPECT_TRUE(back_off_.is_under_way());
}

TEST_F(BackOffTest, IsRefusedWhereItCannotTurnOntoThePath) {
  place_at(8, 0.5);
  double blocked_yaw = 0.0;
  evaluator_.at = [&](const Pose& pose) {
    if (pose.p.x() < 5.2) return 0.9;
    return pose.p.x() > 7.8 && std::abs(yaw_of(pose) - blocked_yaw) < 0.1 ? -0.1 : 0.5;
  };
  EXPECT_FALSE(begin());
  blocked_yaw = 0.5;
  EXPECT_FALSE(begin()) << "as it is";
  blocked_yaw = 1.0;
  EXPECT_TRUE(begin());
}

// North, then east.
class BackOffAroundACorner : public BackOffTest {
 protected:
  BackOffAroundACorner() {
    trail_ = Trail();
    swim_in({0, 0, -3}, {0, 4, -3});
    swim_in({0, 4, -3}, {4, 4, -3});
  }
};

TEST_F(BackOffAroundACorner, IsRefusedWhereItCannotArrive) {
  double clearance_on_arrival = 0.0;
  evaluator_.at = [&](const Pose& pose) {
    if (pose.p.y() > 2.2) return 0.5;
    return yaw_of(pose) > 1.5 ? clearance_on_arrival : 0.9;
  };
  EXPECT_FALSE(begin()) << "stern first it arrives with its bow north";
  clearance_on_arrival = 0.1;
  EXPECT_TRUE(begin());
}

TEST_F(BackOffAroundACorner, MeasuresTheLeastDistanceInAStraightLine) {
  evaluator_.at = [](const Pose& pose) { return pose.p.x() > 3.8 ? 0.5 : 0.9; };
  const std::optional<Eigen::Vector3d> end_W = destination({.min_distance_m = 4.5});
  ASSERT_TRUE(end_W);
  EXPECT_NEAR(end_W->y(), 1.5 + 0.19, 0.02);
}

TEST_F(BackOffAroundACorner, HeadsForThePoint40CentimetresAhead) {
  evaluator_.at = [](const Pose& pose) { return pose.p.y() < 2.2 ? 0.9 : 0.5; };
  ASSERT_TRUE(begin());
  while (tick() && std::abs(yaw_of(estimate_.X_WB)) < 1e-6) {
  }
  EXPECT_NEAR(p_W().x(), 0.385, 0.015);
  EXPECT_GT(yaw_of(estimate_.X_WB), 0.7) << "past the corner to the next point";
}

TEST_F(BackOffTest, GoesAtLeastAsFarAsAsked) {
  clearance_by_x([](double x) { return x > 6.7 ? 0.5 : 0.9; });
  expect_goes_to(5.5, {.min_distance_m = 2.4});
  place_at(8);
  clearance_by_x([](double x) {
    if (x > 7.8) return 0.3;
    if (x > 6.7) return 0.6;
    return std::abs(x - 4.0) < 0.2 ? 0.5 : 0.4;
  });
  expect_goes_to(4.0, {.min_distance_m = 2.0});
}

TEST_F(BackOffTest, GoesNoFartherThanAsked) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  EXPECT_FALSE(begin({.max_distance_m = 2.9}));
  EXPECT_TRUE(begin({.max_distance_m = 3.0}));
}

TEST_F(BackOffTest, GoesNoFartherThanEightMetresWithoutBeingAsked) {
  swim_in({8, 0, -3}, {12, 0, -3});
  clearance_by_x([](double x) { return x > 3.7 ? 0.5 : 0.9; });
  EXPECT_FALSE(begin());
  clearance_by_x([](double x) { return x > 4.2 ? 0.5 : 0.9; });
  EXPECT_TRUE(begin());
}

TEST_F(BackOffTest, GoesToOpenWaterIfAsked) {
  trail_ = Trail();
  swim_in({0, 0, -3}, {8, 0, -3}, 5.2);
  clearance_by_x([](double x) { return x > 6.7 ? 0.5 : 0.9; });
  expect_goes_to(5.0, {.needs_open_water = true});
  place_at(8);
  expect_goes_to(6.5);

  place_at(8);
  clearance_by_x([](double x) {
    if (x > 7.8) return 0.3;
    if (x > 5.2) return 0.6;
    return std::abs(x - 4.0) < 0.2 ? 0.5 : 0.4;
  });
  expect_goes_to(4.0, {.needs_open_water = true});
}

TEST_F(BackOffTest, GoesSternFirstIfItsBowPointsAwayAndElseBowFirst) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  for (const double yaw : {0.0, 1.5, -1.5, 1.65, -1.65, 3.1}) {
    const bool stern_first = std::abs(yaw) < 0.5 * M_PI;
    back_off_ = BackOff(kMinClearance);
    place_at(8, yaw);
    ASSERT_TRUE(begin());
    static_cast<void>(tick());
    EXPECT_NEAR(std::abs(yaw_of(estimate_.X_WB)), stern_first ? 0.0 : M_PI, 1e-9) << yaw;
    const std::optional<vehicle::Command> command = tick();
    ASSERT_TRUE(command);
    EXPECT_NEAR(command->v, stern_first ? -0.15 : 0.15, 1e-9) << yaw;
  }
}

TEST_F(BackOffTest, IsSlowerTheFartherItIsOffCourse) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  for (const double course : {0.0, M_PI}) {
    for (const double off : {0.25, -0.25, 0.51, -1.4}) {
      back_off_ = BackOff(kMinClearance);
      place_at(8, course + off);
      ASSERT_TRUE(begin());
      const std::optional<vehicle::Command> command = tick();
      ASSERT_TRUE(command);
      EXPECT_NEAR(std::abs(command->v), std::abs(off) < 0.5 ? 0.075 : 0.0, 1e-9) << off;
    }
  }
}

TEST_F(BackOffTest, KeepsItsRollOnlyWhereComingLevelLeavesLessAndTooLittle) {
  const double on_its_side = 1.2;
  const auto roll_kept = [&](double level_m, double rolled_m) {
    back_off_ = BackOff(kMinClearance);
    place_at(8);
    estimate_.X_WB.q = from_rpy(on_its_side, 0, 0);
    evaluator_.at = [=](const Pose& pose) {
      if (pose.p.x() < 5.2) return 0.9;
      return std::abs(to_rpy(pose.q).x()) < 0.1 ? level_m : rolled_m;
    };
    EXPECT_TRUE(begin());
    const std::optional<vehicle::Command> command = back_off_.follow(input());
    return command ? to_rpy(command->o).x() : -1.0;
  };
  EXPECT_NEAR(roll_kept(0.1, 0.5), on_its_side, 1e-9);
  EXPECT_NEAR(roll_kept(-0.1, 0.2), on_its_side, 1e-9);
  EXPECT_NEAR(roll_kept(0.1, 0.05), 0.0, 1e-9) << "it has more room when level";
  EXPECT_NEAR(roll_kept(0.33, 0.5), 0.0, 1e-9) << "that is 0.4 of D_min: room enough to turn";
}

TEST_F(BackOffTest, ComesLevelOnItsWayAsSoonAsThereIsRoom) {
  place_at(8);
  estimate_.X_WB.q = from_rpy(1.2, 0, 0);
  evaluator_.at = [](const Pose& pose) {
    if (pose.p.x() < 5.2) return 0.9;
    return pose.p.x() > 7.0 && std::abs(to_rpy(pose.q).x()) < 1.1 ? 0.1 : 0.5;
  };
  ASSERT_TRUE(begin());
  while (p_W().x() > 7.1) {
    const std::optional<vehicle::Command> command = tick();
    ASSERT_TRUE(command);
    EXPECT_NEAR(to_rpy(command->o).x(), 1.2, 1e-9) << p_W().x();
  }
  while (p_W().x() > 6.8) ASSERT_TRUE(tick());
  const std::optional<vehicle::Command> command = tick();
  ASSERT_TRUE(command);
  EXPECT_NEAR(to_rpy(command->o).x(), 0.0, 1e-9);
}

TEST_F(BackOffTest, CommandsTheDepthOfThePointAheadAndNoneAboveTheSurface) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  for (const double rise : {0.0, 6.0}) {
    trail_ = Trail();
    back_off_ = BackOff(kMinClearance);
    swim_in({0, 0, -1 + rise}, {8, 0, -5 + rise});
    ASSERT_TRUE(begin());
    const std::optional<vehicle::Command> command = back_off_.follow(input());
    ASSERT_TRUE(command);
    EXPECT_EQ(command->d, rise == 0.0 ? 4.75 : 0.0);
  }
}

TEST_F(BackOffTest, CountsThePathFromWhereItArrived) {
  clearance_by_x([](double x) { return x > 6.3 ? 0.6 : 0.67; });
  EXPECT_FALSE(is_needed());
  swim_about(2.05);
  EXPECT_TRUE(is_needed());
  expect_goes_to(6.0);
  EXPECT_FALSE(is_needed());
  swim_about(1.95);
  EXPECT_FALSE(is_needed());
  swim_about(0.1);
  EXPECT_TRUE(is_needed());
}

TEST_F(BackOffTest, EndsWhenWhatIsAheadOfItIsBlocked) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  ASSERT_TRUE(begin());
  while (p_W().x() > 6.2) ASSERT_TRUE(tick());
  clearance_by_x([](double x) { return x > 7.0 ? -0.1 : 0.5; });
  EXPECT_TRUE(back_off_.follow(input())) << "that is behind it";
  clearance_by_x([](double x) { return x < 5.2 ? 0.0 : 0.5; });
  BehaviorInput unchanged = input();
  unchanged.map_changed = false;
  EXPECT_TRUE(back_off_.follow(unchanged));
  BehaviorInput without_map = input();
  without_map.observed = nullptr;
  EXPECT_TRUE(back_off_.follow(without_map));
  EXPECT_FALSE(back_off_.follow(input()));
  EXPECT_FALSE(back_off_.is_under_way());
}

TEST_F(BackOffTest, EndsWhenHalfOfTheClearanceOfTheWayBackIsLost) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  ASSERT_TRUE(begin());
  clearance_is(0.251);
  EXPECT_TRUE(back_off_.follow(input()));
  clearance_is(0.249);
  EXPECT_FALSE(back_off_.follow(input()));
  EXPECT_FALSE(back_off_.is_under_way());
}

TEST_F(BackOffTest, InAnUnknownEnvironmentEndsOnlyWhereItIsBlocked) {
  BackOffOptions unknown;
  unknown.kept_clearance = 0.0;
  back_off_ = BackOff(kMinClearance, unknown);
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  ASSERT_TRUE(begin());
  clearance_is(0.01);
  EXPECT_TRUE(back_off_.follow(input()));
  clearance_is(0.0);
  EXPECT_FALSE(back_off_.follow(input()));
}

TEST_F(BackOffTest, EndsAfterFifteenSecondsAndThreeTimesWhatItShouldTake) {
  clearance_by_x([](double x) { return x > 5.2 ? 0.5 : 0.9; });
  ASSERT_TRUE(begin());
  pass(15.0 + 3.0 * 3.0 / 0.15 - 0.01);
  EXPECT_TRUE(back_off_.follow(input()));
  pass(0.01);
  EXPECT_FALSE(back_off_.follow(input()));
  EXPECT_FALSE(back_off_.is_under_way());
}

TEST_F(BackOffTest, CountsHowOftenInARowItBeganWithinThreeMetres) {
  const auto count_at = [this](double x) { return back_off_.count_at({x, 0, -3}); };
  const auto back_off_from = [this](double x) {
    place_at(x);
    clearance_by_x([](double at_x) { return at_x > 2.2 ? 0.5 : 0.9; });
    expect_goes_to(2.0);
  };
  EXPECT_EQ(count_at(8.0), 0);
  back_off_from(8.0);
  EXPECT_EQ(count_at(8.0), 1);
  EXPECT_EQ(count_at(10.99), 1);
  EXPECT_EQ(count_at(11.01), 0);

  back_off_from(6.0);
  EXPECT_EQ(count_at(6.0), 2);
  EXPECT_EQ(count_at(9.01), 0) << "counted from the last place";
  place_at(6.0);
  clearance_is(0.5);
  EXPECT_FALSE(begin());
  EXPECT_EQ(count_at(6.0), 2) << "refused, it does not count";

  back_off_from(2.9);
  EXPECT_EQ(count_at(2.9), 1) << "another place";
  EXPECT_EQ(count_at(6.0), 0);
}

}  // namespace
}  // namespace dive::behaviors
