#include "common/range_check.h"

#include <limits>

#include <gtest/gtest.h>

namespace dive {
namespace {

TEST(RangeCheck, FindsNothingWrongWithWhatIsInItsRange) {
  RangeCheck check;
  check("lowest", 1.0, 1.0, 2.0);
  check("highest", 2.0, 1.0, 2.0);
  check("only", 0.0, 0.0, 0.0);
  EXPECT_EQ(check.problem(), "");
}

TEST(RangeCheck, ReportsTheFirstThatIsNot) {
  RangeCheck check;
  check("sound", 1.5, 1.0, 2.0);
  check("speed", 5.25, 0.0, 5.0);
  check("mass", -1.0, 0.0, 100.0);
  EXPECT_EQ(check.problem(), "speed is 5.25 but must be from 0 to 5");
}

TEST(RangeCheck, LetsNoNanPass) {
  RangeCheck check;
  check("speed", std::numeric_limits<double>::quiet_NaN(), -1e300, 1e300);
  EXPECT_EQ(check.problem(), "speed is nan but must be from -1e+300 to 1e+300");
}

}  // namespace
}  // namespace dive
