// Which vehicle's motion model a supervisor dead-reckons with.

#include <optional>

#include <gtest/gtest.h>

#include "mission/cli/bundle_file.h"
#include "test/mission/cli/own_folder.h"
#include "vehicle/model.h"
#include "vehicle/motion_element.h"

namespace dive::mission {
namespace {

using testing::own_folder;
using testing::run_here;
using testing::shipped;

std::optional<std::string> aqua2_of_full_speed(double full_speed) {
  MotionModel motion;
  motion.full_speed = full_speed;
  return vehicle::with_motion(vehicle::aqua2_urdf(), motion, {});
}

TEST(SupervisedDive, IsOfTheVehicleThatIsNamedElseOfTheBundles) {
  testing::write_here("slow.urdf", aqua2_of_full_speed(0.6).value());
  testing::write_here("fast.urdf", aqua2_of_full_speed(0.9).value());
  ASSERT_EQ(run_here("check --static --vehicle slow.urdf --bundle slow.bundle " + shipped("pool1"))
                .status,
            0);
  Diagnostics diagnostics;
  SuperviseArguments arguments;
  const auto full_speed = [&] {
    return load_supervised(arguments, std::nullopt, diagnostics).value().motion.full_speed;
  };
  arguments.mission = (own_folder() / "slow.bundle").string();
  EXPECT_EQ(full_speed(), 0.6);
  arguments.vehicle = (own_folder() / "fast.urdf").string();
  EXPECT_EQ(full_speed(), 0.9);
  arguments.mission = std::string(DIVE_SOURCE_DIR) + "/missions/pool1.xml";
  EXPECT_EQ(full_speed(), 0.9);
}

}  // namespace
}  // namespace dive::mission
