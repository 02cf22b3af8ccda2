#pragma once
// Reads the events of an LCM event log. LCM's own reader is not used: it trusts the data length in
// the file (2^31 - 1 crashes it, 0x70000000 allocates 1.8 GB). The format, all big-endian:
//   uint32 0xEDA1DA01, int64 event number, int64 timestamp (us), int32 channel length, int32 data
//   length, channel, data.

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"

namespace dive::mission {

struct LogEvent {
  std::int64_t number = 0;
  Utime timestamp = 0;
  Channel channel = Channel::kHeader;
  Packet data;
};

class LogEventFile {
 public:
  enum class Read {
    kEvent,
    kEnd,      ///< Nothing after the event before.
    kDamaged,  ///< Cut short, not an event, of no channel of ours, or too large for its channel.
  };

  /// Fails with a sentence: no such file, not a regular file, not permitted.
  [[nodiscard]] static tl::expected<LogEventFile, std::string> open(const std::string& path);

  /// After anything but kEvent there is no going on, and `event` says nothing.
  [[nodiscard]] Read next(LogEvent& event);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  LogEventFile(std::FILE* file, std::uint64_t size) : file_(file), left_(size) {}

  [[nodiscard]] bool read(void* to, std::size_t size);

  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t left_ = 0;  // Bytes not read yet: no length may promise more.
};

}  // namespace dive::mission
