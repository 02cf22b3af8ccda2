#include "estimation/dataset/asl_dataset.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

namespace fs = std::filesystem;
using testing::camera_yaml;
using ::testing::HasSubstr;
using testing::imu_yaml;
using testing::write_png;
using testing::write_text;

constexpr const char* kImuRows =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_y,w_z,a_RS_S_x [m s^-2],a_y,a_z\r\n"
    "1403636579758555392,-0.099134701513277898,0.14730578886832138,0.02722713633111154,"
    "8.1476917083333333,-0.37592158333333331,-2.4026292499999999\r\n"
    "1403636579763555584,-0.1,0.2,0.3,9.81,0.0,0.0\r\n";

class Asl : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = testing::fresh_folder();
    write("cam0/sensor.yaml", camera_yaml(testing::test_camera(0.05)));
    write("cam0/data.csv",
          "#timestamp [ns],filename\n1403636579763555584,a.png\n1403636579813555456,b.png\n");
    write("imu0/sensor.yaml", imu_yaml());
    write("imu0/data.csv", kImuRows);
  }
  void write(const std::string& name, const std::string& text) {
    write_text(folder + "/mav0/" + name, text);
  }
  std::string error() {
    const auto dataset = read_asl_dataset(folder);
    return dataset ? "it is read" : dataset.error();
  }
  std::string folder;
};

TEST_F(Asl, ReadsWhatEurocWrites) {
  write("cam1/sensor.yaml", camera_yaml(testing::test_camera(-0.05)));
  write("cam1/data.csv", "1403636579763555584,a.png\n");
  write("depth0/data.csv", "#timestamp [ns],depth [m]\n1403636579763555584, 2.5\n");
  write("state_groundtruth_estimate0/data.csv",
        "#timestamp, p_RS_R_x [m], ..., q_RS_w [], ...\n"
        "1403636579763555584,4.688,-1.786,0.783,0.5,-0.5,0.5,-0.5,-0.027,0.033,0.8,0,0,0,0,0,0\n");
  for (const std::string& given : {folder, folder + "/mav0"}) {
    const auto dataset = read_asl_dataset(given);
    ASSERT_TRUE(dataset) << dataset.error();
    ASSERT_EQ(dataset->cameras.size(), 2U);
    const CameraModel& left = dataset->cameras[0].model;
    EXPECT_EQ(left.width, 752);
    EXPECT_DOUBLE_EQ(left.fy, 457.296);
    EXPECT_DOUBLE_EQ(left.radtan[1], 0.074);
    EXPECT_NEAR((left.X_BC.p - Eigen::Vector3d(0, 0.05, 0)).norm(), 0.0, 1e-12);
    EXPECT_NEAR(angle_between(left.X_BC.q, testing::looking_ahead()), 0.0, 1e-7);
    ASSERT_EQ(dataset->cameras[0].images.size(), 2U);
    EXPECT_EQ(dataset->cameras[0].images[0].utime, 1403636579763556);  // rounded
    EXPECT_EQ(dataset->cameras[0].rate_hz, 20.0);
    ASSERT_EQ(dataset->imu.size(), 2U);
    EXPECT_DOUBLE_EQ(dataset->imu[0].gyro_B.y(), 0.14730578886832138);
    EXPECT_DOUBLE_EQ(dataset->imu[0].accel_B.z(), -2.4026292499999999);
    EXPECT_EQ(dataset->imu_noise.accel_walk, 3.0e-3);
    ASSERT_EQ(dataset->depth.size(), 1U);
    EXPECT_EQ(dataset->depth[0].depth_m, 2.5);
    ASSERT_EQ(dataset->truth.size(), 1U);
    EXPECT_TRUE(dataset->has_true_attitude);
    const Eigen::Quaterniond q(0.5, -0.5, 0.5, -0.5);  // w first
    EXPECT_NEAR(angle_between(dataset->truth[0].X_WB.q, q), 0.0, 1e-7);
    EXPECT_EQ(dataset->truth[0].v_W->z(), 0.8);
  }
}

