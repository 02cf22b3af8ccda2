// Bags that the test writes: what is read from them, and what damage to them is reported.

#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/bag_recording.h"
#include "estimation/dataset/gray_png.h"
#include "test/common/file_content.h"
#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/dataset/bag_writer.h"
#include "test/estimation/dataset/jpeg_writer.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::Wire;
using testing::Written;

constexpr std::uint64_t kStart = 1'403'715'285'262'142'976U;  // ns
constexpr int kWidth = 96;
constexpr int kHeight = 64;

Vector3d gyro(int k) { return {0.01 * k, -0.02 * k, 0.5}; }
Vector3d accel(int k) { return {0.1 * k, 0.2, 9.81}; }
Pose true_pose(int k) { return {{1.0 * k, 2.0, -3.0}, from_rpy(0.0, 0.1, 0.2 * k)}; }

ImageFrame image(int k, int camera) {
  ImageFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.pixels.resize(kWidth * kHeight);
  std::iota(frame.pixels.begin(), frame.pixels.end(), static_cast<std::uint8_t>(k + 100 * camera));
  return frame;
}

/// Two tenths of a second: IMU, two cameras, pressure, truth, and a sonar that nothing reads.
std::vector<Written> messages(Wire wire) {
  std::vector<Written> all;
  for (int k = 0; k < 40; ++k) {
    const std::uint64_t ns = kStart + 5'000'000U * static_cast<std::uint64_t>(k);
    all.push_back(testing::imu_message(wire, "/imu0", ns, gyro(k), accel(k)));
    if (k % 10 != 0) continue;
    all.push_back(testing::gray_message(wire, "/cam1/image_raw", ns, image(k, 1)));
    all.push_back(testing::gray_message(wire, "/cam0/image_raw", ns, image(k, 0)));
    all.push_back(testing::pressure_message(wire, "/pressure", ns, 101'325.0 + 1025 * 9.81 * k));
    all.push_back(testing::pose_message(wire, "/truth", ns, true_pose(k)));
    all.push_back({"/sonar", "sonar_msgs/Ping", ns, "ping"});
  }
  return all;
}

/// Kalibr's chain of two cameras, with the rotation of a camera that looks along x.
std::string camchain() {
  std::string text = "%YAML:1.0\n---\n";
  for (int c = 0; c < 2; ++c) {
    text += fmt::format(
        "cam{}:\n"
        "  T_cam_imu:\n"
        "  - [0.0, -1.0, 0.0, {}]\n"
        "  - [0.0, 0.0, -1.0, 0.0]\n"
        "  - [1.0, 0.0, 0.0, 0.0]\n"
        "  - [0.0, 0.0, 0.0, 1.0]\n"
        "  camera_model: pinhole\n"
        "  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n"
        "  distortion_model: radtan\n"
        "  intrinsics: [80.0, 81.0, 48.0, 32.0]\n"
        "  resolution: [96, 64]\n"
        "  rostopic: /cam{}/image_raw\n"
        "  timeshift_cam_imu: 0.002\n",
        c, c == 0 ? 0.05 : -0.05, c);
  }
  return text;
}

class Bag : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = testing::fresh_folder();
    testing::write_text(folder + "/camchain.yaml", camchain());
    testing::write_text(folder + "/imu.yaml",
                        "rostopic: /imu0\nupdate_rate: 200.0\ngyroscope_noise_density: 1.7e-4\n"
                        "gyroscope_random_walk: 1.9e-5\naccelerometer_noise_density: 2.0e-3\n"
                        "accelerometer_random_walk: 3.0e-3\n");
    options.calibration = {folder + "/camchain.yaml", folder + "/imu.yaml"};
    options.topics["truth"] = "/truth";
  }

  [[nodiscard]] std::string write(const std::string& content) const {
    const std::string path = folder + "/recording.bag";
    testing::write_text(path, content);
    return path;
  }

  [[nodiscard]] std::string error_of(const std::string& content) const {
    const auto read = read_bag(write(content), options);
    return read ? "it is read" : read.error();
  }

  std::string folder;
  BagOptions options;
};

