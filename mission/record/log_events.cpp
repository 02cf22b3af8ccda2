#include "mission/record/log_events.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "mission/record/log_frame.h"

namespace dive::mission {
namespace {

// No number follows it.
constexpr std::int64_t kNoNumber = std::numeric_limits<std::int64_t>::max();

bool fits(const LogFrame& frame, Channel channel) {
  return frame.data_size >= kChecksumSize &&
         frame.data_size <= max_packet_size(channel) + kChecksumSize;
}

/// True if `name` is a prefix of a channel name of that size.
bool begins_channel(std::string_view name, std::size_t size) {
  return std::ranges::any_of(kChannelNames, [&](std::string_view channel) {
    return channel.size() == size && channel.starts_with(name);
  });
}

}  // namespace

tl::expected<LogEventFile, std::string> LogEventFile::open(const std::string& path) {
  tl::expected<StdioFile, std::string> file = open_input_stdio(path);
  struct stat status {};
  if (file && ::fstat(fileno(file->get()), &status) != 0) {
    file = tl::unexpected(std::generic_category().message(errno));
  }
  if (!file) return tl::unexpected(fmt::format("cannot read '{}': {}", path, file.error()));
  return LogEventFile(std::move(*file), static_cast<std::uint64_t>(status.st_size));
}

bool LogEventFile::seek(std::uint64_t offset) {
  if (offset == position_) return true;
  if (fseeko(file_.get(), static_cast<off_t>(offset), SEEK_SET) != 0) return false;
  position_ = offset;
  return true;
}

std::size_t LogEventFile::read(void* to, std::size_t size) {
  const std::size_t count = std::fread(to, 1, size, file_.get());
  position_ += count;
  return count;
}

/// Checks everything before it allocates: no length may exceed the rest of the file.
bool LogEventFile::read_record(std::uint64_t offset, LogEvent& event) {
  FrameBytes bytes;
  if (!seek(offset) || read(bytes.data(), bytes.size()) != bytes.size()) return false;
  const std::optional<LogFrame> frame = read_frame(bytes);
  if (!frame || frame->number < next_number_ || frame->number == kNoNumber) return false;

  std::array<char, kMaxChannelSize> name_bytes;
  const std::string_view name(name_bytes.data(), frame->channel_size);
  if (name.size() > name_bytes.size() || read(name_bytes.data(), name.size()) != name.size()) {
    return false;
  }
  const std::optional<Channel> channel = find_channel(name);
  if (!channel || !fits(*frame, *channel) || frame->data_size > size_ - position_) return false;
  // Only the first record may be as large as a header.
  if (*channel == Channel::kHeader && offset != 0) return false;

  event.data.resize(frame->data_size);
  if (read(event.data.data(), event.data.size()) != event.data.size()) return false;
  std::array<std::uint8_t, kChecksumSize> checksum;
  std::copy_n(event.data.end() - kChecksumSize, kChecksumSize, checksum.begin());
  event.data.resize(event.data.size() - kChecksumSize);
  event.number = frame->number;
  event.timestamp = frame->timestamp;
  event.channel = *channel;
  event.offset = offset;
  return checksum == checksum_bytes(record_checksum(bytes, name, event.data));
}

/// The offset of the first valid record at or after `from`; the file's size if there is none.
std::uint64_t LogEventFile::find_record(std::uint64_t from, LogEvent& event) {
  constexpr std::size_t kChunk = 64U << 10U;
  std::vector<std::uint8_t> chunk(kChunk);
  while (size_ - from >= kFrameSize) {
    if (!seek(from)) break;
    const std::size_t count = read(chunk.data(), chunk.size());
    if (count < kFrameSize) break;
    const auto end = chunk.begin() + static_cast<std::ptrdiff_t>(count);
    for (auto at = chunk.begin();; ++at) {
      at = std::search(at, end, kSyncWord.begin(), kSyncWord.end());
      if (at == end) break;
      const auto offset = from + static_cast<std::uint64_t>(at - chunk.begin());
      if (read_record(offset, event)) return offset;
    }
    from += count - (kSyncWord.size() - 1);  // A sync word may span two chunks.
  }
  return size_;
}

/// True if the file's last bytes, from `offset`, are the beginning of the next record.
bool LogEventFile::is_cut_short(std::uint64_t offset) {
  std::array<std::uint8_t, kFrameSize + kMaxChannelSize> bytes;
  if (!seek(offset)) return false;
  const std::size_t count = read(bytes.data(), bytes.size());
  const FrameBytes expected = to_bytes({next_number_, 0, 0, 0});
  if (!std::equal(expected.begin(), expected.begin() + std::min(count, kSequenceSize),
                  bytes.begin())) {
    return false;
  }
  if (count < kFrameSize) return true;
  FrameBytes frame_bytes;
  std::copy_n(bytes.begin(), kFrameSize, frame_bytes.begin());
  const LogFrame frame = *read_frame(frame_bytes);
  const std::string_view name(reinterpret_cast<const char*>(bytes.data()) + kFrameSize,
                              std::min<std::size_t>(count - kFrameSize, frame.channel_size));
  if (name.size() < frame.channel_size) return begins_channel(name, frame.channel_size);
  const std::optional<Channel> channel = find_channel(name);
  return channel && fits(frame, *channel) &&
         frame.data_size > size_ - offset - kFrameSize - frame.channel_size;
}

bool LogEventFile::begins_with_own_channel() {
  constexpr std::string_view kPrefix = "DIVE_";
  FrameBytes bytes;
  std::array<char, kPrefix.size()> name{};
  return seek(0) && read(bytes.data(), bytes.size()) == bytes.size() && read_frame(bytes) &&
         read(name.data(), name.size()) == name.size() &&
         std::string_view(name.data(), name.size()) == kPrefix;
}

LogEventFile::Read LogEventFile::next(LogEvent& event) {
  offset_ = next_offset_;
  if (offset_ == size_) return Read::kEnd;
  const std::uint64_t found =
      read_record(offset_, event) ? offset_ : find_record(offset_ + 1, event);
  if (found == size_) {
    next_offset_ = size_;
    return is_cut_short(offset_) ? Read::kTorn : Read::kDamaged;
  }
  if (found != offset_ || event.number != next_number_) {
    next_offset_ = found;
    next_number_ = event.number;
    return Read::kDamaged;
  }
  next_offset_ = position_;
  ++next_number_;
  return Read::kEvent;
}

}  // namespace dive::mission
