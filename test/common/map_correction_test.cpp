#include "common/map_correction.h"

#include <limits>

#include <gtest/gtest.h>

namespace dive {
namespace {

TEST(MapCorrection, GoesFromOneNodeToTheNextAndNoFarther) {
  const MapCorrection correction{{{0, {}}, {10, {0.2, {1.0, -2.0}}}}};
  EXPECT_EQ(correction.at(-3).translation.x(), 0.0);
  EXPECT_NEAR(correction.at(4).translation.x(), 0.4, 1e-12);
  EXPECT_NEAR(correction.at(4).translation.y(), -0.8, 1e-12);
  EXPECT_NEAR(correction.at(4).yaw, 0.08, 1e-12);
  EXPECT_NEAR(correction.at(99).translation.x(), 1.0, 1e-12);
  EXPECT_EQ(correction.newest().yaw, 0.2);
}

TEST(MapCorrection, IsRefusedWithoutOrderOrNodesOrNumbers) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(is_well_formed(MapCorrection{{{0, {}}, {10, {}}}}));
  EXPECT_FALSE(is_well_formed(MapCorrection{}));
  EXPECT_FALSE(is_well_formed(MapCorrection{{{10, {}}, {10, {}}}}));
  EXPECT_FALSE(is_well_formed(MapCorrection{{{0, {kNan, {0.0, 0.0}}}}}));
  EXPECT_FALSE(is_well_formed(MapCorrection{{{0, {0.0, {0.0, kNan}}}}}));
  EXPECT_FALSE(is_well_formed(MapCorrection{{{0, {0.0, {0.0, 1001.0}}}}}));
  MapCorrection too_many;
  for (Utime t = 0; t <= static_cast<Utime>(kMaxMapCorrectionNodes); ++t) {
    too_many.nodes.push_back({t, {}});
  }
  EXPECT_FALSE(is_well_formed(too_many));
}

}  // namespace
}  // namespace dive
