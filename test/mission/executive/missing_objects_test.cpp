#include "mission/executive/missing_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::HasSubstr;

planning::World world() {
  planning::World world;
  world.obstacles.push_back({"floor", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, {}});
  world.obstacles.push_back({"mast", planning::Sphere{0.5}, {}});
  world.obstacles.push_back({"hull", planning::Sphere{0.1}, {}, 0});
  world.obstacles.push_back({"hull", planning::Sphere{0.1}, {}, 0});
  world.surfaces.push_back({"hull", {}});
  return world;
}

TEST(MissingObjects, EachIsReportedOnceWhenSeveralScansSeeThroughIt) {
  const planning::World known = world();
  MissingObjects missing(known, false);
  for (int scan = 0; scan < 3; ++scan) {
    EXPECT_FALSE(missing.observe(1));
    EXPECT_FALSE(missing.observe(2));
  }
  EXPECT_THAT(missing.observe(1).value_or(""), HasSubstr("'mast'"));
  EXPECT_THAT(missing.observe(2).value_or(""), HasSubstr("'hull'"));
  EXPECT_FALSE(missing.observe(1));
}

TEST(MissingObjects, AnObjectThatTheMapDoesNotHaveIsIgnored) {
  const planning::World known = world();
  MissingObjects missing(known, false);
  for (int scan = 0; scan < 10; ++scan) {
    EXPECT_FALSE(missing.observe(-1));
    EXPECT_FALSE(missing.observe(4)) << "from a log that another program wrote";
  }
}

TEST(MissingObjects, DescribesWhatLeavesTheMapAndWhatComesBack) {
  const planning::World known = world();
  const MissingObjects missing(known, true);
  EXPECT_EQ(missing.describe({1, 1, true, 9, 0.615}),
            "'mast' is gone: 9 scans saw through 62 % of it; only the rest remains an obstacle");
  EXPECT_THAT(missing.describe({2, 2, false}).value_or(""), HasSubstr("'hull' is observed"));
  EXPECT_FALSE(missing.describe({4, 1, true}));
  EXPECT_FALSE(missing.describe({-1, 1, true}));
}

TEST(MissingObjects, SaysWhetherItMayLeaveTheMap) {
  const planning::World known = world();
  for (const bool trusts : {false, true}) {
    MissingObjects missing(known, trusts);
    std::optional<std::string> text;
    while (!text) text = missing.observe(1);
    EXPECT_EQ(text->find("until") != std::string::npos, trusts) << *text;
  }
}

}  // namespace
}  // namespace dive::mission
