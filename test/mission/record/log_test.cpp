#include "mission/record/log.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <dive/header_t.hpp>
#include <dive/state_estimate_t.hpp>
#include <dive/status_t.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "test/mission/record/fake_disk.h"
#include "test/mission/record/log_file.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

using ::testing::HasSubstr;

// ---------------------------------------------------------------------------- round trip

TEST(Log, GivesBackEveryBit) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const TemporaryFile file;
    const std::vector<LoggedTick> ticks = sample_ticks(seed, 20);
    write_log(file.path(), ticks);
    const ReadLog read = read_log(file.path());
    ASSERT_TRUE(read.opened) << read.error;
    EXPECT_FALSE(read.torn);
    ASSERT_EQ(read.ticks.size(), ticks.size());
    for (std::size_t i = 0; i < ticks.size(); ++i) ASSERT_EQ(bits(read.ticks[i]), bits(ticks[i]));
  }
}

TEST(Log, GivesBackItsHeader) {
  const TemporaryFile file;
  write_log(file.path(), {});
  const auto log = LogReader::open(file.path());
  ASSERT_TRUE(log) << log.error();
  const LogHeader expected = sample_header();
  ASSERT_TRUE(log->header());
  EXPECT_EQ(log->header()->version, expected.version);
  EXPECT_EQ(log->header()->seed, expected.seed);
  EXPECT_EQ(log->header()->mission_name, expected.mission_name);
  EXPECT_EQ(log->header()->mission_xml, expected.mission_xml);
  EXPECT_EQ(log->header()->map_name, expected.map_name);
  EXPECT_EQ(log->header()->map_xml, expected.map_xml);
  EXPECT_EQ(log->header()->vehicle_urdf, expected.vehicle_urdf);
  EXPECT_EQ(log->header()->check, expected.check);
  EXPECT_EQ(log->events_read(), 1);
}

TEST(Log, OfTheSameDiveIsTheSameFile) {
  const TemporaryFile first;
  const TemporaryFile second;
  write_log(first.path(), sample_ticks(3, 50));
  write_log(second.path(), sample_ticks(3, 50));
  ASSERT_FALSE(first.content().empty());
  EXPECT_EQ(first.content(), second.content());
}

