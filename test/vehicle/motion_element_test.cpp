#include "vehicle/motion_element.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "test/common/arbitrary.h"
#include "vehicle/autopilot.h"
#include "vehicle/model.h"

namespace dive::vehicle {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::vector<double> kNoSigmas;

MotionModel arbitrary_motion() {
  MotionModel motion;
  for (const MotionCoefficient& c : motion_coefficients()) {
    c.of(motion) = *testing::arbitrary_double(c.low, c.high);
  }
  return motion;
}

std::vector<double> values_of(const MotionModel& motion) {
  std::vector<double> values;
  for (const MotionCoefficient& c : motion_coefficients()) values.push_back(c.value(motion));
  return values;
}

std::optional<Model> read(const std::string& urdf) {
  Diagnostics diagnostics;
  std::optional<Model> model = parse_urdf({"test.urdf", urdf}, diagnostics);
  for (const Diagnostic& found : diagnostics.list()) ADD_FAILURE() << render(found, false);
  return model;
}

RC_GTEST_PROP(MotionElement, IsReadAsItWasWritten, ()) {
  const MotionModel motion = arbitrary_motion();
  const auto written = with_motion(aqua2_urdf(), motion, {0.1, 0.02});
  RC_ASSERT(written.has_value());
  const auto model = read(*written);
  RC_ASSERT(model.has_value());
  RC_ASSERT(values_of(model->motion) == values_of(motion));
  RC_ASSERT(without_motion({"test.urdf", *written}) == aqua2_urdf().content());
}

RC_GTEST_PROP(MotionElement, OfAnEarlierFitIsReplaced, ()) {
  const MotionModel motion = arbitrary_motion();
  const auto first = with_motion(aqua2_urdf(), arbitrary_motion(), {0.5});
  const auto second = with_motion({"test.urdf", *first}, motion, kNoSigmas);
  RC_ASSERT(second == with_motion(aqua2_urdf(), motion, kNoSigmas));
}

TEST(MotionElement, IsThatOfTheAqua2WhereADescriptionHasNone) {
  EXPECT_THAT(aqua2_urdf().content(), Not(HasSubstr("<motion>\n")));
  const auto model = read(aqua2_urdf().content());
  ASSERT_TRUE(model);
  EXPECT_EQ(values_of(model->motion), values_of(MotionModel{}));
}

TEST(MotionElement, StandsAmongOtherElementsAndMayBePartial) {
  const auto model = read(
      "<robot name=\"r\"><motion><!-- of a pool --><tail_m value=\"0.5\" sigma=\"0.1\"/></motion>"
      "<link name=\"l\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial><collision><geometry><sphere radius=\"1\"/>"
      "</geometry></collision></link></robot>");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->motion.tail_m, 0.5);
  EXPECT_EQ(model->motion.full_speed, MotionModel{}.full_speed);
}

TEST(MotionElement, IsUsedByTheAutopilot) {
  MotionModel motion;
  motion.full_speed = 0.7;
  motion.full_heave = 0.2;
  motion.coast_m = {2.5, 0.7, 0.5};
  motion.tail_lift_m.y() = 1.25;
  const AutopilotOptions options = autopilot_options(motion);
  EXPECT_EQ(options.full_speed, 0.7);
  EXPECT_EQ(options.full_heave, 0.2);
  EXPECT_EQ(options.coast_length_m, 2.5);
  EXPECT_EQ(options.heave_lift, 0.4);
}

}  // namespace
}  // namespace dive::vehicle
