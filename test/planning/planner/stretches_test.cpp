// The division of a long path into stretches: on hand-made and on random patterns.

#include "planning/stretches.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/random.h"

namespace dive::planning {
namespace {

std::vector<bool> at(std::size_t count, const std::vector<std::size_t>& indices) {
  std::vector<bool> result(count);
  for (const std::size_t i : indices) result[i] = true;
  return result;
}

TEST(Stretches, HoldAMarginAroundWhatMovesAndEndWithThePath) {
  const std::vector<bool> none(100);
  EXPECT_TRUE(find_stretches(none, none).empty());
  const auto stretches = find_stretches(at(100, {2, 50, 55, 97}), at(100, {52}));
  ASSERT_EQ(stretches.size(), 3U);
  EXPECT_EQ(stretches[0].first, 0U);
  EXPECT_EQ(stretches[0].last, 8U);
  EXPECT_EQ(stretches[1].first, 44U);
  EXPECT_EQ(stretches[1].last, 61U);
  EXPECT_EQ(stretches[2].first, 91U);
  EXPECT_EQ(stretches[2].last, 99U);
}

TEST(Stretches, AreCutWhereNothingIsViolated) {
  const std::vector<bool> all(200, true);
  const std::vector<bool> none(200);
  EXPECT_EQ(find_stretches(none, all).size(), 1U) << "there is no waypoint that may stay";
  const auto stretches = find_stretches(all, none);
  ASSERT_GT(stretches.size(), 3U);
  for (const Stretch& stretch : stretches) EXPECT_LE(stretch.last - stretch.first, kLongStretch);
}

TEST(Stretches, HoldEveryWaypointThatMovesAndDoNotOverlap) {
  EXPECT_TRUE(rc::check([] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const double density = random.uniform(0.0, 0.3);
    std::vector<bool> pulled(150);
    std::vector<bool> violating(150);
    for (std::size_t i = 0; i < 150; ++i) {
      pulled[i] = random.uniform() < density;
      violating[i] = random.uniform() < density;
    }
    const auto stretches = find_stretches(pulled, violating);
    std::vector<int> held(150);
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      const auto [first, last] = stretches[k];
      RC_ASSERT(first < last);
      RC_ASSERT(last < 150U);
      if (k > 0) RC_ASSERT(stretches[k - 1].last <= first);
      RC_ASSERT(first == 0 || !violating[first]);
      RC_ASSERT(last == 149 || !violating[last]);
      for (std::size_t i = first; i <= last; ++i) ++held[i];
    }
    for (std::size_t i = 0; i < 150; ++i) RC_ASSERT(held[i] > 0 || (!pulled[i] && !violating[i]));
  }));
}

}  // namespace
}  // namespace dive::planning
