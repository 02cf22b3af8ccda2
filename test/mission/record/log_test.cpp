#include "mission/record/log.h"

#include <algorithm>
#include <csignal>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <dive/header_t.hpp>
#include <dive/state_estimate_t.hpp>
#include <dive/status_t.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "test/mission/record/log_file.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

using ::testing::HasSubstr;

// ---------------------------------------------------------------------------- there and back

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
  EXPECT_EQ(log->header().version, expected.version);
  EXPECT_EQ(log->header().seed, expected.seed);
  EXPECT_EQ(log->header().mission_name, expected.mission_name);
  EXPECT_EQ(log->header().mission_xml, expected.mission_xml);
  EXPECT_EQ(log->header().map_name, expected.map_name);
  EXPECT_EQ(log->header().map_xml, expected.map_xml);
  EXPECT_EQ(log->header().vehicle_urdf, expected.vehicle_urdf);
  EXPECT_EQ(log->header().digest.size(), 16U);
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

// LCM's own reader and decoders are the independent judge of the format.
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
  ASSERT_EQ(header.decode(event->data, 0, event->datalen), event->datalen);
  EXPECT_EQ(header.mission_xml, sample_header().mission_xml);

  std::int64_t number = 1;
  std::size_t tick = 0;
  std::set<std::string> channels;
  while ((event = log.readNextEvent()) != nullptr) {
    ASSERT_LT(tick, ticks.size());
    const StepOutputs& outputs = ticks[tick].outputs;
    EXPECT_EQ(event->eventnum, number++);
    EXPECT_EQ(event->timestamp, ticks[tick].inputs.now);
    channels.insert(event->channel);
    if (event->channel == "DIVE_OUT_STATUS") {
      status_t status{};
      ASSERT_EQ(status.decode(event->data, 0, event->datalen), event->datalen);
      EXPECT_EQ(status.utime, ticks[tick].inputs.now);
      EXPECT_EQ(status.state, outputs.status.state);
      EXPECT_EQ(status.segment, outputs.status.segment);
    } else if (event->channel == "DIVE_OUT_ESTIMATE") {
      state_estimate_t estimate{};
      ASSERT_EQ(estimate.decode(event->data, 0, event->datalen), event->datalen);
      EXPECT_EQ(std::bit_cast<std::uint64_t>(estimate.covariance[6 * 2 + 4]),
                std::bit_cast<std::uint64_t>(outputs.estimate.covariance(2, 4)));
      EXPECT_EQ(std::bit_cast<std::uint64_t>(estimate.pose.q[3]),
                std::bit_cast<std::uint64_t>(outputs.estimate.X_WB.q.w()));
    } else if (event->channel == "DIVE_TICK") {
      ++tick;
    }
  }
  EXPECT_EQ(tick, ticks.size());
  EXPECT_EQ(channels.size(), 18U);
  EXPECT_EQ(read_log(file.path()).events, number);
}

// ---------------------------------------------------------------------------- torn and damaged

/// Where the file ends after the header and after each tick.
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
    for (std::size_t i = 0; i < expected; ++i) ASSERT_EQ(bits(read.ticks[i]), bits(ticks[i]));
  }
}

/// Some damage: bytes changed, removed, inserted, repeated, or a length field made huge.
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
  int refused = 0;
  for (int round = 0; round < 4000; ++round) {
    const std::string content = damaged(whole, maker);
    file.set_content(content);
    const ReadLog read = read_log(file.path());
    if (!read.opened) {
      EXPECT_FALSE(read.error.empty());
      ++refused;
      continue;
    }
    ASSERT_LE(read.ticks.size(), written.size());
    for (std::size_t i = 0; i < read.ticks.size(); ++i) {
      ASSERT_EQ(bits(read.ticks[i]), written[i]) << "round " << round;
    }
    ASSERT_TRUE(read.torn || whole.starts_with(content)) << "round " << round;
    if (read.ticks.size() < written.size()) ++shortened;
  }
  EXPECT_GT(refused, 20);
  EXPECT_GT(shortened, 2000);
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

