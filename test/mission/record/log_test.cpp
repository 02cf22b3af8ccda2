#include "mission/record/log.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <dive/header_t.hpp>
#include <dive/state_estimate_t.hpp>
#include <dive/status_t.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <unistd.h>

#include "test/mission/record/log_file.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

using ::testing::HasSubstr;

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

TEST(OpenLog, ReportsWhatIsWrong) {
  const TemporaryFile file;
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("no such file"));
  EXPECT_THAT(read_log(::testing::TempDir()).error, HasSubstr("is a directory"));
  file.set_content("");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a log written by dive"));
  file.set_content("<mission>this is another kind of file altogether</mission>");
  EXPECT_THAT(read_log(file.path()).error, HasSubstr("not a log written by dive"));
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

}  // namespace
}  // namespace dive::mission::testing
