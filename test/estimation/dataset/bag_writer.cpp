#include "test/estimation/dataset/bag_writer.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <utility>

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

namespace dive::estimation::testing {
namespace {

template <typename Number>
std::string le(Number value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string sized(const std::string& bytes) {
  return le(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

std::string packed(const std::string& bytes, const std::string& compression) {
  if (compression == "bz2") {
    auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 1000);
    std::string to(size, '\0');
    std::string from = bytes;
    if (BZ2_bzBuffToBuffCompress(to.data(), &size, from.data(), static_cast<unsigned>(from.size()),
                                 9, 0, 0) != BZ_OK) {
      throw std::runtime_error("bz2");
    }
    to.resize(size);
    return to;
  }
  if (compression == "lz4") {
    std::string to(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
    to.resize(LZ4F_compressFrame(to.data(), to.size(), bytes.data(), bytes.size(), nullptr));
    return to;
  }
  if (compression == "zstd") {
    std::string to(ZSTD_compressBound(bytes.size()), '\0');
    to.resize(ZSTD_compress(to.data(), to.size(), bytes.data(), bytes.size(), 3));
    return to;
  }
  return bytes;
}

using Fields = std::vector<std::pair<std::string, std::string>>;

std::string fields_of(const Fields& fields) {
  std::string text;
  for (const auto& [name, value] : fields) text += sized(name + "=" + value);
  return text;
}

std::string ros1_record(const Fields& fields, const std::string& data) {
  return sized(fields_of(fields)) + sized(data);
}

std::string ros1_time(std::uint64_t ns) {
  return le(static_cast<std::uint32_t>(ns / 1'000'000'000U)) +
         le(static_cast<std::uint32_t>(ns % 1'000'000'000U));
}

std::string ros1_connection(std::uint32_t id, const Written& message) {
  return ros1_record({{"op", "\x07"}, {"conn", le(id)}, {"topic", message.topic}},
                     fields_of({{"topic", message.topic},
                                {"type", message.type},
                                {"md5sum", std::string(32, '0')},
                                {"message_definition", "..."}}));
}

std::string mcap_record(char op, const std::string& content) {
  return std::string(1, op) + le(static_cast<std::uint64_t>(content.size())) + content;
}

std::string ros2_type(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

}  // namespace

MessageWriter::MessageWriter(Wire wire) : wire_(wire) {
  if (wire == Wire::kCdr) bytes_ = std::string("\0\1\0\0", 4);
  if (wire == Wire::kBigCdr) bytes_ = std::string("\0\0\0\0", 4);
}

MessageWriter& MessageWriter::raw(const char* value, std::size_t size) {
  std::string text(value, size);
  if (wire_ == Wire::kBigCdr) std::reverse(text.begin(), text.end());
  while (wire_ != Wire::kRos1 && (bytes_.size() - 4) % size != 0) bytes_ += '\xEE';
  bytes_ += text;
  return *this;
}

MessageWriter& MessageWriter::text(const std::string& text) {
  const std::string stored = wire_ == Wire::kRos1 ? text : text + '\0';
  return array(stored);
}

MessageWriter& MessageWriter::array(const std::string& bytes) {
  number(static_cast<std::uint32_t>(bytes.size()));
  bytes_ += bytes;
  return *this;
}

MessageWriter& MessageWriter::header(std::uint64_t ns) {
  if (wire_ == Wire::kRos1) number(std::uint32_t{7});
  number(static_cast<std::uint32_t>(ns / 1'000'000'000U));
  number(static_cast<std::uint32_t>(ns % 1'000'000'000U));
  return text("frame");
}

MessageWriter& MessageWriter::vector(const Eigen::Vector3d& v) {
  return number(v.x()).number(v.y()).number(v.z());
}

MessageWriter& MessageWriter::quaternion(const Eigen::Quaterniond& q) {
  return number(q.x()).number(q.y()).number(q.z()).number(q.w());
}

MessageWriter& MessageWriter::zeros(int count) {
  for (int i = 0; i < count; ++i) number(0.0);
  return *this;
}

Written imu_message(Wire wire, const std::string& topic, std::uint64_t ns,
                    const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
  MessageWriter message(wire);
  message.header(ns).zeros(13).vector(gyro).zeros(9).vector(accel).zeros(9);
  return {topic, "sensor_msgs/Imu", ns, message.bytes()};
}

Written pressure_message(Wire wire, const std::string& topic, std::uint64_t ns, double pressure) {
  MessageWriter message(wire);
  message.header(ns).number(pressure).number(0.0);
  return {topic, "sensor_msgs/FluidPressure", ns, message.bytes()};
}

Written velocity_message(Wire wire, const std::string& topic, std::uint64_t ns,
                         const Eigen::Vector3d& v) {
  MessageWriter message(wire);
  message.header(ns).vector(v).vector({0.0, 0.0, 0.0});
  return {topic, "geometry_msgs/TwistStamped", ns, message.bytes()};
}

Written pose_message(Wire wire, const std::string& topic, std::uint64_t ns, const Pose& X) {
  MessageWriter message(wire);
  message.header(ns).vector(X.p).quaternion(X.q);
  return {topic, "geometry_msgs/PoseStamped", ns, message.bytes()};
}

Written image_message(Wire wire, const std::string& topic, std::uint64_t ns,
                      const std::string& encoding, int width, int height, int step,
                      const std::string& data) {
  MessageWriter message(wire);
  message.header(ns)
      .number(static_cast<std::uint32_t>(height))
      .number(static_cast<std::uint32_t>(width))
      .text(encoding)
      .number(std::uint8_t{0})
      .number(static_cast<std::uint32_t>(step))
      .array(data);
  return {topic, "sensor_msgs/Image", ns, message.bytes()};
}

Written gray_message(Wire wire, const std::string& topic, std::uint64_t ns,
                     const ImageFrame& image) {
  return image_message(wire, topic, ns, "mono8", image.width, image.height, image.width,
                       std::string(image.pixels.begin(), image.pixels.end()));
}

Written compressed_message(Wire wire, const std::string& topic, std::uint64_t ns,
                           const std::string& data) {
  MessageWriter message(wire);
  message.header(ns).text("mono8; compressed").array(data);
  return {topic, "sensor_msgs/CompressedImage", ns, message.bytes()};
}

std::string ros1_bag(const std::vector<Written>& messages, const std::string& compression,
                     std::size_t per_chunk) {
  const Fields header = {{"op", "\x03"},
                         {"index_pos", le(std::uint64_t{4096})},
                         {"conn_count", le(std::uint32_t{0})},
                         {"chunk_count", le(std::uint32_t{0})}};
  std::string bag = "#ROSBAG V2.0\n" + ros1_record(header, std::string(64, ' '));
  std::map<std::string, std::uint32_t> connections;
  std::string index;
  for (std::size_t begin = 0; begin < messages.size(); begin += per_chunk) {
    std::string chunk;
    for (std::size_t i = begin; i < std::min(messages.size(), begin + per_chunk); ++i) {
      const Written& message = messages[i];
      const auto next = static_cast<std::uint32_t>(connections.size());
      const auto [connection, is_new] = connections.emplace(message.topic, next);
      if (is_new) {
        chunk += ros1_connection(next, message);
        index += ros1_connection(next, message);
      }
      chunk += ros1_record(
          {{"op", "\x02"}, {"conn", le(connection->second)}, {"time", ros1_time(message.ns)}},
          message.bytes);
    }
    bag += ros1_record({{"op", "\x05"},
                        {"compression", compression},
                        {"size", le(static_cast<std::uint32_t>(chunk.size()))}},
                       packed(chunk, compression));
    bag += ros1_record({{"op", "\x04"},
                        {"ver", le(std::uint32_t{1})},
                        {"conn", le(std::uint32_t{0})},
                        {"count", le(std::uint32_t{0})}},
                       "");
  }
  return bag + index;
}

std::string mcap(const std::vector<Written>& messages, const std::string& compression,
                 std::size_t per_chunk, const std::string& encoding) {
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string file = magic + mcap_record('\x01', sized("") + sized("a test"));
  std::map<std::string, std::uint16_t> channels;
  for (std::size_t begin = 0; begin < messages.size(); begin += per_chunk) {
    std::string records;
    for (std::size_t i = begin; i < std::min(messages.size(), begin + per_chunk); ++i) {
      const Written& message = messages[i];
      const auto next = static_cast<std::uint16_t>(channels.size() + 1);
      const auto [channel, is_new] = channels.emplace(message.topic, next);
      if (is_new) {
        const std::string type = encoding == "cdr" ? ros2_type(message.type) : message.type;
        records += mcap_record('\x03', le(next) + sized(type) + sized("ros2msg") + sized("..."));
        records += mcap_record(
            '\x04', le(next) + le(next) + sized(message.topic) + sized(encoding) + sized(""));
      }
      records += mcap_record('\x05', le(channel->second) + le(static_cast<std::uint32_t>(i)) +
                                         le(message.ns) + le(message.ns) + message.bytes);
    }
    if (compression == "no chunks") {
      file += records;
      continue;
    }
    const auto crc = static_cast<std::uint32_t>(crc32(
        0, reinterpret_cast<const Bytef*>(records.data()), static_cast<uInt>(records.size())));
    const std::string stored = packed(records, compression);
    file += mcap_record('\x06', le(messages[begin].ns) + le(messages[begin].ns) +
                                    le(static_cast<std::uint64_t>(records.size())) + le(crc) +
                                    sized(compression) +
                                    le(static_cast<std::uint64_t>(stored.size())) + stored);
  }
  file += mcap_record('\x0F', le(std::uint32_t{0}));
  file += mcap_record('\x02', le(std::uint64_t{0}) + le(std::uint64_t{0}) + le(std::uint32_t{0}));
  return file + magic;
}

void write_sqlite_bag(const std::string& path, const std::vector<Written>& messages) {
  const auto must = [](bool done) {
    if (!done) throw std::runtime_error("sqlite3");
  };
  std::remove(path.c_str());
  sqlite3* database = nullptr;
  must(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  const auto run = [&](const std::string& sql, const std::string& blob) {
    sqlite3_stmt* statement = nullptr;
    must(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK);
    if (!blob.empty()) {
      must(sqlite3_bind_blob(statement, 1, blob.data(), static_cast<int>(blob.size()),
                             SQLITE_STATIC) == SQLITE_OK);
    }
    must(sqlite3_step(statement) == SQLITE_DONE);
    sqlite3_finalize(statement);
  };
  run("BEGIN", "");
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)",
      "");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER "
      "NOT NULL, data BLOB NOT NULL)",
      "");
  std::map<std::string, std::size_t> topics;
  for (const Written& message : messages) {
    const auto [topic, is_new] = topics.emplace(message.topic, topics.size() + 1);
    if (is_new) {
      run("INSERT INTO topics VALUES(" + std::to_string(topic->second) + ", '" + message.topic +
              "', '" + ros2_type(message.type) + "', 'cdr', '')",
          "");
    }
    run("INSERT INTO messages(topic_id, timestamp, data) VALUES(" + std::to_string(topic->second) +
            ", " + std::to_string(message.ns) + ", ?1)",
        message.bytes);
  }
  run("COMMIT", "");
  sqlite3_close(database);
}

}  // namespace dive::estimation::testing