/// A log whose frames and digests are right and whose one tick is not.
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
    {"WrongDigest",
     [](Forger& f) {
       f.outputs(5);
       TickMark mark = f.right_mark(5);
       ++mark.digest;
       f.mark(5, mark);
     }},
    {"AnotherHeader",
     [](Forger& f) {
       f.header();
       f.outputs(5);
       f.mark(5);
     }},
    {"EventMissing",
     [](Forger& f) {
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
       f.put("DIVE_IN_IMU", 5, DepthSample{});
       f.outputs(5);
       f.mark(5);
     }},
    {"NoPacket",
     [](Forger& f) {
       f.raw("DIVE_IN_IMU", 5, {});
       f.outputs(5);
       f.mark(5);
     }},
    {"TooLargeForItsChannel",
     [](Forger& f) {
       f.raw("DIVE_IN_IMU", 5, Packet(2000));
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

TEST_P(DamagedTick, EndsTheLog) {
  const TemporaryFile file;
  {
    Forger forger(file.path());
    forger.header();
    forger.outputs(1);  // A whole tick before ...
    forger.mark(1);
    GetParam().write(forger);
    forger.outputs(9);  // ... and one after.
    forger.mark(9);
  }
  const ReadLog read = read_log(file.path());
  ASSERT_TRUE(read.opened) << read.error;
  EXPECT_EQ(read.ticks.size(), 1U);
  EXPECT_EQ(read.events, 6);
  EXPECT_TRUE(read.torn);
}

INSTANTIATE_TEST_SUITE_P(Each, DamagedTick, ::testing::ValuesIn(kBadTicks),
                         [](const auto& case_info) { return case_info.param.name; });

// ---------------------------------------------------------------------------- not a log

TEST(OpenLog, SaysWhatIsWrong) {
  const TemporaryFile file;
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("no such file"));
  EXPECT_THAT(read_log(::testing::TempDir()).error, HasSubstr("not a regular file"));
  file.set_content("");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a dive log"));
  file.set_content("<mission>this is another kind of file altogether</mission>");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a dive log"));
  {
    Forger forger(file.path());
    forger.outputs(1);
  }
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("does not begin with a dive's header"));
  {
    Forger forger(file.path());
    forger.raw("DIVE_HEADER", 0, Packet(100));
  }
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("damaged or of another version"));
  {
    Forger forger(file.path());
    LogHeader header = sample_header();
    header.digest = "0123456789abcdef";
    forger.put("DIVE_HEADER", 0, header);
  }
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("damaged or of another version"));
}

TEST(OpenLog, SaysWhenItIsNotPermitted) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const TemporaryFile file;
  write_log(file.path(), {});
  std::filesystem::permissions(file.path(), std::filesystem::perms::none);
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("Permission denied"));
}

// ---------------------------------------------------------------------------- a disk that refuses

TEST(WriteLog, SaysWhyItCannotBeCreated) {
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

/// Lets files of this process grow to `bytes`; a write beyond fails like that to a full disk.
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

TEST(WriteLog, KeepsWhatFitsOnAFullDiskAndSaysSo) {
  const std::vector<LoggedTick> ticks = sample_ticks(13, 6);
  const std::vector<std::size_t> ends = tick_ends(ticks);
  for (std::size_t room = ends.front(); room <= ends.back(); room += 7) {
    const TemporaryFile file;
    const auto fitting = std::ranges::upper_bound(ends, room) - ends.begin() - 1;
    {
      const SmallDisk disk(room);
      auto log = LogWriter::create(file.path(), sample_header());
      ASSERT_TRUE(log) << log.error();
      for (std::size_t i = 0; i < ticks.size(); ++i) {
        const LoggedTick& tick = ticks[i];
        EXPECT_EQ(log->write(tick.inputs, tick.outputs, tick.truth),
                  static_cast<std::ptrdiff_t>(i) < fitting)
            << "room " << room << " tick " << i;
      }
      EXPECT_EQ(log->close(), room == ends.back());
    }
    EXPECT_EQ(static_cast<std::ptrdiff_t>(read_log(file.path()).ticks.size()), fitting);
  }
}

TEST(WriteLog, AfterAFailureNothingMoreIsWritten) {
  const TemporaryFile file;
  const std::vector<LoggedTick> ticks = sample_ticks(13, 2);
  auto log = LogWriter::create(file.path(), sample_header());
  ASSERT_TRUE(log) << log.error();
  StepOutputs odd;
  odd.status.state = std::string("a\0b", 3);
  EXPECT_TRUE(log->write(ticks[0].inputs, ticks[0].outputs, ticks[0].truth));
  EXPECT_FALSE(log->write({}, odd, std::nullopt));
  EXPECT_FALSE(log->write(ticks[1].inputs, ticks[1].outputs, ticks[1].truth));
  EXPECT_FALSE(log->close());
  const ReadLog read = read_log(file.path());
  EXPECT_EQ(read.ticks.size(), 1U);
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
