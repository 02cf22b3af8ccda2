#include "estimation/visual_inertial/loop_closure/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "test/estimation/visual_inertial/loop_closure/marked_world.h"

namespace dive::estimation {
namespace {

using dive::testing::MarkedWorld;
using Eigen::Matrix4d;
using Eigen::Vector3d;

constexpr double kRadius = 4.0;  // m, radius of the circle
constexpr double kSpeed = 0.4;   // m/s
constexpr double kStep = 0.6;    // m, between keyframes
constexpr double kTilt = 0.002;  // rad, one sigma of the filter's roll and pitch

Pose on_circle(double metres) {
  const double angle = metres / kRadius;
  return {{kRadius * std::cos(angle), kRadius * std::sin(angle), -5.0},
          from_rpy(0.05, 0.1, angle + M_PI / 2)};
}

// A filter's estimates along the circle: growing errors, and their covariance.
class Filter {
 public:
  Filter(double step_sigma, double turn_sigma, std::uint64_t seed)
      : step_(step_sigma), turn_(turn_sigma), random_(seed, 3) {}

  [[nodiscard]] StateEstimate at(double metres) {
    const Pose truth = on_circle(metres);
    if (last_) {
      const Vector3d d = truth.p - last_->p;
      P_ = carried(d) * P_ * carried(d).transpose();
      P_.diagonal() += Vector4d(step_ * step_, step_ * step_, 0.0, turn_ * turn_);
      const Eigen::Quaterniond q(Eigen::AngleAxisd(error_[3], Vector3d::UnitZ()));
      error_.head<3>() +=
          q * d - d + Vector3d(step_ * random_.normal(), step_ * random_.normal(), 0.0);
      error_[3] += turn_ * random_.normal();
    }
    last_ = truth;
    StateEstimate estimate;
    estimate.utime = from_seconds(metres / kSpeed);
    estimate.valid = true;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(error_[3], Vector3d::UnitZ()));
    estimate.X_WB = {
        truth.p + error_.head<3>(),
        q * so3_exp({kTilt * random_.normal(), kTilt * random_.normal(), 0}) * truth.q};
    estimate.covariance.topLeftCorner<3, 3>() = P_.topLeftCorner<3, 3>();
    Eigen::Matrix3d attitude = Vector3d(kTilt * kTilt, kTilt * kTilt, P_(3, 3)).asDiagonal();
    const Eigen::Matrix3d R = estimate.X_WB.q.toRotationMatrix();
    estimate.covariance.bottomRightCorner<3, 3>() = R.transpose() * attitude * R;
    estimate.covariance.topRightCorner<3, 3>().noalias() =
        P_.topRightCorner<3, 1>() * Vector3d::UnitZ().transpose() * R;
    estimate.covariance.bottomLeftCorner<3, 3>() =
        estimate.covariance.topRightCorner<3, 3>().transpose();
    return estimate;
  }

 private:
  double step_;
  double turn_;
  Random random_;
  Matrix4d P_ = Vector4d(1e-6, 1e-6, 1e-4, 1e-8).asDiagonal();
  Vector4d error_ = Vector4d::Zero();
  std::optional<Pose> last_;
};

LoopCloserOptions options() {
  LoopCloserOptions result;
  result.pixels_now = 0.7;
  result.keyframe_m = 0.9 * kStep;
  return result;
}

LoopCloser closer(const LoopCloserOptions& with = options()) {
  return {with, MarkedWorld::camera(0), MarkedWorld::camera(1)};
}

MarkedWorld around_the_circle(Random& random) {
  MarkedWorld world;
  world.add(3000, {-9, -9, -8}, {9, 9, -3}, random);
  return world;
}

struct Swum {
  int closures = 0;
  int wrong = 0;
  std::optional<LoopCorrection> last;
  StateEstimate end;
};

// `view_at`: the view after that many metres; the corrected poses are compared with the circle.
template <typename ViewAt>
Swum swim(LoopCloser& loops, Filter& filter, double metres, const ViewAt& view_at) {
  Swum swum;
  for (double at = 0.0; at <= metres; at += kStep) {
    swum.end = filter.at(at);
    auto found = loops.add(view_at(at), swum.end);
    if (!found) continue;
    ++swum.closures;
    const LoopClosure& c = found->closure;
    const Pose truth = on_circle(to_seconds(c.utime_old) * kSpeed).inverse() *
                       on_circle(to_seconds(c.utime_new) * kSpeed);
    if ((truth.p - c.X_B0B1.p).norm() > 0.15) ++swum.wrong;
    swum.last = std::move(found);
  }
  return swum;
}

TEST(LoopCloser, SecondLapClosesLoopsAndRemovesTheDrift) {
  double before = 0.0;
  double after = 0.0;
  double nees = 0.0;
  constexpr int kRuns = 2;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Random random(seed);
    const MarkedWorld world = around_the_circle(random);
    Filter filter(0.01, 0.003, seed);
    LoopCloser loops = closer();
    const double metres = 2.0 * 2.0 * M_PI * kRadius;
    const Swum swum = swim(loops, filter, metres, [&](double at) {
      return world.view(from_seconds(at / kSpeed), on_circle(at), random);
    });
    EXPECT_GT(swum.closures, 20);
    EXPECT_EQ(swum.wrong, 0);
    ASSERT_TRUE(swum.last);
    const Pose truth = on_circle(to_seconds(swum.end.utime) * kSpeed);
    const StateEstimate corrected = swum.last->apply(swum.end);
    before += (truth.p - swum.end.X_WB.p).norm() / kRuns;
    const Eigen::Vector2d error = (truth.p - corrected.X_WB.p).head<2>();
    after += error.norm() / kRuns;
    nees += error.dot(corrected.covariance.topLeftCorner<2, 2>().llt().solve(error)) / kRuns;
    // The map moves too, including observations at the end of the first lap.
    const Utime lap = from_seconds(0.49 * metres / kSpeed);
    EXPECT_LT(swum.last->map_correction.at(lap).translation.norm(), 0.5);
  }
  EXPECT_GT(before, 0.08);
  EXPECT_LT(after, 0.03);
  EXPECT_LT(nees, 4.0);  // expected value 2
}

