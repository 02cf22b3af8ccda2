// Logs on disks that are full, stall or refuse: what is lost is a gap.

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "mission/record/log.h"
#include "test/mission/record/fake_disk.h"
#include "test/mission/record/log_file.h"
#include "test/mission/record/sample.h"

namespace dive::mission::testing {
namespace {

using ::testing::HasSubstr;

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