void expect_the_messages(const Recording& recording) {
  ASSERT_EQ(recording.imu.size(), 40U);
  EXPECT_EQ(recording.imu[7].gyro_B, gyro(7));
  EXPECT_EQ(recording.imu[7].accel_B, accel(7));
  EXPECT_EQ(recording.imu[7].utime, 1'403'715'285'297'143);  // rounded
  EXPECT_EQ(recording.imu_rate_hz, 200.0);
  EXPECT_EQ(recording.imu_noise.gyro, 1.7e-4);
  ASSERT_EQ(recording.cameras.size(), 2U);
  for (int c = 0; c < 2; ++c) {
    const RecordedCamera& eye = recording.cameras[static_cast<std::size_t>(c)];
    ASSERT_EQ(eye.images.size(), 4U);
    EXPECT_EQ(eye.images[2].utime, 1'403'715'285'364'143) << "with the time shift of 2 ms";
    const auto frame = read_image(eye.images[2], c);
    ASSERT_TRUE(frame) << frame.error();
    EXPECT_EQ(frame->pixels, image(20, c).pixels);
    EXPECT_EQ(frame->camera, c);
    EXPECT_EQ(frame->utime, eye.images[2].utime);
    EXPECT_EQ(eye.model.fy, 81.0);
    EXPECT_NEAR((eye.model.X_BC.p - Vector3d(0, c == 0 ? 0.05 : -0.05, 0)).norm(), 0.0, 1e-12);
    EXPECT_NEAR(angle_between(eye.model.X_BC.q, testing::looking_ahead()), 0.0, 1e-7);
  }
  ASSERT_EQ(recording.depth.size(), 4U);
  EXPECT_NEAR(recording.depth[3].depth_m, 30.0, 1e-9);
  ASSERT_EQ(recording.truth.size(), 4U);
  EXPECT_TRUE(recording.has_true_attitude);
  EXPECT_EQ(recording.truth[1].X_WB.p, true_pose(10).p);
  EXPECT_NEAR(angle_between(recording.truth[1].X_WB.q, true_pose(10).q), 0.0, 1e-7);
}

TEST_F(Bag, ReadsRos1BagsOfEachCompression) {
  for (const char* const compression : {"none", "bz2", "lz4"}) {
    SCOPED_TRACE(compression);
    const auto read =
        read_bag(write(testing::ros1_bag(messages(Wire::kRos1), compression, 9)), options);
    ASSERT_TRUE(read) << read.error();
    expect_the_messages(*read);
  }
}

TEST_F(Bag, ReadsMcapFilesOfEachCompression) {
  for (const char* const compression : {"", "lz4", "zstd", "no chunks"}) {
    for (const Wire wire : {Wire::kCdr, Wire::kBigCdr, Wire::kRos1}) {
      SCOPED_TRACE(fmt::format("\"{}\" {}", compression, static_cast<int>(wire)));
      const std::string encoding = wire == Wire::kRos1 ? "ros1" : "cdr";
      const auto read =
          read_bag(write(testing::mcap(messages(wire), compression, 9, encoding)), options);
      ASSERT_TRUE(read) << read.error();
      expect_the_messages(*read);
    }
  }
}

TEST_F(Bag, ReadsBagsInSqlite) {
  const std::string path = folder + "/recording's 1%20?.db3";
  testing::write_sqlite_bag(path, messages(Wire::kCdr));
  const auto read = read_bag(path, options);
  ASSERT_TRUE(read) << read.error();
  expect_the_messages(*read);
}

TEST_F(Bag, ListsWhatItDoesNotUse) {
  options.preset = "euroc";
  const auto read = read_bag(write(testing::ros1_bag(messages(Wire::kRos1), "none", 99)), options);
  ASSERT_TRUE(read) << read.error();
  std::string text;
  for (const Diagnostic& d : read->diagnostics.list()) text += render(d, false);
  EXPECT_THAT(text, HasSubstr("not used: /sonar (sonar_msgs/Ping, 4 messages)"));
  EXPECT_THAT(text, HasSubstr("preset euroc is untested"));
  EXPECT_THAT(text, HasSubstr("the poses of /truth are taken as poses of the IMU"));
}

TEST_F(Bag, ReadsEachEncodingOfImages) {
  std::string rgb;
  std::string bgr;
  std::string wide;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const std::string pixel = {char(10), char(200), char(30)};
    rgb += pixel;
    bgr.append(pixel.rbegin(), pixel.rend());
    wide += std::string("\x07\x55", 2);
  }
  // Rows with a gap at their end.
  std::string padded;
  for (int y = 0; y < kHeight; ++y) padded += std::string(kWidth, 'A') + "****";
  const auto png = to_gray_png(image(3, 0));
  const struct {
    Written message;
    int pixel;
  } cases[] = {{testing::image_message(Wire::kCdr, "/cam0/image_raw", kStart, "rgb8", kWidth,
                                       kHeight, 3 * kWidth, rgb),
                124},  // 0.299 * 10 + 0.587 * 200 + 0.114 * 30
               {testing::image_message(Wire::kCdr, "/cam0/image_raw", kStart, "bgr8", kWidth,
                                       kHeight, 3 * kWidth, bgr),
                124},
               {testing::image_message(Wire::kCdr, "/cam0/image_raw", kStart, "mono16", kWidth,
                                       kHeight, 2 * kWidth, wide),
                0x55},
               {testing::image_message(Wire::kCdr, "/cam0/image_raw", kStart, "mono8", kWidth,
                                       kHeight, kWidth + 4, padded),
                'A'},
               {testing::compressed_message(Wire::kCdr, "/cam0/image_raw", kStart, *png), 3 + 5}};
  for (const auto& [message, pixel] : cases) {
    std::vector<Written> all = messages(Wire::kCdr);
    std::erase_if(all, [](const Written& w) { return w.topic == "/cam0/image_raw"; });
    all.push_back(message);
    const auto read = read_bag(write(testing::mcap(all, "lz4", 20)), options);
    ASSERT_TRUE(read) << read.error();
    const auto frame = read_image(read->cameras[0].images[0], 0);
    ASSERT_TRUE(frame) << frame.error();
    EXPECT_EQ(frame->pixels[5], pixel);
  }
}

TEST_F(Bag, ReadsJpegAndReportsDamageToIt) {
  const std::string intact = testing::jpeg_of(image(0, 0));
  const auto frame_of = [&](const std::string& data) {
    std::vector<Written> all = messages(Wire::kRos1);
    std::erase_if(all, [](const Written& w) { return w.topic == "/cam0/image_raw"; });
    all.push_back(testing::compressed_message(Wire::kRos1, "/cam0/image_raw", kStart, data));
    const auto read = read_bag(write(testing::ros1_bag(all, "none", 99)), options);
    EXPECT_TRUE(read) << read.error();
    return read_image(read->cameras[0].images[0], 0);
  };
  const auto frame = frame_of(intact);
  ASSERT_TRUE(frame) << frame.error();
  EXPECT_EQ(frame->width, kWidth);
  EXPECT_NEAR(frame->pixels[40 * kWidth + 50], image(0, 0).pixels[40 * kWidth + 50], 12);
  const auto torn = frame_of(intact.substr(0, intact.size() / 2));
  ASSERT_FALSE(torn);
  EXPECT_THAT(torn.error(), HasSubstr("recording.bag /cam0/image_raw, message 1: damaged JPEG"));
  EXPECT_FALSE(frame_of(""));
  EXPECT_FALSE(frame_of("no image at all"));
}

TEST_F(Bag, ReportsTopicsThatCannotBeChosen) {
  std::vector<Written> all = messages(Wire::kRos1);
  all.push_back(testing::imu_message(Wire::kRos1, "/other_imu", kStart, gyro(0), accel(0)));
  const std::string two = testing::ros1_bag(all, "none", 99);
  EXPECT_EQ(error_of(two), "it is read") << "the calibration names /imu0";
  options.calibration.pop_back();
  EXPECT_THAT(error_of(two), HasSubstr("2 topics of IMUs: choose with --topic imu=NAME; its "
                                       "topics: /imu0 (sensor_msgs/Imu, 40 messages)"));
  options.topics["imu"] = "/other_imu";
  EXPECT_EQ(error_of(two), "it is read");
  options.topics["imu"] = "/sonar";
  EXPECT_THAT(error_of(two), HasSubstr("/sonar is of type sonar_msgs/Ping, which imu cannot be"));
  options.topics["imu"] = "/nowhere";
  EXPECT_THAT(error_of(two), HasSubstr("there is no topic /nowhere"));
  options.topics = {};
  options.preset = "euroc";
  EXPECT_EQ(error_of(two), "it is read") << "the preset names /imu0";
}

TEST_F(Bag, ReportsCalibrationsThatAreNone) {
  const std::string bag = testing::ros1_bag(messages(Wire::kRos1), "none", 99);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = camchain();
    text.replace(text.find(from), from.size(), to);
    testing::write_text(folder + "/camchain.yaml", text);
    return error_of(bag);
  };
  EXPECT_THAT(with("T_cam_imu:", "T_other:"),
              HasSubstr("camchain.yaml:4: cam0 has no T_cam_imu; a chain of cameras"));
  EXPECT_THAT(with("0.002", "2.0"), HasSubstr("camchain.yaml:15: a time shift of 2 s"));
  EXPECT_THAT(with("[0.0, -1.0, 0.0, 0.05]", "[0.0, -1.0]"), HasSubstr("16 numbers"));
  EXPECT_THAT(with("[0.0, -1.0, 0.0, 0.05]", "[0.0, -1.0, 0.0, 1e300]"),
              HasSubstr("T_cam_imu is not a pose"));
  options.calibration = {folder + "/imu.yaml"};
  EXPECT_THAT(error_of(bag), HasSubstr("no camera is calibrated there"));
  testing::write_text(folder + "/other.yaml", "a: 1\n");
  options.calibration = {folder + "/other.yaml"};
  EXPECT_THAT(error_of(bag), HasSubstr("other.yaml: no calibration"));
  options.calibration = {folder + "/nowhere.yaml"};
  EXPECT_THAT(error_of(bag), HasSubstr("nowhere.yaml: no such file"));
}

