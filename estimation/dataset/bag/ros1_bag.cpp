// ROS 1 bags, format 2.0 (http://wiki.ros.org/Bags/Format/2.0): records of a header (fields
// `name=value`) and data. Connections name the topics; chunks hold messages and connections. The
// index at the end is not used.

#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/decompress.h"

namespace dive::estimation {
namespace {

constexpr std::uint64_t kMagicBytes = 13;
constexpr std::uint32_t kMaxHeaderBytes = 1U << 20U;

// Records of the index have other codes.
enum Op : std::uint8_t { kMessage = 0x02, kFileHeader = 0x03, kChunk = 0x05, kConnection = 0x07 };

using Failure = tl::unexpected<std::string>;
using Fields = std::map<std::string_view, Bytes>;

std::optional<Fields> read_fields(Bytes header) {
  Fields fields;
  for (ByteReader reader(header); !reader.at_end();) {
    const std::string_view field = reader.take_text();
    const std::size_t equals = field.find('=');
    if (!reader.ok() || equals == std::string_view::npos) return std::nullopt;
    const std::string_view value = field.substr(equals + 1);
    fields[field.substr(0, equals)] = {reinterpret_cast<const std::uint8_t*>(value.data()),
                                       value.size()};
  }
  return fields;
}

template <typename Number>
std::optional<Number> number(const Fields& fields, std::string_view name) {
  const auto it = fields.find(name);
  if (it == fields.end() || it->second.size() != sizeof(Number)) return std::nullopt;
  return ByteReader(it->second).take<Number>();
}

std::string text(const Fields& fields, std::string_view name) {
  const auto it = fields.find(name);
  if (it == fields.end()) return {};
  return {reinterpret_cast<const char*>(it->second.data()), it->second.size()};
}

class Scan {
 public:
  explicit Scan(const FileRange& file) : file_(file) {}

  tl::expected<BagIndex, std::string> run() {
    std::uint64_t at = kMagicBytes;
    while (at < file_.size()) {
      const auto next = read_record(at);
      if (!next) {
        return Failure(
            fmt::format("byte {}: {}; rosbag reindex may repair the bag", at, next.error()));
      }
      at = *next;
    }
    if (!has_header_) return Failure("byte 13: the bag's header record is missing");
    return std::move(index_);
  }

 private:
  // Returns where the next record begins.
  tl::expected<std::uint64_t, std::string> read_record(std::uint64_t at) {
    const auto header_length = read_length(at);
    if (!header_length) return Failure(header_length.error());
    if (*header_length > kMaxHeaderBytes) {
      return Failure(fmt::format("a record's header of {} bytes", *header_length));
    }
    const auto header = file_.read(at + 4, *header_length);
    if (!header) return Failure(header.error());
    const auto fields = read_fields(*header);
    const auto op = fields ? number<std::uint8_t>(*fields, "op") : std::nullopt;
    if (!op) return Failure("a record's header is damaged");
    const std::uint64_t data_at = at + 4 + *header_length + 4;
    const auto data_length = read_length(data_at - 4);
    if (!data_length) return Failure(data_length.error());
    if (*data_length > file_.size() - data_at) {
      return Failure(
          fmt::format("a record of {} bytes goes beyond the end of the file", *data_length));
    }
    std::string wrong;
    if (*op == kFileHeader) take_file_header(*fields);
    if (*op == kChunk) wrong = take_chunk(*fields, data_at, *data_length);
    if (*op == kConnection || *op == kMessage) {
      wrong = take_unchunked(*op, *fields, data_at, *data_length);
    }
    if (!wrong.empty()) return Failure(wrong);
    return data_at + *data_length;
  }

  void take_file_header(const Fields& fields) {
    has_header_ = true;
    if (number<std::uint64_t>(fields, "index_pos").value_or(0) != 0) return;
    index_.warnings.emplace_back(
        "the bag was not closed, so that its end may be missing; rosbag reindex repairs it");
  }

  // A record outside of chunks: of the index, or of the chunk that was open when the recorder died.
  std::string take_unchunked(std::uint8_t op, const Fields& fields, std::uint64_t at,
                             std::uint32_t length) {
    const BagChunk chunk{at, length, length, "none"};
    const auto data = read_chunk(file_, chunk);
    if (!data) return data.error();
    if (op == kConnection) return take_connection(fields, *data);
    index_.chunks.push_back(chunk);
    return take_message(fields, *data, *data);
  }

  tl::expected<std::uint32_t, std::string> read_length(std::uint64_t at) const {
    const auto bytes = file_.read(at, 4);
    if (!bytes) return Failure(bytes.error());
    return ByteReader(*bytes).take<std::uint32_t>();
  }

  std::string take_chunk(const Fields& fields, std::uint64_t at, std::uint32_t length) {
    const auto size = number<std::uint32_t>(fields, "size");
    if (!size) return "a chunk's header is damaged";
    if (length == 0) return {};  // still open: its records follow
    const BagChunk chunk{at, length, *size, text(fields, "compression")};
    const auto bytes = read_chunk(file_, chunk);
    if (!bytes) return bytes.error();
    index_.chunks.push_back(chunk);
    ByteReader reader(*bytes);
    while (!reader.at_end()) {
      const auto inner = read_fields(reader.take_bytes(reader.take<std::uint32_t>()));
      const auto op = inner ? number<std::uint8_t>(*inner, "op") : std::nullopt;
      const Bytes data = reader.take_bytes(reader.take<std::uint32_t>());
      if (!reader.ok() || !op) return "a record in a chunk is damaged";
      const std::string wrong = *op == kConnection ? take_connection(*inner, data)
                                : *op == kMessage  ? take_message(*inner, *bytes, data)
                                                   : std::string();
      if (!wrong.empty()) return wrong;
    }
    return {};
  }

  std::string take_message(const Fields& fields, Bytes chunk, Bytes data) {
    const auto connection = number<std::uint32_t>(fields, "conn");
    const auto topic = connection ? topics_.find(*connection) : topics_.end();
    if (topic == topics_.end()) return "a message is of no connection that the bag names before it";
    index_.messages.push_back({topic->second, static_cast<std::uint32_t>(index_.chunks.size() - 1),
                               static_cast<std::uint32_t>(data.data() - chunk.data()),
                               static_cast<std::uint32_t>(data.size())});
    return {};
  }

  std::string take_connection(const Fields& fields, Bytes data) {
    const auto id = number<std::uint32_t>(fields, "conn");
    const auto description = read_fields(data);
    if (!id || !description) return "a connection is damaged";
    if (topics_.contains(*id)) return {};  // each stands in a chunk and in the index
    BagTopic topic;
    topic.name = text(fields, "topic");
    topic.type = text(*description, "type");
    topic.serialization = Serialization::kRos1;
    // Several nodes may publish a topic, each by a connection.
    topics_[*id] = index_.topic_index(topic);
    return {};
  }

  const FileRange& file_;
  BagIndex index_;
  std::map<std::uint32_t, std::uint32_t> topics_;  // by connection
  bool has_header_ = false;
};

}  // namespace

tl::expected<BagIndex, std::string> scan_ros1_bag(const FileRange& file) {
  return Scan(file).run();
}

}  // namespace dive::estimation
