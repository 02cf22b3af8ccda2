// MCAP (https://mcap.dev/spec): records of an opcode, a length in 64 bits, and content. Schemas
// name the types, channels the topics; chunks hold records of messages. Checksums that are given
// (not zero) must agree. The summary is not used.

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <zlib.h>

#include "estimation/dataset/bag/bag_file.h"
#include "estimation/dataset/bag/decompress.h"

namespace dive::estimation {
namespace {

constexpr std::uint64_t kMagicBytes = 8;
constexpr std::uint64_t kRecordHead = 9;  // opcode and length
constexpr std::uint64_t kMessageHead = 2 + 4 + 8 + 8;

enum Op : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kDataEnd = 0x0F
};

using Failure = tl::unexpected<std::string>;

class Scan {
 public:
  explicit Scan(const FileRange& file) : file_(file) {}

  tl::expected<BagIndex, std::string> run() {
    std::uint64_t at = kMagicBytes;
    while (!ended_) {
      const auto next = read_record(at);
      if (!next) {
        return Failure(fmt::format("byte {}: {}; mcap recover copies what is whole to a new file",
                                   at, next.error()));
      }
      at = *next;
    }
    return std::move(index_);
  }

 private:
  // Returns where the next record begins.
  tl::expected<std::uint64_t, std::string> read_record(std::uint64_t at) {
    const auto head = file_.read(at, kRecordHead);
    if (!head) return Failure(head.error() + ": the recording was not closed");
    ByteReader reader(*head);
    const auto op = reader.take<std::uint8_t>();
    const auto length = reader.take<std::uint64_t>();
    const std::uint64_t content_at = at + kRecordHead;
    if (length > file_.size() - content_at) {
      return Failure(fmt::format("a record of {} bytes goes beyond the end of the file", length));
    }
    std::string wrong;
    if (op == kChunk) {
      wrong = take_chunk(content_at, length);
    } else if (op == kSchema || op == kChannel || op == kMessage) {
      if (length > kMaxChunkBytes) return Failure(fmt::format("a record of {} bytes", length));
      const auto content = file_.read(content_at, length);
      if (!content) return Failure(content.error());
      if (op == kMessage) index_.chunks.push_back({content_at, length, length, ""});
      wrong = take_record(op, *content, *content);
    }
    if (!wrong.empty()) return Failure(wrong);
    ended_ = op == kDataEnd || op == kFooter;
    return content_at + length;
  }

  std::string take_chunk(std::uint64_t at, std::uint64_t length) {
    // Times of the messages, size, checksum, compression, and the length of what follows.
    constexpr std::uint64_t kMaxHead = 8 + 8 + 8 + 4 + 4 + 64 + 8;
    const auto head = file_.read(at, std::min(length, kMaxHead));
    if (!head) return head.error();
    ByteReader reader(*head);
    static_cast<void>(reader.take_bytes(16));
    BagChunk chunk;
    chunk.size = reader.take<std::uint64_t>();
    const auto checksum = reader.take<std::uint32_t>();
    chunk.compression = reader.take_text();
    chunk.stored = reader.take<std::uint64_t>();
    chunk.offset = at + reader.position();
    if (!reader.ok() || chunk.stored != length - reader.position()) return "a chunk is damaged";
    const auto bytes = read_chunk(file_, chunk);
    if (!bytes) return bytes.error();
    if (checksum != 0 && crc32_z(0, bytes->data(), bytes->size()) != checksum) {
      return "a chunk's checksum does not agree with its content";
    }
    index_.chunks.push_back(chunk);
    ByteReader records(*bytes);
    while (!records.at_end()) {
      const auto op = records.take<std::uint8_t>();
      const Bytes content = records.take_bytes(records.take<std::uint64_t>());
      if (!records.ok()) return "a record in a chunk is damaged";
      if (std::string wrong = take_record(op, content, *bytes); !wrong.empty()) return wrong;
    }
    return {};
  }

  // `chunk`: the bytes of the last chunk, in which `content` is.
  std::string take_record(std::uint8_t op, Bytes content, Bytes chunk) {
    ByteReader reader(content);
    if (op == kSchema) {
      const auto id = reader.take<std::uint16_t>();
      schemas_[id] = ros1_name(reader.take_text());
      return reader.ok() ? "" : "a schema is damaged";
    }
    if (op == kChannel) return take_channel(reader);
    if (op != kMessage) return {};
    const auto channel = topics_.find(reader.take<std::uint16_t>());
    static_cast<void>(reader.take_bytes(kMessageHead - 2));
    if (!reader.ok()) return "a message is damaged";
    if (channel == topics_.end()) return "a message is of no channel that the file names before it";
    const std::uint8_t* const data = content.data() + kMessageHead;
    index_.messages.push_back({channel->second,
                               static_cast<std::uint32_t>(index_.chunks.size() - 1),
                               static_cast<std::uint32_t>(data - chunk.data()),
                               static_cast<std::uint32_t>(reader.left())});
    return {};
  }

  std::string take_channel(ByteReader& reader) {
    const auto id = reader.take<std::uint16_t>();
    const auto schema = schemas_.find(reader.take<std::uint16_t>());
    BagTopic topic;
    topic.name = reader.take_text();
    const std::string_view encoding = reader.take_text();
    if (!reader.ok()) return "a channel is damaged";
    if (schema != schemas_.end()) topic.type = schema->second;
    topic.serialization = encoding == "cdr"    ? Serialization::kCdr
                          : encoding == "ros1" ? Serialization::kRos1
                                               : Serialization::kOther;
    // Several nodes may publish a topic, each by a channel.
    if (!topics_.contains(id)) topics_[id] = index_.topic_index(topic);
    return {};
  }

  const FileRange& file_;
  BagIndex index_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::uint32_t> topics_;  // by channel
  bool ended_ = false;
};

}  // namespace

tl::expected<BagIndex, std::string> scan_mcap(const FileRange& file) { return Scan(file).run(); }

}  // namespace dive::estimation