TEST_F(Bag, ReportsMessagesThatAreNone) {
  std::vector<Written> all = messages(Wire::kRos1);
  all[6].bytes.resize(100);  // the second of the IMU
  EXPECT_THAT(error_of(testing::ros1_bag(all, "none", 99)),
              HasSubstr("recording.bag /imu0, message 2: the message is shorter than its type"));
  EXPECT_THAT(error_of(testing::mcap(messages(Wire::kRos1), "", 99, "json")),
              HasSubstr("/imu0, message 1: the message is shorter than its type, or of another "
                        "encoding"));
  EXPECT_THAT(error_of("a text"), HasSubstr("recording.bag: neither a ROS 1 bag"));
  EXPECT_THAT(error_of(""), HasSubstr("neither a ROS 1 bag"));
}

TEST_F(Bag, PutsMessagesInOrderAndIgnoresRepeatedStamps) {
  std::vector<Written> all = messages(Wire::kRos1);
  std::reverse(all.begin(), all.end());
  all.push_back(testing::imu_message(Wire::kRos1, "/imu0", kStart, gyro(9), accel(9)));
  const auto read = read_bag(write(testing::ros1_bag(all, "none", 9)), options);
  ASSERT_TRUE(read) << read.error();
  expect_the_messages(*read);
  EXPECT_EQ(read->imu[0].gyro_B, gyro(0)) << "the first message of that time";
  EXPECT_EQ(read->imu_origin.lines[1], 39U);
  EXPECT_EQ(read->diagnostics.warning_count(), 1U);
}

