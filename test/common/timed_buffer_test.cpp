#include "common/timed_buffer.h"

#include <gtest/gtest.h>

#include "common/assert.h"

namespace dive {
namespace {

using Buffer = TimedBuffer<double, 4>;

// The value is the time in ms, so that interpolation must return the requested time.
Buffer filled(int count) {
  Buffer buffer;
  for (int i = 1; i <= count; ++i) buffer.push(10'000 * i, 10.0 * i);
  return buffer;
}

double interpolated(const Buffer& buffer, Utime utime) {
  const auto around = buffer.at(utime);
  return around ? *around->before + around->share * (*around->after - *around->before) : -1.0;
}

TEST(TimedBuffer, FindsTheEntriesAroundATime) {
  const Buffer buffer = filled(3);
  EXPECT_EQ(interpolated(buffer, 10'000), 10.0);
  EXPECT_NEAR(interpolated(buffer, 14'000), 14.0, 1e-12);
  EXPECT_NEAR(interpolated(buffer, 29'999), 29.999, 1e-12);
  EXPECT_EQ(interpolated(buffer, 30'000), 30.0);
  EXPECT_EQ(buffer.newest(), 30.0);
}

TEST(TimedBuffer, IsEmptyBeforeItsOldestAndAfterItsNewestEntry) {
  EXPECT_FALSE(Buffer{}.at(0));
  const Buffer buffer = filled(9);
  EXPECT_FALSE(buffer.at(59'999));
  EXPECT_EQ(interpolated(buffer, 60'000), 60.0);
  EXPECT_EQ(interpolated(buffer, 75'000), 75.0);
  EXPECT_FALSE(buffer.at(90'001));
}

TEST(TimedBuffer, DemandsTimeThatDoesNotRunBackwards) {
  Buffer buffer = filled(2);
  buffer.push(20'000, 21.0);
  EXPECT_EQ(interpolated(buffer, 20'000), 21.0) << "the newer one of the same time";
  EXPECT_THROW(buffer.push(19'999, 0.0), AssertionFailure);
}

}  // namespace
}  // namespace dive
