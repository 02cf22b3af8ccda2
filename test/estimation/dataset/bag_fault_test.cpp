// Bags with one thing wrong, which is no reason to refuse the rest.

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/dataset/bag/bag_recording.h"
#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/dataset/bag_writer.h"
#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using ::testing::HasSubstr;
using testing::Wire;
using testing::Written;

constexpr std::uint64_t kFirst_ns = 1'403'715'285'000'000'000U;  // ns
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::uint64_t at(int k) { return kFirst_ns + 5'000'000U * static_cast<std::uint64_t>(k); }

/// Twenty samples of an IMU and two images.
std::vector<Written> plain_messages(Wire wire) {
  std::vector<Written> all;
  for (int k = 0; k < 20; ++k) {
    all.push_back(testing::imu_message(wire, "/imu", at(k), {0, 0, 0.01 * k}, {0, 0, 9.81}));
    if (k % 10 != 0) continue;
    all.push_back(testing::image_message(wire, "/camera", at(k), "mono8", 4, 2, 4, "12345678"));
  }
  return all;
}

class BagFault : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = testing::fresh_folder();
    testing::write_text(folder + "/camera.yaml", testing::camera_yaml(testing::test_camera(0.0)));
    options.calibration = {folder + "/camera.yaml"};
  }
  [[nodiscard]] auto read(const std::string& content) const {
    testing::write_text(folder + "/recording.bag", content);
    return read_bag(folder + "/recording.bag", options);
  }

  std::string folder;
  BagOptions options;
};

std::string text_of(const Recording& recording) {
  std::string text;
  for (const Diagnostic& d : recording.diagnostics.list()) text += render(d, false);
  return text;
}