TEST_F(Bag, RecognisesPressureInHectopascal) {
  std::vector<Written> all = messages(Wire::kRos1);
  std::erase_if(all, [](const Written& w) { return w.topic == "/pressure"; });
  all.push_back(testing::pressure_message(Wire::kRos1, "/pressure", kStart, 2013.25));
  const auto read = read_bag(write(testing::ros1_bag(all, "none", 99)), options);
  ASSERT_TRUE(read) << read.error();
  EXPECT_NEAR(read->depth.at(0).depth_m, 1e5 / (1025 * 9.81), 1e-9);
  EXPECT_EQ(read->diagnostics.warning_count(), 1U);
}

TEST_F(Bag, ReadsVelocitiesOfTheTopicThatIsNamed) {
  std::vector<Written> all = messages(Wire::kRos1);
  all.push_back(testing::velocity_message(Wire::kRos1, "/dvl", kStart, {0.4, -0.1, 0.0}));
  const std::string path = write(testing::ros1_bag(all, "none", 99));
  const auto unnamed = read_bag(path, options);
  ASSERT_TRUE(unnamed) << unnamed.error();
  EXPECT_TRUE(unnamed->velocity.empty()) << "it may be a command";
  options.topics["velocity"] = "/dvl";
  const auto named = read_bag(path, options);
  ASSERT_TRUE(named) << named.error();
  ASSERT_EQ(named->velocity.size(), 1U);
  EXPECT_EQ(named->velocity[0].v_B, Vector3d(0.4, -0.1, 0.0));
  EXPECT_EQ(named->velocity[0].sigma, kDvlSigma);
  options.topics["velocity"] = "/truth";
  EXPECT_THAT(read_bag(path, options).error(), HasSubstr("which velocity cannot be"));
}

