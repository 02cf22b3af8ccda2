#include "estimation/motion_fit/motion_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "estimation/motion_fit/open_loop.h"
#include "test/estimation/motion_fit/synthetic_dive.h"

namespace dive::estimation {
namespace {

using ::testing::HasSubstr;
using testing::record_of;
using testing::SyntheticDive;

constexpr std::array<double, 2> kHorizons_s{10.0, 30.0};

/// Another vehicle: every coefficient of the equations differs by about 15 %.
MotionModel other_vehicle(std::uint64_t seed) {
  Random random(seed, 0x0de1);
  MotionModel model;
  for (const MotionCoefficient& c : motion_coefficients().first(kEquationCoefficients)) {
    c.of(model) *= std::exp(std::clamp(0.15 * random.normal(), -0.3, 0.3));
  }
  return model;
}

std::vector<MotionRecord> dives_of(const MotionModel& truth, std::uint64_t first, int dives) {
  std::vector<MotionRecord> records;
  Random random(first, 0xc0);
  for (int i = 0; i < dives; ++i) {
    SyntheticDive dive{.truth = truth, .seed = first + static_cast<std::uint64_t>(i)};
    dive.current_W = {0.05 * random.normal(), 0.05 * random.normal()};
    records.push_back(record_of(dive));
  }
  return records;
}

TEST(MotionFit, RecoversTheCoefficientsWithinTheirStandardDeviations) {
  constexpr int kVehicles = 5;
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= kVehicles; ++seed) {
    const MotionModel truth = other_vehicle(seed);
    const auto fit = fit_motion(dives_of(truth, 100 * seed, 3), MotionModel{}, {});
    ASSERT_TRUE(fit) << fit.error();
    EXPECT_TRUE(fit->converged);
    for (std::size_t i = 0; i < kEquationCoefficients; ++i) {
      const MotionCoefficient& c = motion_coefficients()[i];
      const FittedCoefficient& fitted = fit->coefficients[i];
      ASSERT_TRUE(fitted.is_constrained) << c.name;
      EXPECT_LT(fitted.sigma, 0.25 * std::abs(c.value(truth))) << c.name;
      const double off = (fitted.value - c.value(truth)) / fitted.sigma;
      EXPECT_LT(std::abs(off), 4.5) << c.name << " of vehicle " << seed << ": " << fitted.value
                                    << " +- " << fitted.sigma << ", true " << c.value(truth);
      squares += off * off;
      ++count;
    }
  }
  // The mean of 60 squares of standard normal numbers: 99.9 % lie within 0.49 and 1.71, if they
  // were independent.
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(squares / count, 1.8);
}

TEST(MotionFit, HalvesTheOpenLoopErrorOnDivesThatItHasNotSeen) {
  const MotionModel truth = other_vehicle(11);
  const auto fit = fit_motion(dives_of(truth, 1, 3), MotionModel{}, {});
  ASSERT_TRUE(fit);
  const std::vector<MotionRecord> unseen = dives_of(truth, 51, 2);
  const auto before = open_loop_errors(unseen, MotionModel{}, kHorizons_s, Drift::kIsCurrent);
  const auto after = open_loop_errors(unseen, fit->model, kHorizons_s, Drift::kIsCurrent);
  const auto best = open_loop_errors(unseen, truth, kHorizons_s, Drift::kIsCurrent);
  for (std::size_t i = 0; i < kHorizons_s.size(); ++i) {
    ASSERT_GT(after[i].errors_m.size(), 100U);
    EXPECT_LT(after[i].quantile(0.5), 0.5 * before[i].quantile(0.5)) << kHorizons_s[i];
    EXPECT_LT(after[i].quantile(0.5), 1.2 * best[i].quantile(0.5)) << kHorizons_s[i];
  }
}

TEST(MotionFit, KeepsWhatTheDivesDoNotConstrain) {
  const MotionModel truth = other_vehicle(5);
  std::vector<MotionRecord> records;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    records.push_back(
        record_of({.truth = truth, .seed = seed, .turning = 0.0, .heave = 0.0}));  // straight on
  }
  const auto fit = fit_motion(records, MotionModel{}, {});
  ASSERT_TRUE(fit) << fit.error();
  for (std::size_t i = 0; i < kEquationCoefficients; ++i) {
    const std::string name = motion_coefficients()[i].name;
    const FittedCoefficient& c = fit->coefficients[i];
    if (name == "full_speed" || name == "surge_coast_m") {
      EXPECT_TRUE(c.is_constrained) << name;
      EXPECT_NEAR(c.value, motion_coefficients()[i].value(truth), 4.5 * c.sigma) << name;
    }
    if (name == "full_heave" || name == "sway_tail_lift_m" || name == "tail_m" ||
        name == "sway_mass_ratio") {
      EXPECT_FALSE(c.is_constrained) << name;
      EXPECT_EQ(c.value, c.before) << name;
      EXPECT_EQ(c.sigma, 0.0) << name;
    }
  }
}

TEST(MotionFit, RefusesTooLittle) {
  const std::vector<MotionRecord> records{record_of({.truth = {}, .duration_s = 121.0})};
  const auto fit = fit_motion(records, MotionModel{}, {});
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error(), HasSubstr("too little to fit: 12 windows of 10 s"));
  EXPECT_THAT(fit.error(), HasSubstr("record 40 s more"));
}

TEST(MotionFit, LeavesOutTimesWithoutAttitudeAndAtTheSurface) {
  MotionRecord record = record_of({.truth = {}, .duration_s = 121.0});
  const int all = usable_windows(record, {});
  EXPECT_EQ(all, 12);
  for (MotionTick& tick : record.ticks) {
    if (tick.now > 40'000'000 && tick.now < 45'000'000) tick.imu.reset();
    if (tick.now > 90'000'000 && tick.depth) tick.depth->depth_m = 0.1;
  }
  EXPECT_EQ(usable_windows(record, {}), 7) << "4 before the gap, 4 after it, less one";
}

TEST(OpenLoop, SlipIsThatOfTheMotionWithoutTheFixesNoise) {
  MotionModel model;
  const std::vector<MotionRecord> exact{record_of({.truth = model, .seed = 3, .turning = 0.15})};
  const auto none = slip_sigmas(exact, model);
  ASSERT_TRUE(none[0] && none[1]);
  EXPECT_LT(std::max(*none[0], *none[1]), 0.01) << "the noise of the fixes is no slip";
  model.full_speed *= 1.1;
  const auto slip = slip_sigmas(exact, model);
  EXPECT_GT(*slip[0], 0.015) << "4 cm/s too fast along x";
  EXPECT_GT(*slip[0], 1.5 * *slip[1]);
}

}  // namespace
}  // namespace dive::estimation
