#pragma once
// Logs on disk for tests: written, read, cut and forged.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <lcm/eventlog.h>
#include <lcm/lcm-cpp.hpp>
#include <unistd.h>

#include "mission/record/log.h"
#include "mission/record/log_codec.h"
#include "test/common/file_content.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {

/// A unique path; removed at the end.
class TemporaryFile {
 public:
  TemporaryFile()
      : path_(std::filesystem::path(::testing::TempDir()) /
              fmt::format("dive_test_{}_{}.lcm", getpid(), ++count_)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }

  [[nodiscard]] std::string path() const { return path_.string(); }
  [[nodiscard]] std::string content() const { return dive::testing::content_of(path_); }
  void set_content(std::string_view content) const {
    std::ofstream(path_, std::ios::binary) << content;
  }

 private:
  static inline int count_ = 0;
  std::filesystem::path path_;
};

inline void write_log(const std::string& path, const std::vector<LoggedTick>& ticks) {
  auto log = LogWriter::create(path, sample_header());
  ASSERT_TRUE(log) << log.error();
  for (const LoggedTick& tick : ticks) {
    ASSERT_TRUE(log->write(tick.inputs, tick.outputs, tick.truth));
  }
  ASSERT_TRUE(log->close());
}

struct ReadLog {
  bool opened = false;
  std::string error;
  bool torn = false;
  std::int64_t events = 0;
  bool has_header = false;
  std::vector<LogGap> gaps;
  std::vector<LoggedTick> ticks;
};

inline ReadLog read_log(const std::string& path) {
  ReadLog read;
  auto log = LogReader::open(path);
  read.opened = log.has_value();
  if (!log) {
    read.error = log.error();
    return read;
  }
  while (auto tick = log->next()) read.ticks.push_back(std::move(*tick));
  read.torn = log->torn();
  read.has_header = log->header().has_value();
  read.gaps = log->gaps();
  read.events = log->events_read();
  EXPECT_FALSE(log->next().has_value());
  return read;
}

/// CRC-32 of IEEE 802.3, bit by bit.
inline std::uint32_t crc32_of(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

inline std::string big_endian(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

/// Writes any events, with correct numbers and checksums unless requested otherwise.
class Forger {
 public:
  explicit Forger(const std::string& path) : log_(lcm_eventlog_create(path.c_str(), "w")) {
    if (log_ == nullptr) throw std::runtime_error("cannot create " + path);
  }
  Forger(const Forger&) = delete;
  Forger& operator=(const Forger&) = delete;
  ~Forger() { lcm_eventlog_destroy(log_); }

  void header() {
    put("DIVE_HEADER", 0, sample_header());
    events_ = 0;
  }
  template <typename... Value>
  void put(std::string channel, Utime timestamp, const Value&... value) {
    Packet packet;
    ASSERT_TRUE(encode(value..., packet));
    raw(std::move(channel), timestamp, packet);
  }
  void raw(std::string channel, Utime timestamp, Packet packet) {
    lcm_eventlog_event_t event{};
    event.timestamp = timestamp;
    event.channellen = static_cast<std::int32_t>(channel.size());
    event.channel = channel.data();
    const std::string record =
        "\xED\xA1\xDA\x01" + big_endian(static_cast<std::uint64_t>(log_->eventcount), 8) +
        big_endian(static_cast<std::uint64_t>(timestamp), 8) + big_endian(channel.size(), 4) +
        big_endian(packet.size() + 4, 4) + channel + std::string(packet.begin(), packet.end());
    for (const char byte : big_endian(crc32_of(record), 4)) {
      packet.push_back(static_cast<std::uint8_t>(byte));
    }
    event.datalen = static_cast<std::int32_t>(packet.size());
    event.data = packet.data();
    ASSERT_EQ(lcm_eventlog_write_event(log_, &event), 0);
    ++events_;
  }
  /// The four outputs of every tick.
  void outputs(Utime now) {
    put("DIVE_OUT_COMMAND", now, now, vehicle::Command{});
    put("DIVE_OUT_RATES", now, now, vehicle::PseudoRates{});
    put("DIVE_OUT_ESTIMATE", now, estimation::StateEstimate{});
    put("DIVE_OUT_STATUS", now, now, Status{});
  }
  [[nodiscard]] TickMark right_mark(Utime now) const { return {now, events_}; }
  void mark(Utime now) { mark(now, right_mark(now)); }
  void mark(Utime now, const TickMark& mark) {
    put("DIVE_TICK", now, mark);
    events_ = 0;
  }
  void skip_event_number() { ++log_->eventcount; }

 private:
  lcm_eventlog_t* log_;
  std::int32_t events_ = 0;
};

/// An event as its record in the file, up to its checksum.
inline std::string record_of(const lcm::LogEvent& event) {
  return "\xED\xA1\xDA\x01" + big_endian(static_cast<std::uint64_t>(event.eventnum), 8) +
         big_endian(static_cast<std::uint64_t>(event.timestamp), 8) +
         big_endian(event.channel.size(), 4) +
         big_endian(static_cast<std::uint64_t>(event.datalen), 4) + event.channel +
         std::string(static_cast<const char*>(event.data),
                     static_cast<std::size_t>(event.datalen - 4));
}

/// File sizes after the header and after each tick.
inline std::vector<std::size_t> tick_ends(const std::vector<LoggedTick>& ticks) {
  std::vector<std::size_t> ends;
  for (std::size_t count = 0; count <= ticks.size(); ++count) {
    const TemporaryFile file;
    write_log(file.path(), {ticks.begin(), ticks.begin() + static_cast<std::ptrdiff_t>(count)});
    ends.push_back(file.content().size());
  }
  return ends;
}

}  // namespace dive::mission::testing
