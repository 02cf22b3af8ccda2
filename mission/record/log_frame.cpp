#include "mission/record/log_frame.h"

#include <algorithm>

#include <zlib.h>

namespace dive::mission {
namespace {

void write_big_endian(std::uint64_t value, std::span<std::uint8_t> bytes) {
  for (std::size_t i = bytes.size(); i-- > 0; value >>= 8U) {
    bytes[i] = static_cast<std::uint8_t>(value);
  }
}

std::uint64_t read_big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = (value << 8U) | byte;
  return value;
}

}  // namespace

bool begins_like_log(std::string_view head) {
  return head.size() >= kSyncWord.size() &&
         std::equal(kSyncWord.begin(), kSyncWord.end(), head.begin(),
                    [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
}

FrameBytes to_bytes(const LogFrame& frame) {
  FrameBytes bytes;
  const std::span span(bytes);
  std::ranges::copy(kSyncWord, bytes.begin());
  write_big_endian(static_cast<std::uint64_t>(frame.number), span.subspan(4, 8));
  write_big_endian(static_cast<std::uint64_t>(frame.timestamp), span.subspan(12, 8));
  write_big_endian(frame.channel_size, span.subspan(20, 4));
  write_big_endian(frame.data_size, span.subspan(24, 4));
  return bytes;
}

std::optional<LogFrame> read_frame(const FrameBytes& bytes) {
  if (!std::equal(kSyncWord.begin(), kSyncWord.end(), bytes.begin())) return std::nullopt;
  const std::span span(bytes);
  return LogFrame{static_cast<std::int64_t>(read_big_endian(span.subspan(4, 8))),
                  static_cast<Utime>(read_big_endian(span.subspan(12, 8))),
                  static_cast<std::uint32_t>(read_big_endian(span.subspan(20, 4))),
                  static_cast<std::uint32_t>(read_big_endian(span.subspan(24, 4)))};
}

std::uint32_t record_checksum(const FrameBytes& frame, std::string_view channel,
                              std::span<const std::uint8_t> message) {
  uLong crc = crc32_z(0, frame.data(), frame.size());
  crc = crc32_z(crc, reinterpret_cast<const Bytef*>(channel.data()), channel.size());
  // zlib takes a null pointer, which an empty message may be, as a request to reset.
  if (!message.empty()) crc = crc32_z(crc, message.data(), message.size());
  return static_cast<std::uint32_t>(crc);
}

std::array<std::uint8_t, kChecksumSize> checksum_bytes(std::uint32_t checksum) {
  std::array<std::uint8_t, kChecksumSize> bytes;
  write_big_endian(checksum, bytes);
  return bytes;
}

void append_record(LogFrame frame, std::string_view channel, std::span<const std::uint8_t> message,
                   std::vector<std::uint8_t>& records) {
  frame.channel_size = static_cast<std::uint32_t>(channel.size());
  frame.data_size = static_cast<std::uint32_t>(message.size() + kChecksumSize);
  const FrameBytes bytes = to_bytes(frame);
  const auto checksum = checksum_bytes(record_checksum(bytes, channel, message));
  records.insert(records.end(), bytes.begin(), bytes.end());
  records.insert(records.end(), channel.begin(), channel.end());
  records.insert(records.end(), message.begin(), message.end());
  records.insert(records.end(), checksum.begin(), checksum.end());
}

}  // namespace dive::mission
