#include "mission/record/asl_writer.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "mission/record/dataset_recorder.h"
#include "test/common/file_content.h"
#include "test/vehicle/aqua2.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using Rows = std::vector<std::vector<std::string>>;

class Dataset : public ::testing::Test {
 protected:
  Dataset() {
    std::string name = (fs::temp_directory_path() / "dive-asl-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~Dataset() override { fs::remove_all(folder_); }

  // Reads like a reader of EuRoC's files: a line of column names after a #, then values.
  [[nodiscard]] Rows rows(const std::string& sensor) const {
    std::ifstream file(folder_ / "mav0" / sensor / "data.csv");
    std::string line;
    Rows result;
    EXPECT_TRUE(std::getline(file, line) && line.starts_with("#timestamp [ns],")) << sensor;
    const auto columns = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    while (std::getline(file, line)) {
      std::vector<std::string> row;
      std::stringstream cells(line);
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
      EXPECT_EQ(row.size(), columns) << sensor;
      result.push_back(row);
    }
    return result;
  }

  // A YAML subset: "key: value" and lists of numbers over several lines.
  [[nodiscard]] std::map<std::string, std::vector<double>> yaml(const std::string& sensor) const {
    std::ifstream file(folder_ / "mav0" / sensor / "sensor.yaml");
    std::map<std::string, std::vector<double>> result;
    std::string key;
    for (std::string line; std::getline(file, line);) {
      line = line.substr(0, line.find('#'));
      const auto colon = line.find(": ");
      if (colon != std::string::npos) {
        key = line.substr(line.find_first_not_of(' '), colon - line.find_first_not_of(' '));
        line = line.substr(colon + 1);
      }
      for (char& c : line) c = c == '[' || c == ']' || c == ',' ? ' ' : c;
      std::stringstream numbers(line);
      for (double x; numbers >> x;) result[key].push_back(x);
    }
    return result;
  }

  fs::path folder_;
};

CameraModel small(double y) {
  CameraModel camera;
  camera.width = 32;
  camera.height = 20;
  camera.fx = 10.5;
  camera.fy = 11.5;
  camera.cx = 15.5;
  camera.cy = 9.5;
  camera.radtan = {-0.1, 0.01, 0.001, -0.002};
  camera.X_BC = {{0.31, y, 0.02}, from_rpy(0.1, 0.7, -1.2)};
  return camera;
}

AslSensors sensors() {
  AslSensors result;
  result.cameras = {small(0.07), small(-0.07)};
  result.imu.gyro_density = 8.7e-5;
  result.imu.accel_walk = 4e-5;
  result.depth_sigma_m = 0.01;
  result.comment = "of \"a\" test\nin two lines";
  return result;
}

TEST_F(Dataset, IsReadAgainAsItWasWritten) {
  auto writer = AslWriter::create(folder_.string(), sensors(), Existing::kRefuse);
  ASSERT_TRUE(writer) << writer.error().message;
  ImageFrame frame{1'050'000, 1, ImageFrame::Format::kGray8, 32, 20, {}};
  for (int i = 0; i < 32 * 20; ++i) frame.pixels.push_back(static_cast<std::uint8_t>(7 * i));
  writer->write(frame);
  ImuSample imu;
  imu.utime = 1'005'000;
  imu.gyro_B = {0.123456789, -2e-7, 3.0};
  imu.accel_B = {-0.5, 0.25, 9.81};
  writer->write(imu);
  writer->write(DepthSample{1'020'000, 12.3456789});
  AslTruth truth;
  truth.utime = 1'020'000;
  truth.X_WB = {{1, -2, -12.25}, from_rpy(0.3, -0.2, 2.5)};
  truth.v_W = {0.4, 0.1, -0.05};
  truth.gyro_bias_B = {1e-3, 2e-3, 3e-3};
  truth.accel_bias_B = {0.01, 0.02, 0.03};
  writer->write(truth);
  ASSERT_TRUE(writer->close());

  EXPECT_TRUE(rows("cam0").empty());
  const Rows images = rows("cam1");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0][0], "1050000000");
  const cv::Mat seen =
      cv::imread((folder_ / "mav0/cam1/data" / images[0][1]).string(), cv::IMREAD_UNCHANGED);
  ASSERT_TRUE(seen.type() == CV_8UC1 && seen.cols == 32 && seen.rows == 20);
  EXPECT_TRUE(std::equal(frame.pixels.begin(), frame.pixels.end(), seen.data));

  const auto expect_row = [](const Rows& all, const std::vector<double>& expected) {
    ASSERT_EQ(all.size(), 1U);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(std::stod(all[0][i]), expected[i], 1e-8 * std::abs(expected[i])) << i;
    }
  };
  const auto& q = truth.X_WB.q;
  expect_row(rows("imu0"), {1005e6, 0.123456789, -2e-7, 3.0, -0.5, 0.25, 9.81});
  expect_row(rows("depth0"), {1020e6, 12.3456789});
  expect_row(rows("state_groundtruth_estimate0"),
             {1020e6, 1, -2, -12.25, q.w(), q.x(), q.y(), q.z(), 0.4, 0.1, -0.05, 1e-3, 2e-3, 3e-3,
              0.01, 0.02, 0.03});
}