TEST(LoopCloser, SameCallsSameResults) {
  std::vector<Pose> results;
  for (int run = 0; run < 2; ++run) {
    Random random(9);
    const MarkedWorld world = around_the_circle(random);
    Filter filter(0.01, 0.003, 9);
    LoopCloser loops = closer();
    const Swum swum = swim(loops, filter, 32.0, [&](double at) {
      return world.view(from_seconds(at / kSpeed), on_circle(at), random);
    });
    ASSERT_TRUE(swum.last);
    results.push_back(swum.last->correction);
  }
  EXPECT_EQ(results[0].p, results[1].p);
  EXPECT_EQ(results[0].q.coeffs(), results[1].q.coeffs());
}

// Every place resembles the first one at the other side of the circle, where it never was: 8 m
// away.
TEST(LoopCloser, TheSamePatternElsewhereIsNoLoop) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    const MarkedWorld world = around_the_circle(random);
    Filter filter(0.01, 0.003, seed);
    LoopCloser loops = closer();
    const double half = M_PI * kRadius;
    const Swum swum = swim(loops, filter, 2.0 * half - 1.0, [&](double at) {
      return world.view(from_seconds(at / kSpeed), on_circle(std::fmod(at, half)), random);
    });
    EXPECT_EQ(swum.closures, 0);
  }
}

// On the second lap everything is matched 0.6 m beside its place, as in a row of equal windows.
// Appearance and geometry permit it; the filter's covariance does not.
TEST(LoopCloser, ARepetitionFartherOffThanTheFilterCanBeIsNoLoop) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    Random random(seed);
    const MarkedWorld world = around_the_circle(random);
    Filter filter(0.002, 0.0005, seed);
    LoopCloser loops = closer();
    const double lap = 2.0 * M_PI * kRadius;
    const Swum swum = swim(loops, filter, 1.6 * lap, [&](double at) {
      // Not the end of the first lap, where the beginning is in view.
      if (at > lap - 5.0 && at < lap) return KeyframeView{from_seconds(at / kSpeed), {}};
      return world.view(from_seconds(at / kSpeed), on_circle(at > lap ? at + 0.6 : at), random);
    });
    EXPECT_EQ(swum.closures, 0);
    EXPECT_GT(loops.report().refused, 0);
  }
}

// As if the walls had been turned over: the points contradict gravity in roll.
TEST(LoopCloser, APlaceThatLeansIsNoLoop) {
  Random random(4);
  const MarkedWorld world = around_the_circle(random);
  Filter filter(0.002, 0.0005, 4);
  LoopCloser loops = closer();
  const double lap = 2.0 * M_PI * kRadius;
  int refused = 0;
  const Swum swum = swim(loops, filter, 1.3 * lap, [&](double at) {
    refused += loops.report().refused;
    if (at > lap - 5.0 && at < lap) return KeyframeView{from_seconds(at / kSpeed), {}};
    const Pose lean{Vector3d::Zero(), from_rpy(at > lap ? 0.1 : 0.0, 0, 0)};
    return world.view(from_seconds(at / kSpeed), on_circle(at) * lean, random);
  });
  EXPECT_EQ(swum.closures, 0);
  EXPECT_GT(refused, 0);
}

// Both the place and its copy were observed, and the filter cannot distinguish them.
TEST(LoopCloser, TwoPlacesThatFitAreNone) {
  Random random(5);
  MarkedWorld world;
  world.add(400, {1.5, -3, -7}, {5.5, 3, -3}, random);
  LoopCloser loops = closer();
  StateEstimate estimate;
  estimate.valid = true;
  estimate.X_WB.p = {0, 0, -5};
  const auto sure = [&](double sigma) {
    estimate.covariance.setZero();
    estimate.covariance.diagonal() << sigma * sigma, sigma * sigma, 1e-4, 1e-6, 1e-6, 1e-4;
  };
  const auto add = [&](double seconds, double x, double y) {
    estimate.utime = from_seconds(seconds);
    estimate.X_WB.p.x() = x;
    estimate.X_WB.p.y() = y;
    return loops.add(
        world.view(estimate.utime, {{x < 0.5 ? x : 0.7, 0, -5}, Eigen::Quaterniond::Identity()},
                   random),
        estimate);
  };
  sure(0.01);
  (void)add(0.0, 0.0, 0.0);
  (void)add(2.0, 0.7, 0.0);
  (void)add(20.0, 0.0, 2.4);  // same view as at (0, 0)
  (void)add(22.0, 0.7, 2.4);
  sure(2.0);
  EXPECT_FALSE(add(100.0, 0.0, 1.2));
  EXPECT_EQ(loops.report().verified, 4);
  EXPECT_TRUE(loops.report().is_ambiguous);
  EXPECT_FALSE(add(102.0, 0.7, 1.2));
}

