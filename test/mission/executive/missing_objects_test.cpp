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
  world.surfaces.push_back({"hull", {}});
  return world;
}

TEST(MissingObjects, EachIsReportedOnceWhenSeveralScansSeeThroughIt) {
  const planning::World known = world();
  MissingObjects missing(known);
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
  MissingObjects missing(known);
  for (int scan = 0; scan < 10; ++scan) {
    EXPECT_FALSE(missing.observe(-1));
    EXPECT_FALSE(missing.observe(3)) << "from a log that another program wrote";
  }
}

}  // namespace
}  // namespace dive::mission
