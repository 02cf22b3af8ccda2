#include "common/mathematics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"

namespace dive {
namespace {

using ::testing::StartsWith;

struct Function {
  std::string name;
  std::function<double(double)> pinned;
  std::function<long double(long double)> reference;
  double from;
  double to;
};

// libm's functions of long double are not pinned, and more exact than double.
std::vector<Function> functions() {
#define DIVE_BOTH(name) \
  [](double x) { return std::name(x); }, [](long double x) { return std::name(x); }
  return {{"sin", DIVE_BOTH(sin), -10.0, 10.0},     {"cos", DIVE_BOTH(cos), -10.0, 10.0},
          {"tan", DIVE_BOTH(tan), -1.5, 1.5},       {"asin", DIVE_BOTH(asin), -1.0, 1.0},
          {"acos", DIVE_BOTH(acos), -1.0, 1.0},     {"atan", DIVE_BOTH(atan), -9.0, 9.0},
          {"sinh", DIVE_BOTH(sinh), -9.0, 9.0},     {"cosh", DIVE_BOTH(cosh), -9.0, 9.0},
          {"tanh", DIVE_BOTH(tanh), -9.0, 9.0},     {"exp", DIVE_BOTH(exp), -50.0, 50.0},
          {"exp2", DIVE_BOTH(exp2), -50.0, 50.0},   {"expm1", DIVE_BOTH(expm1), -2.0, 2.0},
          {"log", DIVE_BOTH(log), 1e-9, 99.0},      {"log2", DIVE_BOTH(log2), 1e-9, 99.0},
          {"log10", DIVE_BOTH(log10), 1e-9, 99.0},  {"log1p", DIVE_BOTH(log1p), -0.9, 9.0},
          {"cbrt", DIVE_BOTH(cbrt), -99.0, 99.0},   {"erf", DIVE_BOTH(erf), -4.0, 4.0},
          {"erfc", DIVE_BOTH(erfc), -4.0, 9.0},     {"tgamma", DIVE_BOTH(tgamma), 0.1, 20.0},
          {"asinh", DIVE_BOTH(asinh), -99.0, 99.0}, {"acosh", DIVE_BOTH(acosh), 1.0, 99.0},
          {"atanh", DIVE_BOTH(atanh), -0.99, 0.99}};
#undef DIVE_BOTH
}

// Error in units in the last place of the reference.
double error_ulp(double result, long double reference) {
  const auto nearest = static_cast<double>(reference);
  const double ulp = std::nextafter(std::abs(nearest), INFINITY) - std::abs(nearest);
  return static_cast<double>(std::abs(static_cast<long double>(result) - reference)) / ulp;
}

TEST(Mathematics, FunctionsOfOneArgumentAreWithinTheirAccuracy) {
  Random random(1);
  for (const Function& f : functions()) {
    for (int i = 0; i < 2000; ++i) {
      const double x = random.uniform(f.from, f.to);
      ASSERT_LE(error_ulp(f.pinned(x), f.reference(static_cast<long double>(x))), 3.6)
          << f.name << "(" << x << ")";
    }
  }
}

TEST(Mathematics, FunctionsOfTwoArgumentsAreWithinTheirAccuracy) {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const double x = random.uniform(0.01, 9.0);
    const double y = random.uniform(-9.0, 9.0);
    const auto lx = static_cast<long double>(x);
    const auto ly = static_cast<long double>(y);
    ASSERT_LE(error_ulp(std::atan2(y, x), std::atan2(ly, lx)), 3.6) << y << ", " << x;
    ASSERT_LE(error_ulp(std::atan2(y, -x), std::atan2(ly, -lx)), 3.6) << y << ", " << -x;
    ASSERT_LE(error_ulp(std::hypot(x, y), std::hypot(lx, ly)), 3.6) << x << ", " << y;
    ASSERT_LE(error_ulp(std::pow(x, y), std::pow(lx, ly)), 1.1) << x << ", " << y;
  }
}

// Geometry relies on these.
TEST(Mathematics, RoundArgumentsGiveExactResults) {
  const volatile double zero = 0.0;
  const volatile double one = 1.0;
  EXPECT_EQ(std::sin(zero), 0.0);
  EXPECT_EQ(std::cos(zero), 1.0);
  EXPECT_EQ(std::atan2(zero, -one), M_PI);
  EXPECT_EQ(std::atan2(-zero, -one), -M_PI);
  EXPECT_EQ(std::atan2(one, zero), M_PI_2);
  EXPECT_EQ(std::acos(one), 0.0);
  EXPECT_EQ(std::acos(-one), M_PI);
  EXPECT_EQ(std::asin(one), M_PI_2);
  EXPECT_EQ(std::exp(zero), 1.0);
  EXPECT_EQ(std::log(one), 0.0);
  EXPECT_EQ(std::hypot(3.0 * one, 4.0 * one), 5.0);
  EXPECT_TRUE(std::isnan(std::acos(one + 1e-9)));
  EXPECT_TRUE(std::isnan(std::log(-one)));
  EXPECT_EQ(std::log(zero), -INFINITY);
  EXPECT_EQ(std::hypot(one, std::numeric_limits<double>::infinity()), INFINITY);
}

// The same on every machine, in every build: not what a compiler fuses or a CPU offers.
TEST(Mathematics, IsTheSameOnEveryMachine) {
  EXPECT_THAT(mathematics(), StartsWith("sleef-3.5.1/ca3c5c06117f0382/"))
      << "logs made before this change cannot be verified any more: if that is meant, enter it "
         "here";
}

}  // namespace
}  // namespace dive
