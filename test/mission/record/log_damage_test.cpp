// Logs that are torn, damaged or forged: nothing is read that was not written, and what is missing
// is a gap.

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "mission/record/log.h"
#include "test/mission/record/log_file.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

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

}  // namespace
}  // namespace dive::mission::testing