TEST(Log, ReplacesWhatWasThere) {
  const TemporaryFile file;
  file.set_content(std::string(100'000, 'x'));
  write_log(file.path(), sample_ticks(1, 2));
  EXPECT_EQ(read_log(file.path()).ticks.size(), 2U);
}

/// An event as its record in the file, up to its checksum.
std::string record_of(const lcm::LogEvent& event) {
  return "\xED\xA1\xDA\x01" + big_endian(static_cast<std::uint64_t>(event.eventnum), 8) +
         big_endian(static_cast<std::uint64_t>(event.timestamp), 8) +
         big_endian(event.channel.size(), 4) +
         big_endian(static_cast<std::uint64_t>(event.datalen), 4) + event.channel +
         std::string(static_cast<const char*>(event.data),
                     static_cast<std::size_t>(event.datalen - 4));
}

std::string checksum_of(const lcm::LogEvent& event) {
  return {static_cast<const char*>(event.data) + event.datalen - 4, 4};
}

// LCM's own reader and decoders verify the format independently. A decoder accepts extra bytes and
// returns how many it used.
TEST(Log, IsAnLcmEventLog) {
  const TemporaryFile file;
  std::vector<LoggedTick> ticks = sample_ticks(5, 40);
  write_log(file.path(), ticks);
  lcm::LogFile log(file.path(), "r");
  ASSERT_TRUE(log.good());

  const lcm::LogEvent* event = log.readNextEvent();
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->channel, "DIVE_HEADER");
  header_t header{};
  ASSERT_EQ(header.decode(event->data, 0, event->datalen), event->datalen - 4);
  EXPECT_EQ(header.mission_xml, sample_header().mission_xml);

  std::int64_t number = 1;
  std::size_t tick = 0;
  std::set<std::string> channels;
  while ((event = log.readNextEvent()) != nullptr) {
    ASSERT_LT(tick, ticks.size());
    const StepOutputs& outputs = ticks[tick].outputs;
    EXPECT_EQ(event->eventnum, number++);
    EXPECT_EQ(checksum_of(*event), big_endian(crc32_of(record_of(*event)), 4));
    EXPECT_EQ(event->timestamp, ticks[tick].inputs.now);
    channels.insert(event->channel);
    if (event->channel == "DIVE_OUT_STATUS") {
      status_t status{};
      ASSERT_EQ(status.decode(event->data, 0, event->datalen), event->datalen - 4);
      EXPECT_EQ(status.utime, ticks[tick].inputs.now);
      EXPECT_EQ(status.state, outputs.status.state);
      EXPECT_EQ(status.segment, outputs.status.segment);
    } else if (event->channel == "DIVE_OUT_ESTIMATE") {
      state_estimate_t estimate{};
      ASSERT_EQ(estimate.decode(event->data, 0, event->datalen), event->datalen - 4);
      EXPECT_EQ(std::bit_cast<std::uint64_t>(estimate.covariance[6 * 2 + 4]),
                std::bit_cast<std::uint64_t>(outputs.estimate.covariance(2, 4)));
      EXPECT_EQ(std::bit_cast<std::uint64_t>(estimate.pose.q[3]),
                std::bit_cast<std::uint64_t>(outputs.estimate.X_WB.q.w()));
    } else if (event->channel == "DIVE_TICK") {
      ++tick;
    }
  }
  EXPECT_EQ(tick, ticks.size());
  EXPECT_EQ(channels.size(), 23U);
  EXPECT_EQ(read_log(file.path()).events, number);
}

// ---------------------------------------------------------------------------- torn and damaged

/// File sizes after the header and after each tick.
std::vector<std::size_t> tick_ends(const std::vector<LoggedTick>& ticks) {
  std::vector<std::size_t> ends;
  for (std::size_t count = 0; count <= ticks.size(); ++count) {
    const TemporaryFile file;
    write_log(file.path(), {ticks.begin(), ticks.begin() + static_cast<std::ptrdiff_t>(count)});
    ends.push_back(file.content().size());
  }
  return ends;
}

TEST(TornLog, GivesEveryWholeTickWhereverItIsCut) {
  const std::vector<LoggedTick> ticks = sample_ticks(9, 4);
  const TemporaryFile file;
  write_log(file.path(), ticks);
  const std::string whole = file.content();
  const std::vector<std::size_t> ends = tick_ends(ticks);
  ASSERT_EQ(ends.back(), whole.size());
  for (std::size_t left = whole.size() + 1; left > 0; --left) {
    const std::size_t cut = left - 1;
    std::filesystem::resize_file(file.path(), cut);
    const ReadLog read = read_log(file.path());
    ASSERT_EQ(read.opened, cut >= ends.front()) << cut;
    if (!read.opened) continue;
    const auto next_end = std::ranges::upper_bound(ends, cut);
    const auto expected = static_cast<std::size_t>(next_end - ends.begin()) - 1;
    ASSERT_EQ(read.ticks.size(), expected) << cut;
    ASSERT_EQ(read.torn, cut != ends[expected]) << cut;
    ASSERT_TRUE(read.gaps.empty()) << cut;
    ASSERT_TRUE(read.has_header) << cut;
    for (std::size_t i = 0; i < expected; ++i) ASSERT_EQ(bits(read.ticks[i]), bits(ticks[i]));
  }
}

/// File offsets of a log's records, as found by LCM's reader.
std::vector<std::size_t> record_offsets(const std::string& path) {
  lcm::LogFile log(path, "r");
  std::vector<std::size_t> offsets = {0};
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    offsets.push_back(offsets.back() + record_of(*event).size() + 4);
  }
  return offsets;
}

/// Ticks as bits(), for short messages if they differ.
std::vector<std::string> all_bits(const std::vector<LoggedTick>& ticks) {
  std::vector<std::string> all;
  for (const LoggedTick& tick : ticks) all.push_back(bits(tick));
  return all;
}

