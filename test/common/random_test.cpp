#include "common/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dive {
namespace {

TEST(Random, SameSeedSameNumbersAndStreamsAreApart) {
  Random a(7);
  Random b(7);
  Random other_stream(7, 1);
  Random other_seed(8);
  for (int i = 0; i < 100; ++i) {
    const std::uint64_t bits = a.bits();
    EXPECT_EQ(bits, b.bits());
    EXPECT_NE(bits, other_stream.bits());
    EXPECT_NE(bits, other_seed.bits());
  }
}

TEST(Random, NormalHasTheMomentsOfANormal) {
  Random random(1);
  constexpr int kDraws = 200'000;
  double sum = 0;
  double squares = 0;
  double fourths = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.01);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.02);
  EXPECT_NEAR(fourths / kDraws, 3.0, 0.12);
}

TEST(Random, UniformStaysInItsInterval) {
  Random random(3);
  double low = 1.0;
  double high = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = random.uniform(-2.0, 5.0);
    ASSERT_GE(x, -2.0);
    ASSERT_LT(x, 5.0);
    low = std::min(low, x);
    high = std::max(high, x);
  }
  EXPECT_LT(low, -1.99);
  EXPECT_GT(high, 4.99);
}

}  // namespace
}  // namespace dive
