#include "estimation/map_fix_filter.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "common/random.h"
#include "common/se3.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTick = 0.02;

// A dive as the header's model describes it, in steps of its own: draws of heading, speed, current,
// slip and map error.
class Truth {
 public:
  Truth(const MapFixOptions& options, double start_sigma, std::uint64_t seed)
      : o_(options), random_(seed) {
    position_ = start_sigma * Vector2d(random_.normal(), random_.normal());
    heading_ = deg_to_rad(o_.heading_sigma_deg) * random_.normal();
    scale_ = o_.speed_scale_sigma * random_.normal();
    current_ = o_.current_sigma * Vector2d(random_.normal(), random_.normal());
    slip_ = o_.slip_sigma * Vector2d(random_.normal(), random_.normal());
    map_ = o_.map_sigma_m * Vector2d(random_.normal(), random_.normal());
  }

  // `moved_O` through the water, in m, whose current is not quite the declared one.
  void advance(const Vector2d& moved_O, const Vector2d& declared) {
    const Vector2d moved =
        (1.0 + scale_) * (Eigen::Rotation2Dd(heading_) * moved_O) + declared * kTick;
    position_ += moved + (current_ + slip_) * kTick + walk(o_.drift_m_per_sqrt_s);
    heading_ += deg_to_rad(o_.heading_walk_deg) * std::sqrt(kTick) * random_.normal();
    current_ += walk(o_.current_walk);
    fade(slip_, std::exp(-kTick / o_.slip_time_s), o_.slip_sigma);
    fade(map_, std::exp(-moved.norm() / o_.map_length_m), o_.map_sigma_m);
  }

  // A fix with noise of the covariance that it states, of one direction or of all three.
  MapFix fix() {
    MapFix fix;
    const Vector3d measured(position_.x() - map_.x(), position_.y() - map_.y(), heading_);
    Matrix3d information = Matrix3d::Zero();
    Vector3d noise = Vector3d::Zero();
    const bool is_wall = random_.uniform(0.0, 1.0) < 0.5;
    if (is_wall) {
      const double angle = random_.uniform(0.0, 3.1);
      const Vector3d across(std::cos(angle), std::sin(angle), 0.0);
      information = across * across.transpose() / (0.02 * 0.02);
      noise = 0.02 * random_.normal() * across;
    } else {
      const Vector3d sigma(0.02, 0.05, 0.01);
      information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
      noise = sigma.cwiseProduct(Vector3d(random_.normal(), random_.normal(), random_.normal()));
    }
    // Linearised somewhere else than at its maximum.
    const Vector3d off(0.03, -0.02, 0.01);
    fix.position_W = (measured + off).head<2>();
    fix.heading_correction = measured.z() + off.z();
    fix.information = information;
    fix.gradient = information * (noise - off);
    return fix;
  }

  [[nodiscard]] Vector3d pose() const { return {position_.x(), position_.y(), heading_}; }

 private:
  Vector2d walk(double sigma) {
    return sigma * std::sqrt(kTick) * Vector2d(random_.normal(), random_.normal());
  }
  void fade(Vector2d& value, double kept, double sigma) {
    value = kept * value +
            sigma * std::sqrt(1.0 - kept * kept) * Vector2d(random_.normal(), random_.normal());
  }

  MapFixOptions o_;
  Random random_;
  Vector2d position_, current_, slip_, map_;
  double heading_ = 0.0, scale_ = 0.0;
};

// Out, around and back at 0.4 m/s.
Vector2d moved_at(double t) {
  const double course = 0.05 * t;
  return 0.4 * kTick * Vector2d(std::cos(course), std::sin(course));
}

struct Outcome {
  double nees = 0.0;
  double error_m = 0.0;
};

// A tide of `tide` m/s that turns within a minute.
Vector2d tide_at(double tide, double t) {
  return tide * Vector2d(std::cos(0.05 * t), std::sin(0.05 * t));
}

Outcome dive(std::uint64_t seed, double seconds, double fix_period_s, double tide = 0.0) {
  const MapFixOptions options;
  constexpr double kStart = 0.15;
  Truth truth(options, kStart, seed);
  MapFixFilter filter(options);
  filter.begin(Vector2d::Zero(), kStart * kStart);
  double next_fix = fix_period_s;
  for (double t = 0.0; t < seconds; t += kTick) {
    const Vector2d declared = tide_at(tide, t);
    truth.advance(moved_at(t), declared);
    filter.set_current(declared);
    filter.advance(moved_at(t) + declared * kTick, Vector2d::Zero(), kTick, 0.0);
    if (t < next_fix) continue;
    next_fix += fix_period_s;
    filter.apply(truth.fix(), Vector2d::Zero(), Vector2d::Zero());
  }
  const Vector3d error = truth.pose() - Vector3d(filter.position_W().x(), filter.position_W().y(),
                                                 filter.heading_correction());
  return {error.dot(filter.covariance().ldlt().solve(error)) / 3.0, error.head<2>().norm()};
}

// Mean of e' P^-1 e over its three degrees of freedom: 1, with a sigma of 0.06 over 200 dives.
TEST(MapFixFilter, ItsCovarianceIsThatOfItsError) {
  for (const auto& [seconds, period] :
       {std::pair{30.0, 1e9}, std::pair{120.0, 0.5}, std::pair{120.0, 10.0}}) {
    double sum = 0.0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) sum += dive(seed, seconds, period).nees;
    EXPECT_NEAR(sum / 200.0, 1.0, 0.25) << seconds << " s, a fix every " << period << " s";
  }
}