TEST(DamagedLog, EveryFlippedBitIsAGapOfOneTick) {
  const std::vector<LoggedTick> ticks = sample_ticks(9, 3);
  const TemporaryFile file;
  write_log(file.path(), ticks);
  const std::string whole = file.content();
  const std::vector<std::size_t> ends = tick_ends(ticks);
  const std::vector<std::size_t> records = record_offsets(file.path());
  ASSERT_EQ(records.back(), whole.size());
  std::fstream stream(file.path(), std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  SampleMaker maker(31);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    const std::size_t record = *(std::ranges::upper_bound(records, at) - 1);
    // All bits of a frame, whose lengths and sync word guide the reader, and one bit of every other
    // byte.
    const bool in_frame = at - record < 28;
    const unsigned first = in_frame ? 0 : static_cast<unsigned>(maker.below(8));
    for (unsigned bit = first; bit < (in_frame ? 8 : first + 1); ++bit) {
      put(at, static_cast<char>(whole[at] ^ (1U << bit)));
      const ReadLog read = read_log(file.path());
      ASSERT_TRUE(read.opened) << at << ": " << read.error;
      ASSERT_EQ(read.gaps.size(), 1U) << at;
      ASSERT_FALSE(read.torn) << at;

      // The lost tick; the header precedes all of them.
      const auto after =
          static_cast<std::size_t>(std::ranges::upper_bound(ends, at) - ends.begin());
      ASSERT_EQ(read.has_header, after > 0) << at;
      std::vector<LoggedTick> expected = ticks;
      if (after > 0) expected.erase(expected.begin() + static_cast<std::ptrdiff_t>(after) - 1);
      ASSERT_EQ(all_bits(read.ticks), all_bits(expected)) << at;
      const LogGap& gap = read.gaps.front();
      ASSERT_EQ(gap.offset, record) << at;
      ASSERT_EQ(gap.offset + gap.bytes, ends[after]) << at;
      ASSERT_EQ(gap.from, after < 2 ? 0 : ticks[after - 2].inputs.now) << at;
      ASSERT_EQ(gap.to.has_value(), after < ticks.size()) << at;
      if (gap.to) {
        ASSERT_EQ(*gap.to, ticks[after].inputs.now) << at;
      }
    }
    put(at, whole[at]);
  }
}