TEST_F(Dataset, DescribesTheSensors) {
  auto writer = AslWriter::create(folder_.string(), sensors(), Existing::kRefuse);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->close());
  for (const std::string camera : {"cam0", "cam1"}) {
    auto said = yaml(camera);
    EXPECT_THAT(said["resolution"], ::testing::ElementsAre(32, 20));
    EXPECT_THAT(said["intrinsics"], ::testing::ElementsAre(10.5, 11.5, 15.5, 9.5));
    EXPECT_THAT(said["distortion_coefficients"], ::testing::ElementsAre(-0.1, 0.01, 0.001, -0.002));
    EXPECT_THAT(said["rate_hz"], ::testing::ElementsAre(20));
    ASSERT_EQ(said["data"].size(), 16U);  // T_BS, row by row
    const Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(said["data"].data());
    const CameraModel model = small(camera == "cam0" ? 0.07 : -0.07);
    const Eigen::Vector3d p(0.3, -0.4, 2.0);
    EXPECT_LT(((T * p.homogeneous()).head<3>() - model.X_BC * p).norm(), 1e-9);
    EXPECT_EQ(T(3, 3), 1.0);
  }
  EXPECT_THAT(yaml("imu0")["gyroscope_noise_density"], ::testing::ElementsAre(8.7e-5));
  EXPECT_THAT(yaml("imu0")["accelerometer_random_walk"], ::testing::ElementsAre(4e-5));
  EXPECT_THAT(yaml("depth0")["noise_sigma"], ::testing::ElementsAre(0.01));
  EXPECT_THAT(dive::testing::content_of(folder_ / "mav0/cam0/sensor.yaml"),
              ::testing::HasSubstr("\ncomment: \"of \\\"a\\\" test in two lines\"\n"));
}

TEST_F(Dataset, IsNotWrittenOverAnother) {
  ASSERT_TRUE(AslWriter::create(folder_.string(), sensors(), Existing::kRefuse));
  const auto again = AslWriter::create(folder_.string(), sensors(), Existing::kRefuse);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, ::testing::HasSubstr("holds a dataset already"));
  std::ofstream(folder_ / "mav0/cam0/data/0.png") << "of the first recording";
  ASSERT_TRUE(AslWriter::create(folder_.string(), sensors(), Existing::kReplace));
  EXPECT_FALSE(fs::exists(folder_ / "mav0/cam0/data/0.png")) << "two datasets are not mixed";
  const auto nowhere = AslWriter::create("/proc/no-such-place", sensors(), Existing::kRefuse);
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().message, ::testing::HasSubstr("/proc/no-such-place"));
}

TEST_F(Dataset, ReportsALostImage) {
  auto writer = AslWriter::create(folder_.string(), sensors(), Existing::kRefuse);
  ASSERT_TRUE(writer);
  fs::remove_all(folder_ / "mav0/cam0/data");
  writer->write(
      ImageFrame{0, 0, ImageFrame::Format::kGray8, 32, 20, std::vector<std::uint8_t>(32 * 20)});
  const auto closed = writer->close();
  ASSERT_FALSE(closed);
  EXPECT_THAT(closed.error().message, ::testing::HasSubstr("cam0/data/0.png"));
}

// Two seconds of a dive: rates, order, and the same files from the same seed.
TEST_F(Dataset, OfASimulatedDive) {
  const planning::World world{{{"seabed", planning::HalfSpace{Eigen::Vector3d::UnitZ()},
                                Pose{{0, 0, -6}, Eigen::Quaterniond::Identity()}}}};
  std::optional<vehicle::StereoCameraOptions> camera = vehicle::stereo_camera_in("dark_wreck");
  ASSERT_TRUE(camera && camera->lamps.size() == 2);
  EXPECT_FALSE(vehicle::stereo_camera_in("mud"));
  camera->width = camera->height = 64;
  vehicle::Conditions conditions;
  conditions.inertial_unit = vehicle::ImuNoise{};
  const auto dive = [&](const std::string& name) {
    auto recorder = DatasetRecorder::create((folder_ / name).string(), Existing::kRefuse, world,
                                            *camera, conditions, 3, "a test");
    EXPECT_TRUE(recorder);
    vehicle::Simulator sim(testing::aqua2(), {{0, 0, -4}, Eigen::Quaterniond::Identity()},
                           conditions, 3);
    for (int tick = 0; tick < 100; ++tick) {
      const vehicle::SensorSamples samples = sim.step({0.5, 0, 0, 0, 0});
      recorder->observe(samples, sim.truth(), std::nullopt);
    }
    EXPECT_TRUE(recorder->close());
    return recorder->pairs();
  };
  EXPECT_NEAR(dive("a"), 40, 1);
  static_cast<void>(dive("b"));
  const auto text = [&](const std::string& path) {
    return dive::testing::content_of(folder_ / path);
  };
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (!entry.is_regular_file()) continue;
    const std::string path = fs::relative(entry.path(), folder_ / "a").string();
    EXPECT_EQ(text("a/" + path), text("b/" + path)) << path;
  }
  folder_ /= "a";
  const Rows imu = rows("imu0");
  EXPECT_EQ(imu.size(), 4U * 99U);  // a tick's latency
  for (std::size_t i = 1; i < imu.size(); ++i) {
    ASSERT_EQ(std::stoll(imu[i][0]) - std::stoll(imu[i - 1][0]), 5'000'000);
  }
  EXPECT_EQ(rows("state_groundtruth_estimate0").size(), 100U);
  EXPECT_EQ(rows("cam0").size(), rows("cam1").size());
  folder_ = folder_.parent_path();
}

}  // namespace
}  // namespace dive::mission
