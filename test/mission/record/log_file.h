#pragma once
// Logs on disk for tests: written, read, cut and forged.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <lcm/eventlog.h>
#include <unistd.h>

#include "mission/record/log.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_digest.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {

/// A path that nobody else uses; removed at the end.
class TemporaryFile {
 public:
  TemporaryFile()
      : path_(std::filesystem::path(::testing::TempDir()) /
              fmt::format("dive_test_{}_{}.lcm", getpid(), ++count_)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }

  [[nodiscard]] std::string path() const { return path_.string(); }
  [[nodiscard]] std::string content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
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
  read.events = log->events_read();
  EXPECT_FALSE(log->next().has_value());
  return read;
}

/// Writes any events, with numbers and digests that are right unless asked otherwise.
class Forger {
 public:
  explicit Forger(const std::string& path) : log_(lcm_eventlog_create(path.c_str(), "w")) {
    if (log_ == nullptr) throw std::runtime_error("cannot create " + path);
  }
  Forger(const Forger&) = delete;
  Forger& operator=(const Forger&) = delete;
  ~Forger() { lcm_eventlog_destroy(log_); }

  void header() {
    LogHeader header = sample_header();
    header.digest = log_digest(header);
    put("DIVE_HEADER", 0, header);
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
    event.datalen = static_cast<std::int32_t>(packet.size());
    event.channel = channel.data();
    event.data = packet.data();
    ASSERT_EQ(lcm_eventlog_write_event(log_, &event), 0);
    digest_.add(channel);
    digest_.add(packet);
    ++events_;
  }
  /// The four outputs that every tick has.
  void outputs(Utime now) {
    put("DIVE_OUT_COMMAND", now, now, vehicle::Command{});
    put("DIVE_OUT_RATES", now, now, vehicle::PseudoRates{});
    put("DIVE_OUT_ESTIMATE", now, estimation::StateEstimate{});
    put("DIVE_OUT_STATUS", now, now, Status{});
  }
  [[nodiscard]] TickMark right_mark(Utime now) const { return {now, events_, digest_.value()}; }
  void mark(Utime now) { mark(now, right_mark(now)); }
  void mark(Utime now, const TickMark& mark) {
    put("DIVE_TICK", now, mark);
    events_ = 0;
  }
  void skip_event_number() { ++log_->eventcount; }

 private:
  lcm_eventlog_t* log_;
  Fnv1a64 digest_;
  std::int32_t events_ = 0;
};

}  // namespace dive::mission::testing