TEST_F(Asl, ReadsVelocities) {
  write("dvl0/data.csv", "#timestamp [ns], v [m s^-1]\n1403636579763555584,0.4,-0.1,0.02\n");
  auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  ASSERT_EQ(dataset->velocity.size(), 1U);
  EXPECT_EQ(dataset->velocity[0].v_B, Eigen::Vector3d(0.4, -0.1, 0.02));
  EXPECT_EQ(dataset->velocity[0].sigma, 0.02);
  write("dvl0/sensor.yaml", "velocity_noise: 0.005\n");
  EXPECT_EQ(read_asl_dataset(folder)->velocity[0].sigma, 0.005);
  write("dvl0/sensor.yaml", "velocity_noise: 20000\n");
  EXPECT_THAT(error(),
              HasSubstr("dvl0/sensor.yaml:1: velocity_noise is 20000; it must be from 0.0001 to"));
  fs::remove_all(folder + "/mav0/dvl0");

  write("speed0/data.csv", "1403636579763555584,0.3\n1403636579863555584,-25\n");
  dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  ASSERT_EQ(dataset->velocity.size(), 1U);
  EXPECT_EQ(dataset->velocity[0].v_B, Eigen::Vector3d(0.3, 0.0, 0.0));
  EXPECT_EQ(dataset->velocity_origin.refused, 1U);
  ASSERT_FALSE(dataset->diagnostics.list().empty());
  EXPECT_THAT(render(dataset->diagnostics.list().front(), false),
              HasSubstr("speed0/data.csv:2: warning: a velocity of 25 m/s"));
}

// The body frame of the files is not the IMU's: everything is converted to the IMU's.
TEST_F(Asl, UsesTheImuAsB) {
  std::string yaml = imu_yaml();
  const std::string unit = "1.0, 0.0, 0.0, 0.0,";
  yaml.replace(yaml.find(unit), unit.size(), "1.0, 0.0, 0.0, 0.3,");
  write("imu0/sensor.yaml", yaml);
  write("vicon0/data.csv", "1403636579763555584,1,2,3,1,0,0,0\n");
  const auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_NEAR((dataset->cameras[0].model.X_BC.p - Eigen::Vector3d(-0.3, 0.05, 0)).norm(), 0.0,
              1e-12);
  EXPECT_NEAR((dataset->truth[0].X_WB.p - Eigen::Vector3d(1.3, 2, 3)).norm(), 0.0, 1e-12);
}

