#pragma once
// Messages of a recording file: ROS 1 bags (format 2.0), MCAP files, and bags of ROS 2 in sqlite3.
// The whole file is scanned when it is opened, so that neither an index nor a summary is needed; a
// message's bytes are read when they are asked for.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "common/input_file.h"
#include "estimation/dataset/bag/byte_reader.h"

namespace dive::estimation {

enum class Serialization { kRos1, kCdr, kOther };

struct BagTopic {
  std::string name;
  std::string type;  ///< As in ROS 1, "sensor_msgs/Imu", in files of ROS 2 too.
  Serialization serialization = Serialization::kOther;
  std::size_t messages = 0;
};

/// Where a message is stored.
struct BagMessage {
  std::uint32_t topic = 0;
  std::uint32_t chunk = 0;
  std::uint32_t offset = 0;  ///< In the decompressed chunk.
  std::uint32_t size = 0;
};

/// A run of messages, perhaps compressed.
struct BagChunk {
  std::uint64_t offset = 0;  ///< In the file; in a database, the message's row.
  std::uint64_t stored = 0;  ///< Bytes in the file.
  std::uint64_t size = 0;    ///< Bytes decompressed.
  std::string compression;
};

struct BagIndex {
  std::vector<BagTopic> topics;
  std::vector<BagChunk> chunks;
  std::vector<BagMessage> messages;   ///< In the order of the file.
  std::vector<std::string> warnings;  ///< What may be missing, as clauses.

  /// Index of the topic of that name, type and serialization, which is added if it is new.
  [[nodiscard]] std::uint32_t topic_index(const BagTopic& topic);
};

/// Reads ranges of a file.
class FileRange {
 public:
  /// The error is a clause.
  [[nodiscard]] static tl::expected<FileRange, std::string> open(const std::string& path);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Exactly `count` bytes. The error is a clause.
  [[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> read(
      std::uint64_t offset, std::uint64_t count) const;

 private:
  Descriptor file_;
  std::uint64_t size_ = 0;
};

/// Reads and decompresses a chunk. The error is a clause.
[[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> read_chunk(
    const FileRange& file, const BagChunk& chunk);

/// Reads and decompresses a chunk; the error is a clause.
using ChunkLoader =
    std::function<tl::expected<std::vector<std::uint8_t>, std::string>(const BagChunk&)>;

/// Scans a file of that format. The error is "byte N: what", or of a database a clause.
[[nodiscard]] tl::expected<BagIndex, std::string> scan_ros1_bag(const FileRange& file);
[[nodiscard]] tl::expected<BagIndex, std::string> scan_mcap(const FileRange& file);
struct ScannedDatabase {
  BagIndex index;
  ChunkLoader load;  ///< Keeps the database open.
};
[[nodiscard]] tl::expected<ScannedDatabase, std::string> scan_sqlite(const std::string& path);

/// "sensor_msgs/msg/Imu" of ROS 2 as "sensor_msgs/Imu" of ROS 1.
[[nodiscard]] std::string ros1_name(std::string_view type);

class BagFile {
 public:
  /// The format is recognised by the file's first bytes. An error names the file.
  [[nodiscard]] static tl::expected<std::shared_ptr<BagFile>, std::string> open(
      const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::vector<BagTopic>& topics() const { return index_.topics; }
  [[nodiscard]] const std::vector<BagMessage>& messages() const { return index_.messages; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return index_.warnings; }

  /// The bytes of a message, valid until the next call; the last chunks are kept, so that messages
  /// in order are cheap. An error names the file. Not for several threads.
  [[nodiscard]] tl::expected<Bytes, std::string> read(const BagMessage& message);

 private:
  BagFile(std::string path, BagIndex index, ChunkLoader load);

  struct Kept {
    std::uint32_t chunk = 0;
    std::vector<std::uint8_t> bytes;
  };

  std::string path_;
  BagIndex index_;
  ChunkLoader load_;
  std::vector<Kept> kept_;  // the most recent last
};

}  // namespace dive::estimation
