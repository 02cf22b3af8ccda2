#include "estimation/dataset/bag/calibration_file.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The IMU 0.3 m before the body frame.
std::string moved_imu() {
  std::string yaml = testing::imu_yaml();
  const std::string unit = "1.0, 0.0, 0.0, 0.0,";
  return yaml.replace(yaml.find(unit), unit.size(), "1.0, 0.0, 0.0, 0.3,");
}

std::string section(const std::string& name) {
  return name +
         ":\n  T_cam_imu: [[0, -1, 0, 0.05], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]\n"
         "  camera_model: pinhole\n  intrinsics: [80, 81, 48, 32]\n  resolution: [96, 64]\n"
         "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n  rostopic: /" +
         name + "\n";
}

class CalibrationFile : public ::testing::Test {
 protected:
  void SetUp() override { folder = testing::fresh_folder(); }
  std::string write(const std::string& name, const std::string& text) {
    testing::write_text(folder + "/" + name, text);
    return folder + "/" + name;
  }
  std::string folder;
};

// Given one by one, in any order, they mean what they mean as a folder.
TEST_F(CalibrationFile, UsesTheImuAsB) {
  const std::string camera =
      write("cam0/sensor.yaml", testing::camera_yaml(testing::test_camera(0.05)));
  const std::string imu = write("imu0/sensor.yaml", moved_imu());
  const std::string chain = write("chain.yaml", section("cam0"));
  for (const std::vector<std::string>& paths :
       {std::vector{folder}, {camera, imu}, {imu, camera}}) {
    const auto read = read_calibration(paths);
    ASSERT_TRUE(read) << read.error();
    const Eigen::Vector3d& p = read->sensors.cameras[0].model.X_BC.p;
    EXPECT_NEAR((p - Eigen::Vector3d(-0.3, 0.05, 0.0)).norm(), 0.0, 1e-12);
  }
  const auto kalibr = read_calibration({chain, imu});
  ASSERT_TRUE(kalibr) << kalibr.error();
  EXPECT_NEAR((kalibr->sensors.cameras[0].model.X_BC.p - Eigen::Vector3d(0, 0.05, 0)).norm(), 0.0,
              1e-12)
      << "T_cam_imu is of the IMU";
}

TEST_F(CalibrationFile, KeepsTopicsAndNotesUnusedCameras) {
  const std::string chain =
      write("chain.yaml", section("cam0") + section("cam1") + section("cam2") + section("cam3"));
  const std::string imu = write("imu.yaml", "rostopic: /imu\ngyroscope_noise_density: 1e-4\n");
  const auto read = read_calibration({chain, imu});
  ASSERT_TRUE(read) << read.error();
  EXPECT_THAT(read->topics.cameras, ElementsAre("/cam0", "/cam1"));
  EXPECT_EQ(read->topics.imu, "/imu");
  ASSERT_EQ(read->sensors.diagnostics.list().size(), 1U);
  EXPECT_THAT(read->sensors.diagnostics.list()[0].message, HasSubstr("not used: cam2, cam3"));
}

TEST_F(CalibrationFile, IsNotReadFromABag) {
  for (const std::string& begin : {std::string("#ROSBAG V2.0\n"), std::string("SQLite format 3"),
                                   std::string("\x89MCAP0\r\n", 8)}) {
    const std::string path = write("recording", begin);
    std::filesystem::resize_file(path, std::uintmax_t{1} << 40U);  // zeros that take no space
    EXPECT_THAT(read_calibration({path}).error(), HasSubstr("is a bag, not a calibration"));
  }
  const std::string path = write("long.yaml", "a: 1\n");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40U);
  EXPECT_THAT(read_calibration({path}).error(), HasSubstr("long.yaml: is larger than 1024 KiB"));
}

TEST_F(CalibrationFile, IsFoundBesideARecordingOfTumVi) {
  EXPECT_TRUE(calibration_beside(folder).empty());
  const std::string chain = write("dso/camchain.yaml", section("cam0"));
  const std::string imu = write("dso/imu_config.yaml", "gyroscope_noise_density: 1e-4\n");
  write("mav0/cam0/data.csv", "");
  EXPECT_THAT(calibration_beside(folder), ElementsAre(chain, imu));
  const auto beside = calibration_beside(folder + "/mav0");
  ASSERT_EQ(beside.size(), 2U);
  EXPECT_TRUE(read_calibration(beside));
}

}  // namespace
}  // namespace dive::estimation
