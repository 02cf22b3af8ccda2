// MCAP, read back by a reader written from the specification (https://mcap.dev/spec).

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mission/export/export_format.h"
#include "mission/export/mcap_writer.h"

namespace dive::mission {
namespace {

struct Cursor {
  std::string_view bytes;
  std::size_t at = 0;

  template <class T>
  T take() {
    T value{};
    if (at + sizeof value > bytes.size()) throw std::runtime_error("truncated");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  }
  std::string_view take_bytes(std::size_t count) {
    if (at + count > bytes.size()) throw std::runtime_error("truncated");
    at += count;
    return bytes.substr(at - count, count);
  }
  std::string text() { return std::string(take_bytes(take<std::uint32_t>())); }
};

struct Message {
  std::uint16_t channel = 0;
  std::uint64_t time_ns = 0;
  std::string json;
};

struct Read {
  std::map<std::uint16_t, std::string> schemas;  // in the data section: id to name
  std::map<std::uint16_t, std::string> topics;
  std::map<std::uint16_t, std::uint16_t> schema_of;
  std::vector<Message> messages;
  std::size_t chunks = 0;
};

std::uint32_t crc(std::string_view bytes) {  // IEEE 802.3, bit by bit
  std::uint32_t value = 0xFFFFFFFFU;
  for (const char c : bytes) {
    value ^= static_cast<unsigned char>(c);
    for (int i = 0; i < 8; ++i) value = (value >> 1U) ^ ((value & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~value;
}

// Records from `cursor` on; those of chunks as well.
void read_records(Cursor cursor, Read& read) {
  while (cursor.at < cursor.bytes.size()) {
    const auto opcode = cursor.take<std::uint8_t>();
    Cursor record{cursor.take_bytes(cursor.take<std::uint64_t>())};
    if (opcode == 0x0F) return;  // the summary repeats what came before
    if (opcode == 0x03) {
      const auto id = record.take<std::uint16_t>();
      read.schemas[id] = record.text();
      EXPECT_EQ(record.text(), "jsonschema");
      EXPECT_TRUE(nlohmann::json::accept(record.text())) << read.schemas[id];
    } else if (opcode == 0x04) {
      const auto id = record.take<std::uint16_t>();
      read.schema_of[id] = record.take<std::uint16_t>();
      read.topics[id] = record.text();
      EXPECT_EQ(record.text(), "json");
    } else if (opcode == 0x05) {
      Message message;
      message.channel = record.take<std::uint16_t>();
      record.take<std::uint32_t>();
      message.time_ns = record.take<std::uint64_t>();
      EXPECT_EQ(record.take<std::uint64_t>(), message.time_ns);
      message.json = record.bytes.substr(record.at);
      EXPECT_TRUE(read.topics.contains(message.channel)) << "a channel comes before its messages";
      read.messages.push_back(message);
    } else if (opcode == 0x06) {
      ++read.chunks;
      record.take<std::uint64_t>();
      record.take<std::uint64_t>();
      const auto size = record.take<std::uint64_t>();
      const auto sum = record.take<std::uint32_t>();
      EXPECT_EQ(record.text(), "");
      const std::string_view content = record.take_bytes(record.take<std::uint64_t>());
      EXPECT_EQ(content.size(), size);
      EXPECT_EQ(crc(content), sum);
      read_records({content}, read);
    }
  }
}

Read read_file(const std::string& file) {
  const std::string magic("\x89MCAP0\r\n", 8);
  EXPECT_EQ(file.substr(0, 8), magic);
  EXPECT_EQ(file.substr(file.size() - 8), magic);
  Read read;
  read_records({std::string_view(file).substr(8)}, read);
  return read;
}

// Messages found through the summary alone: footer, chunk indices, message indices.
std::size_t indexed_messages(const std::string& file) {
  Cursor footer{std::string_view(file).substr(file.size() - 8 - 29, 29)};
  EXPECT_EQ(footer.take<std::uint8_t>(), 0x02);
  EXPECT_EQ(footer.take<std::uint64_t>(), 20U);
  const auto start = footer.take<std::uint64_t>();
  const auto offsets = footer.take<std::uint64_t>();
  Cursor summary{std::string_view(file).substr(start, offsets - start)};
  std::size_t found = 0;
  while (summary.at < summary.bytes.size()) {
    const auto opcode = summary.take<std::uint8_t>();
    Cursor record{summary.take_bytes(summary.take<std::uint64_t>())};
    if (opcode != 0x08) continue;
    record.take<std::uint64_t>();
    record.take<std::uint64_t>();
    const auto chunk_start = record.take<std::uint64_t>();
    record.take<std::uint64_t>();
    EXPECT_EQ(file[chunk_start], 0x06);
    const std::size_t records = chunk_start + 9 + 8 + 8 + 8 + 4 + 4 + 8;
    const auto entries = record.take<std::uint32_t>() / 10;
    for (std::uint32_t i = 0; i < entries; ++i) {
      const auto channel = record.take<std::uint16_t>();
      const auto offset = record.take<std::uint64_t>();
      Cursor index{std::string_view(file).substr(offset)};
      EXPECT_EQ(index.take<std::uint8_t>(), 0x07);
      index.take<std::uint64_t>();
      EXPECT_EQ(index.take<std::uint16_t>(), channel);
      for (auto left = index.take<std::uint32_t>() / 16; left > 0; --left) {
        const auto time_ns = index.take<std::uint64_t>();
        Cursor message{std::string_view(file).substr(records + index.take<std::uint64_t>())};
        EXPECT_EQ(message.take<std::uint8_t>(), 0x05);
        message.take<std::uint64_t>();
        EXPECT_EQ(message.take<std::uint16_t>(), channel);
        message.take<std::uint32_t>();
        EXPECT_EQ(message.take<std::uint64_t>(), time_ns);
        ++found;
      }
    }
  }
  return found;
}

TEST(McapWriter, EveryMessageIsReadFromTheFrontAndThroughTheIndex) {
  McapWriter writer("test");
  const auto a = writer.add_channel("/a", writer.add_schema("A", "{\"type\":\"object\"}"));
  const auto b = writer.add_channel("/b", 0);
  const std::string long_text = "{\"text\":\"" + std::string(3000, 'x') + "\"}";
  for (std::uint64_t i = 0; i < 1000; ++i) writer.write(i % 3 == 0 ? b : a, 5 * i, long_text);
  const std::string file = writer.finish();
  const Read read = read_file(file);
  EXPECT_EQ(read.topics, (std::map<std::uint16_t, std::string>{{a, "/a"}, {b, "/b"}}));
  ASSERT_EQ(read.messages.size(), 1000U);
  EXPECT_GT(read.chunks, 2U);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    EXPECT_EQ(read.messages[i].channel, i % 3 == 0 ? b : a);
    EXPECT_EQ(read.messages[i].time_ns, 5 * i);
    EXPECT_EQ(read.messages[i].json, long_text);
  }
  EXPECT_EQ(indexed_messages(file), 1000U);
}

TEST(McapWriter, AFileWithoutMessagesIsAFile) {
  McapWriter writer("test");
  (void)writer.add_channel("/a", 0);
  const std::string file = writer.finish();
  EXPECT_EQ(read_file(file).topics.size(), 1U);
  EXPECT_EQ(indexed_messages(file), 0U);
}

TEST(Mcap, ADiveHasPosesInFramesAndItsEventsInTheOrderOfTime) {
  Exported exported;
  exported.begin = 7'000'000;
  for (int i = 0; i < 100; ++i) {
    ExportedSample sample;
    sample.t_s = 0.1 * i;
    sample.truth = Pose{{0.25 * i, 1.0, -2.0}, Eigen::Quaterniond::Identity()};
    sample.estimate = sample.truth;
    sample.estimate->p.y() += 0.5;
    sample.depth_m = 2.0;
    sample.state = "go \"there\"\n\xff";
    exported.track.push_back(sample);
  }
  exported.paths.push_back({"go", "there", 1.05, {Pose(), Pose()}, 0.6});
  exported.events.push_back({2.0, true, "rung hold: imu_lost"});
  const Read read = read_file(to_mcap(exported));
  std::map<std::string, std::vector<nlohmann::json>> by_topic;
  std::uint64_t last = 0;
  for (const Message& message : read.messages) {
    EXPECT_GE(message.time_ns, last);
    last = message.time_ns;
    const auto json = nlohmann::json::parse(message.json);
    const std::string topic = read.topics.at(message.channel);
    if (topic != "/status") {
      const std::uint64_t stamp =
          json.at("timestamp").at("sec").get<std::uint64_t>() * 1'000'000'000U +
          json.at("timestamp").at("nsec").get<std::uint64_t>();
      EXPECT_EQ(stamp, message.time_ns) << topic;
    }
    by_topic[topic].push_back(json);
  }
  EXPECT_EQ(last, 16'900'000'000U) << "7 s + 9.9 s";
  ASSERT_EQ(by_topic["/truth"].size(), 100U);
  const auto& position = by_topic["/truth"][99].at("pose").at("position");
  EXPECT_NEAR(position.at("x").get<double>(), 24.75, 1e-4);
  EXPECT_NEAR(position.at("z").get<double>(), -2.0, 1e-4);
  EXPECT_NEAR(by_topic["/status"].at(3).at("error_m").get<double>(), 0.5, 1e-4);
  EXPECT_FALSE(by_topic["/status"].at(3).contains("battery_fraction")) << "it is not known";
  ASSERT_EQ(by_topic["/plan"].size(), 1U);
  EXPECT_EQ(by_topic["/plan"][0].at("poses").size(), 2U);
  ASSERT_EQ(by_topic["/events"].size(), 1U);
  EXPECT_EQ(by_topic["/events"][0].at("level"), 3);
  for (const auto& [channel, topic] : read.topics) {
    if (topic != "/plan") continue;
    EXPECT_EQ(read.schemas.at(read.schema_of.at(channel)), "foxglove.PosesInFrame");
  }
}

}  // namespace
}  // namespace dive::mission