TEST(DamagedLog, MissingRepeatedAndForeignRecordsAreGaps) {
  const std::vector<LoggedTick> ticks = sample_ticks(21, 4);
  const TemporaryFile file;
  write_log(file.path(), ticks);
  const std::string whole = file.content();
  const std::vector<std::size_t> ends = tick_ends(ticks);
  const auto read_with = [&](const std::string& content) {
    file.set_content(content);
    return read_log(file.path());
  };
  const auto without = [&](std::size_t tick) {
    std::vector<LoggedTick> left = ticks;
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(tick));
    return all_bits(left);
  };

  const ReadLog missing = read_with(whole.substr(0, ends[1]) + whole.substr(ends[2]));
  EXPECT_EQ(all_bits(missing.ticks), without(1));
  ASSERT_EQ(missing.gaps.size(), 1U);
  EXPECT_EQ(missing.gaps[0].bytes, 0U);
  EXPECT_EQ(missing.gaps[0].from, ticks[0].inputs.now);
  EXPECT_EQ(missing.gaps[0].to, ticks[2].inputs.now);

  const ReadLog repeated = read_with(whole.substr(0, ends[3]) + whole.substr(ends[1]));
  EXPECT_EQ(all_bits(repeated.ticks), all_bits(ticks));
  ASSERT_EQ(repeated.gaps.size(), 1U);
  EXPECT_EQ(repeated.gaps[0].bytes, ends[3] - ends[1]);

  const ReadLog foreign =
      read_with(whole.substr(0, ends[2]) + std::string(100'000, '\xED') + whole.substr(ends[2]));
  EXPECT_EQ(all_bits(foreign.ticks), all_bits(ticks));
  ASSERT_EQ(foreign.gaps.size(), 1U);
  EXPECT_EQ(foreign.gaps[0].bytes, 100'000U);

  const ReadLog beheaded = read_with(whole.substr(ends[0]));
  EXPECT_FALSE(beheaded.has_header);
  EXPECT_EQ(all_bits(beheaded.ticks), all_bits(ticks));
  EXPECT_EQ(beheaded.gaps.size(), 1U);

  // Damage and a torn end are distinct.
  std::string both = whole.substr(0, whole.size() - 3);
  both[ends[1] - 1] = static_cast<char>(both[ends[1] - 1] ^ 1);
  const ReadLog torn_too = read_with(both);
  EXPECT_TRUE(torn_too.torn);
  EXPECT_EQ(torn_too.gaps.size(), 1U);
  EXPECT_EQ(torn_too.ticks.size(), 2U);
}

/// Random damage: bytes changed, removed, inserted, repeated, or a length field made huge.
std::string damaged(std::string log, SampleMaker& maker) {
  const int times = 1 + static_cast<int>(maker.below(3));
  for (int i = 0; i < times; ++i) {
    const std::size_t at = maker.below(log.size());
    const std::size_t size = std::min(1 + maker.below(30), log.size() - at);
    switch (maker.below(5)) {
      case 0:
        log[at] = static_cast<char>(log[at] ^ (1 << maker.below(8)));
        break;
      case 1:
        for (std::size_t k = at; k < at + size; ++k) log[k] = static_cast<char>(maker.below(256));
        break;
      case 2:
        log.erase(at, size);
        break;
      case 3:
        log.insert(maker.below(log.size()), log.substr(at, size));
        break;
      default: {
        const std::size_t frame = log.find("\xED\xA1\xDA\x01", at);
        if (frame == std::string::npos) break;
        const char huge = static_cast<char>(maker.below(2) == 0 ? 0x7f : 0x00);
        log.replace(frame + 20 + 4 * maker.below(2), 4, {huge, '\x7f', '\xff', '\xff'});
        break;
      }
    }
    if (log.empty()) log = "x";
  }
  return log;
}

TEST(DamagedLog, GivesOnlyWhatWasWritten) {
  const std::vector<LoggedTick> ticks = sample_ticks(11, 12);
  std::vector<std::string> written;
  for (const LoggedTick& tick : ticks) written.push_back(bits(tick));
  const TemporaryFile file;
  write_log(file.path(), ticks);
  const std::string whole = file.content();
  SampleMaker maker(1234);
  int shortened = 0;
  for (int round = 0; round < 1000; ++round) {
    const std::string content = damaged(whole, maker);
    file.set_content(content);
    const ReadLog read = read_log(file.path());
    if (!read.opened) {
      EXPECT_FALSE(read.error.empty());
      continue;
    }
    auto next = written.begin();
    for (const LoggedTick& tick : read.ticks) {
      next = std::find(next, written.end(), bits(tick));
      ASSERT_NE(next++, written.end()) << "round " << round;
    }
    ASSERT_TRUE(!read.gaps.empty() || read.torn || whole.starts_with(content)) << round;
    ASSERT_TRUE(!read.gaps.empty() || std::equal(written.begin(), next, written.begin()));
    if (read.gaps.empty()) {
      ASSERT_EQ(next - written.begin(), std::ssize(read.ticks)) << round;
    }
    if (read.ticks.size() < written.size()) ++shortened;
  }
  EXPECT_GT(shortened, 500);
}

TEST(DamagedLog, NoiseIsNotALog) {
  SampleMaker maker(77);
  const TemporaryFile file;
  for (int round = 0; round < 300; ++round) {
    std::string noise(maker.below(3000), '\0');
    for (char& c : noise) c = static_cast<char>(maker.below(256));
    if (maker.chance()) noise.insert(0, "\xED\xA1\xDA\x01");
    file.set_content(noise);
    EXPECT_FALSE(read_log(file.path()).opened);
  }
}

/// A log with valid frames and checksums and one invalid tick.
struct BadTick {
  const char* name;
  std::function<void(Forger&)> write;
};

const BadTick kBadTicks[] = {
    {"NothingInIt", [](Forger& f) { f.mark(5); }},
    {"AnOutputMissing",
     [](Forger& f) {
       f.put("DIVE_OUT_COMMAND", 5, Utime{5}, vehicle::Command{});
       f.put("DIVE_OUT_RATES", 5, Utime{5}, vehicle::PseudoRates{});
       f.put("DIVE_OUT_STATUS", 5, Utime{5}, Status{});
       f.mark(5);
     }},
    {"AnInputTwice",
     [](Forger& f) {
       f.put("DIVE_IN_DEPTH", 5, DepthSample{});
       f.put("DIVE_IN_DEPTH", 5, DepthSample{});
       f.outputs(5);
       f.mark(5);
     }},
    {"OutOfOrder",
     [](Forger& f) {
       f.outputs(5);
       f.put("DIVE_IN_DEPTH", 5, DepthSample{});
       f.mark(5);
     }},
    {"TwoTimes",
     [](Forger& f) {
       f.put("DIVE_IN_DEPTH", 4, DepthSample{});
       f.outputs(5);
       f.mark(5);
     }},
    {"MarkOfAnotherTime",
     [](Forger& f) {
       f.outputs(5);
       f.mark(6);
     }},
    {"MarkThatSaysAnotherTime",
     [](Forger& f) {
       f.outputs(5);
       f.mark(5, f.right_mark(6));
     }},
    {"WrongCount",
     [](Forger& f) {
       f.outputs(5);
       TickMark mark = f.right_mark(5);
       ++mark.events;
       f.mark(5, mark);
     }},
    {"AnotherHeader",
     [](Forger& f) {
       f.put("DIVE_HEADER", 0, sample_header());
       f.outputs(5);
       f.mark(5);
     }},
    {"EventMissing",
     [](Forger& f) {
       f.put("DIVE_IN_DEPTH", 5, DepthSample{});
       f.skip_event_number();
       f.outputs(5);
       f.mark(5);
     }},
    {"UnknownChannel",
     [](Forger& f) {
       f.raw("DIVE_OUT_NOTHING", 5, {1, 2, 3});
       f.outputs(5);
       f.mark(5);
     }},
    {"NotItsType",
     [](Forger& f) {
       f.put("DIVE_IN_AHRS", 5, DepthSample{});
       f.outputs(5);
       f.mark(5);
     }},
    {"NoPacket",
     [](Forger& f) {
       f.raw("DIVE_IN_AHRS", 5, {});
       f.outputs(5);
       f.mark(5);
     }},
    {"TooLargeForItsChannel",
     [](Forger& f) {
       f.raw("DIVE_IN_AHRS", 5, Packet(2000));
       f.outputs(5);
       f.mark(5);
     }},
    {"TooManyEvents",
     [](Forger& f) {
       f.outputs(5);
       for (int i = 0; i < 5000; ++i) f.put("DIVE_OUT_FAILSAFE", 5, Utime{5}, FailsafeRecord{});
       f.mark(5);
     }},
};

class DamagedTick : public ::testing::TestWithParam<BadTick> {};

void PrintTo(const BadTick& bad, std::ostream* out) { *out << bad.name; }

TEST_P(DamagedTick, IsAGap) {
  const TemporaryFile file;
  {
    Forger forger(file.path());
    forger.header();
    forger.outputs(1);  // A complete tick before.
    forger.mark(1);
    GetParam().write(forger);
    forger.outputs(9);  // A complete tick after.
    forger.mark(9);
  }
  const ReadLog read = read_log(file.path());
  ASSERT_TRUE(read.opened) << read.error;
  ASSERT_EQ(read.ticks.size(), 2U);
  EXPECT_EQ(read.ticks[0].inputs.now, 1);
  EXPECT_EQ(read.ticks[1].inputs.now, 9);
  EXPECT_EQ(read.events, 11);
  EXPECT_FALSE(read.torn);
  ASSERT_EQ(read.gaps.size(), 1U);
  EXPECT_EQ(read.gaps[0].from, 1);
  EXPECT_EQ(read.gaps[0].to, 9);
}

INSTANTIATE_TEST_SUITE_P(Each, DamagedTick, ::testing::ValuesIn(kBadTicks),
                         [](const auto& case_info) { return case_info.param.name; });

// ---------------------------------------------------------------------------- not a log

TEST(OpenLog, ReportsWhatIsWrong) {
  const TemporaryFile file;
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("no such file"));
  EXPECT_THAT(read_log(::testing::TempDir()).error, HasSubstr("is a directory"));
  file.set_content("");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a log of dive"));
  file.set_content("<mission>this is another kind of file altogether</mission>");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a log of dive"));
  {
    Forger forger(file.path());
    forger.raw("DIVE_HEADER", 0, Packet(100));
  }
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("by another version"));
  {
    Forger forger(file.path());
    forger.raw("DIVE_OUT_OLDER", 0, Packet(100));
  }
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("by another version"));
  write_log(file.path(), {});
  std::filesystem::resize_file(file.path(), 100);
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("ends within its header"));
}

