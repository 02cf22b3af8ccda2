#pragma once
// Reads the records of a dive log (log_frame.h) from a file that may be damaged anywhere. LCM's own
// reader is not used: it trusts the data length in the file (2^31 - 1 crashes it, 0x70000000
// allocates 1.8 GB).

#include <cstdint>
#include <string>
#include <utility>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "common/input_file.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"

namespace dive::mission {

struct LogEvent {
  std::int64_t number = 0;
  Utime timestamp = 0;
  Channel channel = Channel::kHeader;
  Packet data;               ///< The message, without the checksum.
  std::uint64_t offset = 0;  ///< File offset of the record's first byte.
};

class LogEventFile {
 public:
  enum class Read {
    kEvent,
    kDamaged,  ///< At offset(): invalid bytes or a missing record. Reading can continue.
    kTorn,     ///< The file ends within the next record. Nothing follows.
    kEnd,      ///< Nothing follows.
  };

  /// The error is a sentence: no such file, not a regular file, not permitted.
  [[nodiscard]] static tl::expected<LogEventFile, std::string> open(const std::string& path);

  /// Reads the next record. A record is valid if its checksum is right, its channel is one of ours,
  /// and its number has not passed; invalid bytes are skipped up to the next valid record. `event`
  /// is unspecified unless the result is kEvent.
  [[nodiscard]] Read next(LogEvent& event);

  /// True if the first record, valid or not, is of one of our channels, past or present.
  [[nodiscard]] bool begins_with_own_channel();

  /// File offset of the start of the last result of next(), bytes.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

 private:
  LogEventFile(StdioFile file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  [[nodiscard]] bool seek(std::uint64_t offset);
  [[nodiscard]] std::size_t read(void* to, std::size_t size);
  [[nodiscard]] bool read_record(std::uint64_t offset, LogEvent& event);
  [[nodiscard]] std::uint64_t find_record(std::uint64_t from, LogEvent& event);
  [[nodiscard]] bool is_cut_short(std::uint64_t offset);

  StdioFile file_;
  std::uint64_t size_ = 0;         // Size at opening, bytes.
  std::uint64_t position_ = 0;     // Position in the file, bytes.
  std::uint64_t next_offset_ = 0;  // Expected offset of the next record, bytes.
  std::uint64_t offset_ = 0;
  std::int64_t next_number_ = 0;
};

}  // namespace dive::mission
