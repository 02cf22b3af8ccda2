#include "estimation/dataset/bag/bag_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "estimation/dataset/bag/decompress.h"

namespace dive::estimation {
namespace {

constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";
constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr std::string_view kSqliteMagic = "SQLite format";
constexpr std::size_t kKeptChunks = 2;  // messages of two cameras may alternate between two

bool begins_with(const std::vector<std::uint8_t>& bytes, std::string_view magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
}

}  // namespace

std::uint32_t BagIndex::topic_index(const BagTopic& topic) {
  const auto same = std::find_if(topics.begin(), topics.end(), [&](const BagTopic& other) {
    return other.name == topic.name && other.type == topic.type &&
           other.serialization == topic.serialization;
  });
  const auto index = static_cast<std::uint32_t>(same - topics.begin());
  if (same == topics.end()) topics.push_back(topic);
  return index;
}

tl::expected<FileRange, std::string> FileRange::open(const std::string& path) {
  auto file = open_input(path);
  if (!file) return tl::make_unexpected(file.error());
  struct stat status {};
  if (::fstat(file->get(), &status) != 0) return tl::make_unexpected(std::strerror(errno));
  FileRange range;
  range.file_ = std::move(*file);
  range.size_ = static_cast<std::uint64_t>(status.st_size);
  return range;
}

tl::expected<std::vector<std::uint8_t>, std::string> FileRange::read(std::uint64_t offset,
                                                                     std::uint64_t count) const {
  if (offset > size_ || count > size_ - offset) {
    return tl::make_unexpected(fmt::format("the file ends after {} of {} bytes",
                                           offset > size_ ? 0 : size_ - offset, count));
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(count));
  for (std::size_t done = 0; done < bytes.size();) {
    const ::ssize_t got = ::pread(file_.get(), bytes.data() + done, bytes.size() - done,
                                  static_cast<::off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return tl::make_unexpected(std::strerror(errno));
    if (got == 0) return tl::make_unexpected("the file has become shorter");
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

tl::expected<std::vector<std::uint8_t>, std::string> read_chunk(const FileRange& file,
                                                                const BagChunk& chunk) {
  if (chunk.stored > kMaxChunkBytes) {
    return tl::make_unexpected(
        fmt::format("a chunk of {} bytes; at most {} are read", chunk.stored, kMaxChunkBytes));
  }
  auto stored = file.read(chunk.offset, chunk.stored);
  if (!stored) return stored;
  return decompress(chunk.compression, *stored, chunk.size);
}

std::string ros1_name(std::string_view type) {
  constexpr std::string_view kInfix = "/msg/";
  const std::size_t at = type.find(kInfix);
  if (at == std::string_view::npos) return std::string(type);
  return fmt::format("{}/{}", type.substr(0, at), type.substr(at + kInfix.size()));
}

BagFile::BagFile(std::string path, BagIndex index, ChunkLoader load)
    : path_(std::move(path)), index_(std::move(index)), load_(std::move(load)) {}

tl::expected<std::shared_ptr<BagFile>, std::string> BagFile::open(const std::string& path) {
  const auto fail = [&](const std::string& what) {
    return tl::make_unexpected(fmt::format("{}: {}", path, what));
  };
  auto file = FileRange::open(path);
  if (!file) return fail(file.error());
  const auto begin = file->read(0, std::min<std::uint64_t>(file->size(), kRos1Magic.size()));
  if (!begin) return fail(begin.error());
  const auto opened = [&](BagIndex index, ChunkLoader load) {
    for (const BagMessage& message : index.messages) ++index.topics[message.topic].messages;
    return std::shared_ptr<BagFile>(new BagFile(path, std::move(index), std::move(load)));
  };
  if (begins_with(*begin, kSqliteMagic)) {
    auto database = scan_sqlite(path);
    if (!database) return fail(database.error());
    return opened(std::move(database->index), std::move(database->load));
  }
  if (is_zstd(*begin)) {
    return fail(fmt::format("compressed as a whole; decompress it first: zstd -d '{}'", path));
  }
  const bool is_ros1 = begins_with(*begin, kRos1Magic);
  if (!is_ros1 && !begins_with(*begin, kMcapMagic)) {
    return fail("neither a ROS 1 bag (format 2.0), an MCAP file nor a bag of ROS 2 in sqlite3");
  }
  auto index = is_ros1 ? scan_ros1_bag(*file) : scan_mcap(*file);
  if (!index) return fail(index.error());
  const auto kept = std::make_shared<FileRange>(std::move(*file));
  return opened(std::move(*index),
                [kept](const BagChunk& chunk) { return read_chunk(*kept, chunk); });
}

tl::expected<Bytes, std::string> BagFile::read(const BagMessage& message) {
  auto at = std::find_if(kept_.begin(), kept_.end(),
                         [&](const Kept& kept) { return kept.chunk == message.chunk; });
  if (at == kept_.end()) {
    auto bytes = load_(index_.chunks[message.chunk]);
    if (!bytes) return tl::make_unexpected(fmt::format("{}: {}", path_, bytes.error()));
    if (kept_.size() >= kKeptChunks) kept_.erase(kept_.begin());
    kept_.push_back({message.chunk, std::move(*bytes)});
    at = std::prev(kept_.end());
  }
  if (message.offset > at->bytes.size() || message.size > at->bytes.size() - message.offset) {
    return tl::make_unexpected(fmt::format("{}: the file has changed", path_));
  }
  return Bytes(at->bytes).subspan(message.offset, message.size);
}

}  // namespace dive::estimation