TEST(LoopCloser, OneRecognitionIsNotEnough) {
  Random random(6);
  const MarkedWorld world = around_the_circle(random);
  Filter filter(0.005, 0.001, 6);
  LoopCloser loops = closer();
  const double lap = 2.0 * M_PI * kRadius;
  int seen = 0;
  const Swum swum = swim(loops, filter, 1.5 * lap, [&](double at) {
    // On the second lap only every fifth keyframe has a view.
    if (at > lap - 5.0 && ++seen % 5 != 0) return KeyframeView{from_seconds(at / kSpeed), {}};
    return world.view(from_seconds(at / kSpeed), on_circle(at), random);
  });
  EXPECT_EQ(swum.closures, 0);
}

TEST(LoopCloser, MemoryIsBoundedAndLoopsAreStillClosed) {
  Random random(7);
  const MarkedWorld world = around_the_circle(random);
  Filter filter(0.01, 0.003, 7);
  LoopCloserOptions with = options();
  with.max_keyframes = 30;
  LoopCloser loops = closer(with);
  const Swum swum = swim(loops, filter, 4.0 * M_PI * kRadius, [&](double at) {
    EXPECT_LE(loops.graph().nodes().size(), 30U);
    return world.view(from_seconds(at / kSpeed), on_circle(at), random);
  });
  EXPECT_GT(swum.closures, 3);
  EXPECT_EQ(swum.wrong, 0);
}

// The heading drifts by some hundredths of a radian: its correction moves an origin 10 km away by
// hundreds of metres, and one 200 km away by kilometres.
TEST(LoopCloser, ClosesLoopsFarFromTheOriginAndRefusesAMoveOfTheMapBeyondItsLimit) {
  for (const double from_origin_m : {10e3, 200e3}) {
    Random random(9);
    const MarkedWorld world = around_the_circle(random);
    Filter filter(0.01, 0.01, 9);
    LoopCloser loops = closer();
    int closures = 0;
    double largest = 0.0;
    for (double at = 0.0; at <= 4.0 * M_PI * kRadius; at += kStep) {
      StateEstimate estimate = filter.at(at);
      estimate.X_WB.p.x() += from_origin_m;
      const auto found =
          loops.add(world.view(from_seconds(at / kSpeed), on_circle(at), random), estimate);
      if (!found) continue;
      ++closures;
      ASSERT_TRUE(is_well_formed(found->map_correction));
      largest = std::max(largest, found->map_correction.newest().translation.norm());
    }
    if (from_origin_m < 100e3) {
      EXPECT_GT(closures, 3);
      EXPECT_GT(largest, 100.0);
    } else {
      EXPECT_EQ(closures, 0);
      EXPECT_TRUE(loops.graph().loops().empty());
    }
  }
}

TEST(LoopCloser, TakesNoKeyframeThatIsNotDueAndNoneThatIsNotFinite) {
  Random random(8);
  const MarkedWorld world = around_the_circle(random);
  LoopCloser loops = closer();
  Filter filter(0.01, 0.003, 8);
  StateEstimate estimate = filter.at(0.0);
  EXPECT_TRUE(loops.is_due(estimate));
  (void)loops.add(world.view(0, on_circle(0), random), estimate);
  estimate.utime += 1'000'000;
  EXPECT_FALSE(loops.is_due(estimate));
  estimate.X_WB.p.x() += 1.0;
  EXPECT_TRUE(loops.is_due(estimate));
  StateEstimate bad = estimate;
  bad.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(loops.is_due(bad));
  bad = estimate;
  bad.valid = false;
  EXPECT_FALSE(loops.is_due(bad));
  bad = estimate;
  bad.utime = 0;
  EXPECT_FALSE(loops.is_due(bad));
  EXPECT_FALSE(loops.add({}, bad));
  EXPECT_EQ(loops.graph().nodes().size(), 1U);
  loops.restart();
  EXPECT_TRUE(loops.graph().nodes().empty());
}

TEST(LoopCloser, OptionsOutOfRangeAreNamed) {
  LoopCloserOptions with;
  EXPECT_EQ(with.validate(), "");
  with.gate = -1.0;
  EXPECT_NE(with.validate().find("gate"), std::string::npos);
  with = {};
  with.min_matches = 100;  // of 80
  EXPECT_NE(with.validate().find("min_matches"), std::string::npos);
}

}  // namespace
}  // namespace dive::estimation