// Heading and speed are off, the declared current is not.
TEST(MapFixFilter, ItsCovarianceIsThatOfItsErrorInADeclaredTide) {
  for (const auto& [seconds, period] : {std::pair{60.0, 1e9}, std::pair{120.0, 10.0}}) {
    double sum = 0.0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) sum += dive(seed, seconds, period, 0.3).nees;
    EXPECT_NEAR(sum / 200.0, 1.0, 0.25) << seconds << " s, a fix every " << period << " s";
  }
}

TEST(MapFixFilter, TheMeanOfItsCurrentMovesWithTheDeclaredOne) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin(Vector2d::Zero(), 1e-4);
  filter.set_current({0.1, 0.0});
  EXPECT_TRUE(
      filter.apply_velocity({0.12, 0.0}, 1e6 * Matrix2d::Identity(), {0.1, 0.0}, {0.0, 0.0}));
  const Vector2d learned = filter.current_W() - Vector2d(0.1, 0.0);
  EXPECT_GT(learned.x(), 0.005) << "a part of what it measured; the rest is slip";
  filter.set_current({-0.1, 0.05});
  EXPECT_LT((filter.current_W() - Vector2d(-0.1, 0.05) - learned).norm(), 1e-12);
}

TEST(MapFixFilter, FixesBoundTheError) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_LT(dive(seed, 300.0, 0.5).error_m, 0.2) << seed;
  }
}

TEST(MapFixFilter, LearnsTheCurrent) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin({1.0, 2.0}, 1e-4);
  const Vector2d current(0.05, -0.03);
  for (int tick = 1; tick <= 3000; ++tick) {
    filter.advance(Vector2d::Zero(), Vector2d::Zero(), kTick, 0.0);
    if (tick % 25 != 0) continue;
    MapFix fix;
    fix.position_W = Vector2d(1.0, 2.0) + current * tick * kTick;
    fix.information.diagonal() << 1e4, 1e4, 1e4;
    filter.apply(fix, Vector2d::Zero(), Vector2d::Zero());
  }
  EXPECT_LT((filter.drift_W() - current).norm(), 0.01);
  const Vector2d before = filter.position_W();
  for (int tick = 0; tick < 250; ++tick)
    filter.advance(Vector2d::Zero(), Vector2d::Zero(), kTick, 0.0);
  EXPECT_LT((filter.position_W() - before - 5.0 * current).norm(), 0.06) << "without fixes";
}

TEST(MapFixFilter, AFixOfAnEarlierPlaceIsAppliedWhereItWasTaken) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin({0.0, 0.0}, 0.01);
  for (int tick = 0; tick < 50; ++tick) filter.advance({0.008, 0.0}, Vector2d::Zero(), kTick, 0.0);
  const Vector2d expected = filter.position_W() - Vector2d(0.2, 0.0);
  MapFix fix;
  fix.position_W = expected;
  fix.information.diagonal() << 1e6, 1e6, 1e6;
  const Vector2d moved = filter.apply(fix, {0.2, 0.0}, Vector2d::Zero());
  EXPECT_LT(moved.norm(), 1e-6);
}

TEST(MapFixFilter, NothingChangesWithoutInformation) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin({1.0, 2.0}, 0.04);
  const Matrix3d before = filter.covariance();
  MapFix fix;
  fix.position_W = {50.0, -20.0};
  EXPECT_EQ(filter.apply(fix, Vector2d::Zero(), Vector2d::Zero()), Vector2d::Zero());
  EXPECT_TRUE(filter.covariance().isApprox(before, 1e-12));
}

TEST(MapFixFilter, AVelocityOverGroundShowsWhatTheOdometryLacks) {
  MapFixOptions options;
  options.current_sigma = 0.1;
  MapFixFilter filter{options};
  filter.begin({0.0, 0.0}, 0.01);
  const Vector2d v_O(0.4, 0.0);
  const Vector2d current(0.06, -0.05);
  const Matrix2d across = Vector2d(0.0, 1.0) * Vector2d(0.0, 1.0).transpose() / (0.02 * 0.02);
  for (int tick = 0; tick < 500; ++tick) {
    filter.advance(v_O * kTick, Vector2d::Zero(), kTick, 0.0);
    if (tick % 25 == 0) {
      EXPECT_TRUE(filter.apply_velocity(v_O + current, across, v_O, Vector2d::Zero()));
    }
  }
  EXPECT_NEAR(filter.drift_W().y(), current.y(), 0.01);
  EXPECT_EQ(filter.drift_W().x(), 0.0) << "no information along the wall";
  EXPECT_NEAR(filter.position_W().x(), 4.0, 1e-3);
  EXPECT_NEAR(filter.position_W().y(), -0.5, 0.15);
}

TEST(MapFixFilter, AVelocityThatNothingExplainsIsRefused) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin({0.0, 0.0}, 0.01);
  const Matrix3d before = filter.covariance();
  EXPECT_FALSE(
      filter.apply_velocity({0.4, 0.8}, 1e4 * Matrix2d::Identity(), {0.4, 0.0}, {0.0, 0.0}))
      << "from one pipe to the next in half a second";
  EXPECT_EQ(filter.drift_W(), Vector2d::Zero());
  EXPECT_EQ(filter.covariance(), before);
}

TEST(MapFixFilter, TimesWithoutSensorsMakeItUncertain) {
  MapFixFilter filter{MapFixOptions{}};
  filter.begin({0.0, 0.0}, 0.04);
  const double before = filter.covariance()(0, 0);
  filter.advance(Vector2d::Zero(), Vector2d::Zero(), kTick, 0.25);
  EXPECT_GT(filter.covariance()(0, 0), before + 0.25);
}

}  // namespace
}  // namespace dive::estimation