// Few messages, so that every byte can be tried.
std::vector<Written> few(Wire wire) {
  std::vector<Written> all;
  for (const Written& message : messages(wire)) {
    if (message.type == "sensor_msgs/Image") continue;
    if (all.size() < 8) all.push_back(message);
  }
  all.push_back(testing::image_message(wire, "/cam0/image_raw", kStart, "mono8", 4, 2, 4,
                                       std::string(8, 'x')));
  all.push_back(testing::image_message(wire, "/cam1/image_raw", kStart, "mono8", 4, 2, 4,
                                       std::string(8, 'x')));
  return all;
}

/// Reads a file that may be damaged, and all its images. Any result is right, a crash is not.
bool reads(const std::string& path, const BagOptions& options) {
  const auto recording = read_bag(path, options);
  if (!recording) {
    EXPECT_THAT(recording.error(), HasSubstr(path));
    return false;
  }
  for (const RecordedCamera& eye : recording->cameras) {
    for (const RecordedImage& frame : eye.images) static_cast<void>(read_image(frame, 0));
  }
  return true;
}

TEST_F(Bag, ReportsEveryTruncation) {
  const std::string bag = testing::ros1_bag(few(Wire::kRos1), "lz4", 5);
  for (std::size_t size = 0; size < bag.size(); ++size) {
    const bool is_read = reads(write(bag.substr(0, size)), options);
    if (!is_read) continue;
    // Cut between two records of the index, all messages are there.
    EXPECT_GT(size, bag.size() / 2);
    EXPECT_EQ(read_bag(write(bag.substr(0, size)), options)->imu.size(), 5U);
  }
  const std::string file = testing::mcap(few(Wire::kCdr), "zstd", 5);
  const std::size_t tail = 8 + 9 + 20;  // the footer and the magic, after the end of the data
  for (std::size_t size = 0; size < file.size() - tail; ++size) {
    EXPECT_FALSE(reads(write(file.substr(0, size)), options)) << size;
  }
}

std::string sqlite_bag(const std::string& path) {
  testing::write_sqlite_bag(path, few(Wire::kCdr));
  return dive::testing::content_of(path);
}

TEST_F(Bag, ReportsTruncatedDatabases) {
  const std::string file = sqlite_bag(folder + "/intact.db3");
  ASSERT_TRUE(reads(write(file), options));
  for (std::size_t size = 0; size < file.size(); size += 64) {
    EXPECT_FALSE(reads(write(file.substr(0, size)), options)) << size;
  }
}

void flip_bytes(const std::string& path, const std::string& file, std::size_t step,
                const BagOptions& options) {
  constexpr char kFlips[] = {'\x01', '\x80', '\xFF'};
  for (std::size_t i = 0; i < file.size(); i += step) {
    std::string damaged = file;
    damaged[i] = static_cast<char>(damaged[i] ^ kFlips[i % std::size(kFlips)]);
    testing::write_text(path, damaged);
    static_cast<void>(reads(path, options));
  }
}

TEST_F(Bag, SurvivesEveryFlippedByte) {
  for (const std::string& file : {testing::ros1_bag(few(Wire::kRos1), "none", 5),
                                  testing::ros1_bag(few(Wire::kRos1), "bz2", 99),
                                  testing::mcap(few(Wire::kCdr), "no chunks", 5),
                                  testing::mcap(few(Wire::kCdr), "lz4", 99)}) {
    flip_bytes(folder + "/flipped.bag", file, 1, options);
  }
  // Most of a database is empty.
  flip_bytes(folder + "/flipped.bag", sqlite_bag(folder + "/intact.db3"), 7, options);
}

TEST_F(Bag, NoticesDamageByTheChecksum) {
  std::string file = testing::mcap(messages(Wire::kCdr), "", 999);
  file[file.size() / 2] = static_cast<char>(file[file.size() / 2] ^ 4);
  EXPECT_THAT(error_of(file), HasSubstr("a chunk's checksum does not agree with its content"));
}

}  // namespace
}  // namespace dive::estimation