TEST_F(BagFault, SamplesThatAreNoMeasurement) {
  std::vector<Written> all = plain_messages(Wire::kRos1);
  const Wire wire = Wire::kRos1;
  all.push_back(testing::velocity_message(wire, "/dvl", at(1), {kNaN, kNaN, kNaN}));
  all.push_back(testing::velocity_message(wire, "/dvl", at(2), {0.4, 0.0, 0.0}));
  all.push_back(testing::pressure_message(wire, "/pressure", at(1), kNaN));
  all.push_back(testing::pressure_message(wire, "/pressure", at(2), 101'325.0));
  all.push_back(testing::pose_message(wire, "/truth", at(1), {{1, 2, 3}, {0, 0, 0, 0}}));
  all.push_back(testing::pose_message(wire, "/truth", at(2), {{1, kNaN, 3}, {1, 0, 0, 0}}));
  all.push_back(testing::pose_message(wire, "/truth", at(3), {{1, 2, 3}, {1, 0, 0, 0}}));
  options.topics = {{"velocity", "/dvl"}, {"truth", "/truth"}};
  const auto recording = read(testing::ros1_bag(all, "none", 9));
  ASSERT_TRUE(recording) << recording.error();
  ASSERT_EQ(recording->velocity.size(), 1U);
  EXPECT_EQ(recording->velocity[0].v_B.x(), 0.4);
  ASSERT_EQ(recording->depth.size(), 1U);
  EXPECT_NEAR(recording->depth[0].depth_m, 0.0, 1e-9);
  ASSERT_EQ(recording->truth.size(), 1U);
  const std::string text = text_of(*recording);
  EXPECT_THAT(text, HasSubstr("/dvl:1: warning: a velocity that is not finite"));
  EXPECT_THAT(text, HasSubstr("/pressure:1: warning: a depth that is not finite"));
  EXPECT_THAT(text,
              HasSubstr("/truth:1: warning: a true attitude whose quaternion is not of length "
                        "1; it and 1 more such samples are refused"));
}

// Two nodes publish one topic. Without chunks there is no checksum to correct.
TEST_F(BagFault, ChannelsOfOneTopicInMcap) {
  std::vector<Written> all = plain_messages(Wire::kCdr);
  for (std::size_t i = 0; i < all.size(); i += 2) {
    if (all[i].topic == "/imu") all[i].topic = "/imX";
  }
  std::string file = testing::mcap(all, "no chunks", 9);
  for (std::size_t i = file.find("/imX"); i != std::string::npos; i = file.find("/imX")) {
    file.replace(i, 4, "/imu");
  }
  const auto recording = read(file);
  ASSERT_TRUE(recording) << recording.error();
  EXPECT_EQ(recording->imu.size(), 20U);
}

std::string le32(std::size_t value) {
  const auto number = static_cast<std::uint32_t>(value);
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

std::string ros1_field(const std::string& text) { return le32(text.size()) + text; }

// A recorder that was killed leaves its open chunk with a length of zero, then its records.
TEST_F(BagFault, ARos1BagThatWasNotClosed) {
  const std::vector<Written> all = plain_messages(Wire::kRos1);
  std::string bag = testing::ros1_bag(all, "none", 99);
  const std::string chunk =
      ros1_field("op=\x05") + ros1_field("compression=none") + ros1_field("size=" + le32(0));
  bag += le32(chunk.size()) + chunk + le32(0);
  const Written more = testing::imu_message(Wire::kRos1, "/imu", at(20), {0, 0, 0}, {0, 0, 9.81});
  const std::string head = ros1_field("op=\x02") + ros1_field("conn=" + le32(0)) +
                           ros1_field("time=" + std::string(8, '\0'));
  bag += le32(head.size()) + head + le32(more.bytes.size()) + more.bytes;
  const std::string index_pos = "index_pos=";
  bag.replace(bag.find(index_pos) + index_pos.size(), 8, std::string(8, '\0'));
  const auto recording = read(bag);
  ASSERT_TRUE(recording) << recording.error();
  EXPECT_EQ(recording->imu.size(), 21U);
  EXPECT_THAT(text_of(*recording), HasSubstr("warning: the bag was not closed"));

  bag.resize(bag.size() - 10);
  const auto cut = read(bag);
  ASSERT_FALSE(cut);
  EXPECT_THAT(cut.error(), HasSubstr("beyond the end of the file; rosbag reindex may repair"));
}

TEST_F(BagFault, AnMcapFileThatWasNotClosed) {
  const std::string file = testing::mcap(plain_messages(Wire::kCdr), "", 9);
  const auto cut = read(file.substr(0, file.size() / 2));
  ASSERT_FALSE(cut);
  EXPECT_THAT(cut.error(), HasSubstr("mcap recover copies what is whole"));
}

TEST_F(BagFault, ADatabaseWithAJournal) {
  const std::string path = folder + "/recording.db3";
  testing::write_sqlite_bag(path, plain_messages(Wire::kCdr));
  const auto closed = read_bag(path, options);
  ASSERT_TRUE(closed) << closed.error();
  EXPECT_EQ(closed->diagnostics.warning_count(), 0U);
  testing::write_text(path + "-wal", "pages");
  const auto open = read_bag(path, options);
  ASSERT_TRUE(open) << open.error();
  EXPECT_THAT(text_of(*open), HasSubstr("recording.db3-wal is not read"));
}

TEST_F(BagFault, CompressionOutsideOfChunks) {
  const std::string magic = "\x28\xB5\x2F\xFD";
  const auto whole = read(magic + "and more");
  ASSERT_FALSE(whole);
  EXPECT_THAT(whole.error(), HasSubstr("decompress it first: zstd -d"));
  std::vector<Written> all = plain_messages(Wire::kCdr);
  for (Written& message : all) message.bytes = magic + "and more";
  const auto each = read(testing::mcap(all, "", 9));
  ASSERT_FALSE(each);
  EXPECT_THAT(each.error(), HasSubstr("the message is compressed by zstd"));
}

// The upper eight bits of 16 would be nearly black.
TEST_F(BagFault, ImagesOf12BitsIn16) {
  std::vector<Written> all = plain_messages(Wire::kRos1);
  std::erase_if(all, [](const Written& message) { return message.topic == "/camera"; });
  for (const char* const upper : {"\x01", "\x0F"}) {
    std::string pixels;
    for (int i = 0; i < 8; ++i) pixels += std::string("\x20") + upper;
    all.push_back(testing::image_message(Wire::kRos1, "/camera", at(all.size() == 20 ? 0 : 10),
                                         "mono16", 4, 2, 8, pixels));
  }
  const auto recording = read(testing::ros1_bag(all, "none", 99));
  ASSERT_TRUE(recording) << recording.error();
  const int expected[] = {0x12, 0xF2};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto frame = read_image(recording->cameras[0].images[i], 0);
    ASSERT_TRUE(frame) << frame.error();
    EXPECT_EQ(frame->pixels[3], expected[i]);
  }
  EXPECT_THAT(text_of(*recording), HasSubstr("its images of 16 bits use 12 of them"));
}

TEST_F(BagFault, PosesWithoutATopicForTheTruth) {
  std::vector<Written> all = plain_messages(Wire::kRos1);
  all.push_back(testing::pose_message(Wire::kRos1, "/goal", at(1), {{9, 9, 9}, {1, 0, 0, 0}}));
  const auto recording = read(testing::ros1_bag(all, "none", 99));
  ASSERT_TRUE(recording) << recording.error();
  EXPECT_TRUE(recording->truth.empty()) << "it is the vehicle's goal";
  EXPECT_THAT(text_of(*recording), HasSubstr("--topic truth=NAME"));
}

}  // namespace
}  // namespace dive::estimation
