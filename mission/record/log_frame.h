#pragma once
// One record of a dive log: an event of LCM's event log (lcm-logger's format), big-endian:
//   uint32 0xEDA1DA01, int64 event number, int64 timestamp (us), int32 channel length, int32 data
//   length, channel, data.
// The data are an LCM message and a CRC-32 (zlib's, of IEEE 802.3) of all that precedes it in the
// record. LCM's decoders ignore bytes after a message, so LCM's tools read the log.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/clock.h"

namespace dive::mission {

inline constexpr std::size_t kFrameSize = 28;        ///< Bytes before the channel.
inline constexpr std::size_t kChecksumSize = 4;      ///< Bytes after the message.
inline constexpr std::size_t kMaxChannelSize = 63;   ///< LCM_MAX_CHANNEL_NAME_LENGTH.
inline constexpr std::size_t kSequenceSize = 4 + 8;  ///< Bytes of sync word and event number.
inline constexpr std::array<std::uint8_t, 4> kSyncWord = {0xED, 0xA1, 0xDA, 0x01};

using FrameBytes = std::array<std::uint8_t, kFrameSize>;

struct LogFrame {
  std::int64_t number = 0;
  Utime timestamp = 0;
  std::uint32_t channel_size = 0;
  std::uint32_t data_size = 0;  ///< Bytes, checksum included.
};

/// True if `head`, the first bytes of a file, are those of a log or of a bundle.
[[nodiscard]] bool begins_like_log(std::string_view head);

[[nodiscard]] FrameBytes to_bytes(const LogFrame& frame);

/// Empty if the bytes do not begin with the sync word.
[[nodiscard]] std::optional<LogFrame> read_frame(const FrameBytes& bytes);

[[nodiscard]] std::uint32_t record_checksum(const FrameBytes& frame, std::string_view channel,
                                            std::span<const std::uint8_t> message);

/// Big-endian, like the rest of the frame.
[[nodiscard]] std::array<std::uint8_t, kChecksumSize> checksum_bytes(std::uint32_t checksum);

/// Appends a whole record to `records`. The sizes of `frame` are not used.
void append_record(LogFrame frame, std::string_view channel, std::span<const std::uint8_t> message,
                   std::vector<std::uint8_t>& records);

}  // namespace dive::mission