TEST(OpenLog, ReportsMissingPermission) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const TemporaryFile file;
  write_log(file.path(), {});
  std::filesystem::permissions(file.path(), std::filesystem::perms::none);
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("Permission denied"));
}

// ---------------------------------------------------------------------------- failing disk

TEST(WriteLog, ReportsWhyItCannotBeCreated) {
  const auto nowhere = LogWriter::create("/nowhere/at/all.lcm", sample_header());
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error(), HasSubstr("No such file or directory"));
  const auto full = LogWriter::create("/dev/full", sample_header());
  ASSERT_FALSE(full);
  EXPECT_THAT(full.error(), HasSubstr("No space left on device"));
  const TemporaryFile file;
  LogHeader header = sample_header();
  header.mission_xml = std::string("a\0b", 3);
  const auto odd = LogWriter::create(file.path(), header);
  ASSERT_FALSE(odd);
  EXPECT_THAT(odd.error(), HasSubstr("too large or not a text"));
}

/// Limits files of this process to `bytes`; a write beyond fails like one to a full disk.
class SmallDisk {
 public:
  explicit SmallDisk(std::size_t bytes) {
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

// Whole ticks only, and never a log that looks complete.
TEST(WriteLog, KeepsWhatFitsOnAFullDiskAndMarksTheRest) {
  const std::vector<LoggedTick> ticks = sample_ticks(13, 6);
  const std::vector<std::size_t> ends = tick_ends(ticks);
  for (std::size_t room = ends.front(); room <= ends.back(); room += 7) {
    const TemporaryFile file;
    {
      const SmallDisk disk(room);
      auto log = LogWriter::create(file.path(), sample_header());
      ASSERT_TRUE(log) << log.error();
      for (const LoggedTick& tick : ticks) {
        EXPECT_TRUE(log->write(tick.inputs, tick.outputs, tick.truth))
            << "the disk is not waited for";
      }
      EXPECT_EQ(log->close(), room == ends.back());
      EXPECT_EQ(log->disk_error().empty(), room == ends.back());
      const ReadLog read = read_log(file.path());
      EXPECT_EQ(std::ssize(read.ticks) + log->lost(), std::ssize(ticks)) << room;
    }
    const ReadLog read = read_log(file.path());
    auto next = ticks.begin();
    for (const LoggedTick& tick : read.ticks) {
      next = std::find_if(next, ticks.end(),
                          [&](const LoggedTick& each) { return bits(each) == bits(tick); });
      ASSERT_NE(next++, ticks.end()) << room;
    }
    EXPECT_FALSE(read.torn) << room;
    constexpr std::size_t kMark = 28 + 9 + 20 + 4;
    if (read.ticks.size() < ticks.size() && room >= ends.front() + kMark) {
      EXPECT_FALSE(read.gaps.empty()) << room;
    }
  }
}

LogOptions on(const std::shared_ptr<FakeDisk>& disk, WhenFull when_full) {
  LogOptions options;
  options.when_full = when_full;
  options.open = FakeDisk::open(disk);
  return options;
}

TEST(WriteLog, ADiskThatIsFullForAWhileLeavesAGap) {
  const std::vector<LoggedTick> ticks = sample_ticks(13, 9);
  const auto disk = std::make_shared<FakeDisk>(tick_ends(ticks)[3] + 100);
  auto log = LogWriter::create("", sample_header(), on(disk, WhenFull::kWait));
  ASSERT_TRUE(log) << log.error();
  for (std::size_t i = 0; i < 6; ++i) log->write(ticks[i].inputs, ticks[i].outputs, ticks[i].truth);
  while (log->lost() < 3) std::this_thread::yield();
  EXPECT_THAT(log->disk_error(), HasSubstr("No space left"));
  disk->set_room(1U << 30U);
  for (std::size_t i = 6; i < 9; ++i) log->write(ticks[i].inputs, ticks[i].outputs, ticks[i].truth);
  EXPECT_FALSE(log->close());
  EXPECT_EQ(log->lost(), 3);
  const TemporaryFile file;
  file.set_content(disk->content());
  const ReadLog read = read_log(file.path());
  EXPECT_EQ(read.ticks.size(), 6U);
  ASSERT_EQ(read.gaps.size(), 1U);
  EXPECT_EQ(read.gaps[0].from, ticks[2].inputs.now);
  EXPECT_EQ(read.gaps[0].to, ticks[6].inputs.now);
}

TEST(WriteLog, OfAStalledDiskTheQueueIsBoundedAndTheLossIsAGap) {
  const LoggedTick tick = sample_ticks(13, 1).front();
  const auto disk = std::make_shared<FakeDisk>(1U << 30U);
  auto log = LogWriter::create("", sample_header(), on(disk, WhenFull::kDrop));
  ASSERT_TRUE(log) << log.error();
  disk->stall();
  std::int64_t queued = 0;
  while (log->write(tick.inputs, tick.outputs, tick.truth)) ++queued;
  log->write(tick.inputs, tick.outputs, tick.truth);
  EXPECT_EQ(log->lost(), 2);
  disk->go_on();
  EXPECT_FALSE(log->close()) << "the log must not end as if nothing were missing";
  const TemporaryFile file;
  file.set_content(disk->content());
  EXPECT_GT(disk->content().size(), 24U << 20U);
  EXPECT_LT(disk->content().size(), 40U << 20U);
  const ReadLog read = read_log(file.path());
  EXPECT_EQ(std::ssize(read.ticks), queued);
  ASSERT_EQ(read.gaps.size(), 1U);
  EXPECT_FALSE(read.gaps[0].to);
}

TEST(WriteLog, OfADiveUnderWayBeginsWhenTheDiskHasRoom) {
  const std::vector<LoggedTick> ticks = sample_ticks(13, 1);
  const auto disk = std::make_shared<FakeDisk>(1U << 30U);
  disk->set_missing(true);
  LogOptions options = on(disk, WhenFull::kWait);
  EXPECT_FALSE(LogWriter::create("", sample_header(), options)) << "a new dive needs its log";
  options.is_optional = true;
  auto log = LogWriter::create("", sample_header(), options);
  ASSERT_TRUE(log) << log.error();
  EXPECT_THAT(log->disk_error(), HasSubstr("No space left"));
  log->write(ticks[0].inputs, ticks[0].outputs, ticks[0].truth);
  while (log->lost() < 1) std::this_thread::yield();
  disk->set_missing(false);
  for (std::int64_t lost = -1; log->lost() != lost;) {  // until one is not lost
    lost = log->lost();
    log->write(ticks[0].inputs, ticks[0].outputs, ticks[0].truth);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(log->close());
  const TemporaryFile file;
  file.set_content(disk->content());
  const ReadLog read = read_log(file.path());
  EXPECT_TRUE(read.has_header);
  EXPECT_GE(read.ticks.size(), 1U);
  EXPECT_EQ(read.gaps.size(), 1U);
}

TEST(WriteLog, ATickThatCannotBeWrittenIsAGap) {
  const TemporaryFile file;
  const std::vector<LoggedTick> ticks = sample_ticks(13, 2);
  auto log = LogWriter::create(file.path(), sample_header());
  ASSERT_TRUE(log) << log.error();
  StepOutputs odd;
  odd.status.state = std::string("a\0b", 3);
  EXPECT_TRUE(log->write(ticks[0].inputs, ticks[0].outputs, ticks[0].truth));
  EXPECT_FALSE(log->write({}, odd, std::nullopt));
  EXPECT_TRUE(log->write(ticks[1].inputs, ticks[1].outputs, ticks[1].truth));
  EXPECT_FALSE(log->close());
  const ReadLog read = read_log(file.path());
  EXPECT_EQ(read.ticks.size(), 2U);
  EXPECT_EQ(read.gaps.size(), 1U);
}

TEST(WriteLog, MoreEventsThanATickMayHaveAreRefused) {
  const TemporaryFile file;
  auto log = LogWriter::create(file.path(), sample_header());
  ASSERT_TRUE(log) << log.error();
  StepOutputs outputs;
  outputs.transitions.resize(4096 - 4);
  EXPECT_TRUE(log->write({}, outputs, std::nullopt));
  outputs.transitions.emplace_back();
  EXPECT_FALSE(log->write({}, outputs, std::nullopt));
  EXPECT_FALSE(log->close());
  EXPECT_EQ(read_log(file.path()).ticks.size(), 1U);
  EXPECT_EQ(read_log(file.path()).gaps.size(), 1U);
}

TEST(WriteLog, ClosedItTakesNothing) {
  const TemporaryFile file;
  auto log = LogWriter::create(file.path(), sample_header());
  ASSERT_TRUE(log) << log.error();
  EXPECT_TRUE(log->close());
  EXPECT_FALSE(log->write({}, {}, std::nullopt));
  EXPECT_FALSE(log->close());
}

}  // namespace
}  // namespace dive::mission::testing
