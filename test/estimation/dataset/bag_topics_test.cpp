// Which topics become a recording's sensors, by their names and types alone.

#include "estimation/dataset/bag/bag_topics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

BagTopic topic(const std::string& name, const std::string& type) {
  return {name, type, Serialization::kRos1, 10};
}

class Topics : public ::testing::Test {
 protected:
  std::vector<BagTopic> topics{
      topic("/imu0", "sensor_msgs/Imu"), topic("/cam0/image_raw", "sensor_msgs/Image"),
      topic("/cam1/image_raw", "sensor_msgs/Image"), topic("/pose", "geometry_msgs/PoseStamped")};
  BagOptions options;
  CalibratedTopics calibrated{"", {"/cam0/image_raw", "/cam1/image_raw"}};

  [[nodiscard]] auto choose() const { return choose_topics(topics, options, calibrated); }
};

TEST_F(Topics, TwoCamerasNeverHaveTheSame) {
  options.topics["cam0"] = "/cam1/image_raw";
  ASSERT_FALSE(choose());
  EXPECT_THAT(choose().error(), HasSubstr("cam0 and cam1 are both /cam1/image_raw: choose with "
                                          "--topic cam1=NAME; its topics: /imu0"));
  options.topics["cam1"] = "/cam0/image_raw";
  ASSERT_TRUE(choose());
  EXPECT_THAT(choose()->cameras, ElementsAre(2U, 1U)) << "exchanged on purpose";
  options.topics.clear();
  calibrated.cameras = {"/cam0/image_raw", "/cam0/image_raw"};
  EXPECT_FALSE(choose());
}

TEST_F(Topics, ACameraWithoutANameGetsWhatIsLeft) {
  calibrated.cameras = {"", ""};
  options.topics["cam0"] = "/cam1/image_raw";
  ASSERT_TRUE(choose());
  EXPECT_THAT(choose()->cameras, ElementsAre(2U, 1U));
  options.topics.clear();
  calibrated.cameras = {"", "/cam0/image_raw"};
  ASSERT_TRUE(choose());
  EXPECT_THAT(choose()->cameras, ElementsAre(2U, 1U));
  topics.push_back(topic("/cam2/image_raw", "sensor_msgs/Image"));
  ASSERT_FALSE(choose());
  EXPECT_THAT(choose().error(), HasSubstr("3 topics of images for 2 calibrated camera(s): choose "
                                          "with --topic cam0=NAME"));
}

TEST_F(Topics, ATopicOfACalibrationMustHaveImages) {
  topics.push_back(topic("/cam0/camera_info", "sensor_msgs/CameraInfo"));
  calibrated.cameras = {"/cam0/camera_info", "/cam1/image_raw"};
  ASSERT_TRUE(choose());
  EXPECT_THAT(choose()->cameras, ElementsAre(1U, 2U));
}

TEST_F(Topics, TheImuMayBeNamedByItsCalibration) {
  topics.push_back(topic("/imu1", "sensor_msgs/Imu"));
  EXPECT_FALSE(choose());
  calibrated.imu = "/imu1";
  ASSERT_TRUE(choose());
  EXPECT_EQ(choose()->imu, 4U);
}

// Poses may be goals, or the vehicle's own estimate.
TEST_F(Topics, TruthMustBeNamed) {
  ASSERT_TRUE(choose());
  EXPECT_FALSE(choose()->truth);
  options.topics["truth"] = "/pose";
  ASSERT_TRUE(choose());
  EXPECT_EQ(choose()->truth, 3U);
}

}  // namespace
}  // namespace dive::estimation