TEST_F(Asl, ReadsWhereDepthAndVelocityAreMeasured) {
  write("depth0/data.csv", "1403636579763555584,3.5\n");
  write("dvl0/data.csv", "1403636579763555584,0.4,0,0\n");
  auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_EQ(dataset->depth_sigma_m, 0.02);
  EXPECT_EQ(dataset->depth_sensor_B, Eigen::Vector3d(0, 0, 0));
  const auto pose = [](const std::string& rows) {
    return "T_BS:\n  cols: 4\n  rows: 4\n  data: [" + rows + ", 0, 0, 0, 1]\n";
  };
  write("depth0/sensor.yaml",
        pose("1, 0, 0, 0.2, 0, 1, 0, 0, 0, 0, 1, -0.1") + "noise_sigma: 0.05\n");
  write("dvl0/sensor.yaml", pose("0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0"));
  dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_EQ(dataset->depth_sigma_m, 0.05);
  EXPECT_NEAR((dataset->depth_sensor_B - Eigen::Vector3d(0.2, 0, -0.1)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((dataset->velocity[0].v_B - Eigen::Vector3d(0, 0.4, 0)).norm(), 0.0, 1e-12);
}

TEST_F(Asl, ReadsPositionsWithoutAttitude) {
  write("leica0/data.csv", "1403636579763555584,1,2,3\n");
  const auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_FALSE(dataset->has_true_attitude);
  EXPECT_EQ(dataset->truth[0].X_WB.p.z(), 3.0);
}

// Sensors state no measurement in many ways; only that sample is lost.
TEST_F(Asl, RefusesSamplesThatAreNoMeasurement) {
  write("imu0/data.csv", std::string(kImuRows) + "1403636579768555584,0,0,nan,0,0,9.8\n");
  write("dvl0/data.csv", "1000,0.4,0,0\n2000,nan,0,0\n3000,0,NaN,0\n");
  write("depth0/data.csv", "1000,inf\n2000,2.5\n");
  write("vicon0/data.csv", "1000,0,0,0,0,0,0,0\n2000,1,2,3,1,0,0,0\n3000,1,nan,3,1,0,0,0\n");
  const auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_EQ(dataset->imu.size(), 2U);
  EXPECT_EQ(dataset->velocity.size(), 1U);
  ASSERT_EQ(dataset->depth.size(), 1U);
  EXPECT_EQ(dataset->depth[0].depth_m, 2.5);
  ASSERT_EQ(dataset->truth.size(), 1U);
  EXPECT_EQ(dataset->truth[0].X_WB.p.z(), 3.0);
  std::string text;
  for (const Diagnostic& d : dataset->diagnostics.list()) text += render(d, false);
  EXPECT_THAT(text, HasSubstr("dvl0/data.csv:2: warning: a velocity that is not finite; it and 1 "
                              "more such samples are refused"));
  EXPECT_THAT(text, HasSubstr("vicon0/data.csv:1: warning: a true attitude whose quaternion"));
}

// A writer that was stopped: the last line has no line break.
TEST_F(Asl, IgnoresALastLineThatIsCut) {
  write("imu0/data.csv", std::string(kImuRows) + "1403636579768555584,0,0,");
  write("vicon0/data.csv", "1000,1,2,3,1,0,0,0\n2000,1,2,3,1,0\n3000,1,2,3,1,0,0,0\n");
  EXPECT_THAT(error(), HasSubstr("vicon0/data.csv:2: 6 fields"));
  write("vicon0/data.csv", "1000,1,2,3,1,0,0,0\n2000,1,2,3,1,0");
  const auto dataset = read_asl_dataset(folder);
  ASSERT_TRUE(dataset) << dataset.error();
  EXPECT_EQ(dataset->imu.size(), 2U);
  EXPECT_EQ(dataset->truth.size(), 1U);
  EXPECT_TRUE(dataset->has_true_attitude);
  ASSERT_EQ(dataset->diagnostics.warning_count(), 2U);
  EXPECT_THAT(render(dataset->diagnostics.list()[0], false),
              HasSubstr("imu0/data.csv:4: warning: the file ends within this line"));
}

TEST_F(Asl, TakesSensorsFromElsewhere) {
  const auto written = read_asl_calibration(folder);
  ASSERT_TRUE(written) << written.error();
  Recording sensors = *written;
  sensors.cameras[0].model.fx = 400.0;
  sensors.cameras[0].time_shift_s = 0.002;
  sensors.cameras.push_back(sensors.cameras[0]);  // the recording has one
  for (const char* name : {"imu0", "cam0"}) {
    fs::remove(folder + "/mav0/" + name + "/sensor.yaml");
  }
  EXPECT_TRUE(lacks_asl_calibration(folder));
  EXPECT_FALSE(lacks_asl_calibration(folder + "/nowhere"));
  const auto dataset = read_asl_dataset(folder, sensors);
  ASSERT_TRUE(dataset) << dataset.error();
  ASSERT_EQ(dataset->cameras.size(), 1U);
  EXPECT_EQ(dataset->cameras[0].model.fx, 400.0);
  EXPECT_EQ(dataset->cameras[0].images[0].utime, 1403636579765556) << "with the time shift";
  EXPECT_EQ(dataset->imu_noise.accel_walk, 3.0e-3);
}

TEST_F(Asl, ReportsWhereAndWhatIsWrong) {
  const std::string camera = camera_yaml(testing::test_camera(0.05));
  const auto with = [](std::string text, const std::string& old, const std::string& now) {
    return text.replace(text.find(old), old.size(), now);
  };
  const struct {
    const char* file;
    std::string text;
    const char* words;
  } bad[] = {
      {"imu0/data.csv", "1000,1,2,3,4,5,6\n2000,1,2,3,4,5\n", "data.csv:2: 6 fields; at least 7"},
      {"imu0/data.csv", "1,1,2,3,4,5,six\n", "data.csv:1: field 7 is \"six\""},
      {"imu0/data.csv", "# nothing\n", "there are no samples"},
      {"imu0/data.csv", std::string(5000, '1'), "data.csv:1: the line is too long"},
      {"imu0/sensor.yaml", with(imu_yaml(), "1.6968e-04", "much"),
       "gyroscope_noise_density is not a"},
      {"imu0/sensor.yaml", with(imu_yaml(), "1.6968e-04", "-1.0"),
       "sensor.yaml:16: gyroscope_noise_density is -1; it must be from 1e-07 to 1"},
      {"imu0/sensor.yaml", with(imu_yaml(), "walk: 3.0000e-3", "walk: 0"),
       "sensor.yaml:19: accelerometer_random_walk is 0; it must be from 1e-08 to 10"},
      {"imu0/sensor.yaml", with(imu_yaml(), "1.0, 0.0,", "2.0, 0.0,"), "T_BS is not a pose"},
      {"imu0/sensor.yaml", with(imu_yaml(), "1.0]", "1.0, 7]"), "16 numbers"},
      {"imu0/sensor.yaml", "T_BS: [1, 2", "sensor.yaml:"},
      {"imu0/sensor.yaml", "no keys", "keys and values"},
      {"cam0/sensor.yaml", with(camera, "pinhole", "fisheye"),
       "camera_model is fisheye; known are"},
      {"cam0/sensor.yaml", with(camera, "radial-tangential", "fov"), "is fov; known are"},
      {"cam0/sensor.yaml", with(camera, "resolution", "size"), "there is no resolution"},
      {"cam0/sensor.yaml", with(camera, "[752, 480]", "[752]"), "resolution must be a list of 2"},
      {"cam0/sensor.yaml", with(camera, "[752, 480]", "[-5, 480]"), "-5 x 480"},
      {"cam0/sensor.yaml", with(camera, "intrinsics: [458.654", "intrinsics: [none"),
       "number 1 of intrinsics"},
      {"cam0/sensor.yaml", with(camera, "458.654", "-458.654"), "focal lengths"},
      {"cam0/data.csv", "7,../../../etc/passwd\n", "is no file of the folder data"},
      {"cam0/data.csv", "7\n", "no file name of an image"},
      {"cam0/data.csv", "", "it lists no images"},
      {"dvl0/data.csv", "7,1,2\n", "3 fields; at least 4"},
      {"depth0/data.csv", "7,\n", "field 2 is \"\""},
      {"vicon0/data.csv", "7,1,2,3,1,0,0,0\n9007,1,2,3,1\n9999,1,2,3,1,0,0,0\n",
       "data.csv:2: 5 fields; at least 8"},
      {"leica0/data.csv", "7,1,2\n", "3 fields; at least 4"}};
  for (const auto& [file, text, words] : bad) {
    SetUp();
    write(file, text);
    EXPECT_THAT(error(), HasSubstr(words)) << file;
    EXPECT_THAT(error(), HasSubstr(file));
  }
}

TEST_F(Asl, ReportsWhatIsMissing) {
  EXPECT_THAT(read_asl_dataset(folder + "/nowhere").error(), HasSubstr("no folders cam0 and imu0"));
  for (const char* file : {"imu0/data.csv", "imu0/sensor.yaml", "cam0/data.csv"}) {
    SetUp();
    fs::remove(folder + "/mav0/" + file);
    EXPECT_THAT(error(), HasSubstr(std::string(file) + ": no such file"));
  }
}

TEST_F(Asl, ACalibrationNeedsNoRecording) {
  write("cam1/sensor.yaml", camera_yaml(testing::test_camera(-0.05)));
  for (const char* file : {"imu0/data.csv", "cam0/data.csv"}) fs::remove(folder + "/mav0/" + file);
  const auto sensors = read_asl_calibration(folder);
  ASSERT_TRUE(sensors) << sensors.error();
  ASSERT_EQ(sensors->cameras.size(), 2U);
  EXPECT_EQ(sensors->cameras[1].model.width, 752);
  EXPECT_NEAR(sensors->cameras[1].model.X_BC.p.y(), -0.05, 1e-9);
  EXPECT_DOUBLE_EQ(sensors->imu_noise.gyro.value_or(0.0), 1.6968e-04);
  fs::remove(folder + "/mav0/cam1/sensor.yaml");
  EXPECT_THAT(read_asl_calibration(folder).error(), HasSubstr("cam1/sensor.yaml: no such file"));
}

TEST_F(Asl, DecodesImagesWhenTheyAreAskedFor) {
  ImageFrame gray;
  gray.width = 3;
  gray.height = 2;
  gray.pixels = {0, 50, 100, 150, 200, 255};
  write_png(folder + "/gray.png", gray);
  const auto read = read_image({77, folder + "/gray.png"}, 1);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->pixels, gray.pixels);
  EXPECT_EQ(read->width, 3);
  EXPECT_EQ(read->utime, 77);
  EXPECT_EQ(read->camera, 1);

  ImageFrame colour = gray;
  colour.format = ImageFrame::Format::kRgb8;
  colour.pixels.assign(18, 90);
  write_png(folder + "/colour.png", colour);
  const auto turned = read_image({77, folder + "/colour.png"}, 0);
  ASSERT_TRUE(turned) << turned.error();
  EXPECT_EQ(turned->pixels, std::vector<std::uint8_t>(6, 90));

  write_text(folder + "/torn.png", "\x89PNG\r\n\x1a\n and no more");
  for (const char* name : {"/torn.png", "/missing.png"}) {
    const auto none = read_image({77, folder + name}, 0);
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error(), HasSubstr(name));
  }
}

}  // namespace
}  // namespace dive::estimation
