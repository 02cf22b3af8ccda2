// The last commit is recovered whatever the instant at which the process dies, and the dive
// continues from there without repeating actions that are executed once.

#include "mission/record/journal.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "mission/record/journal_bank.h"
#include "mission/record/journal_file.h"
#include "test/common/sanitizers.h"
#include "test/mission/record/fake_disk.h"
#include "test/mission/record/killed_dive.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::FakeDisk;
using testing::first_bank_of;
using testing::KilledDive;

class JournalTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "dive-journal-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    path_ = (folder_ / "dive.journal").string();
    reference_ = (folder_ / "whole.journal").string();
    const DiveResult whole = dive_.dive(reference_);
    ASSERT_EQ(whole.outcome, "success") << whole.cause;
    whole_ = first_bank_of(reference_);
    ASSERT_GT(std::ranges::count(whole_, '\n'), 50);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& content) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << content;
  }
  static std::int64_t commits_in(std::string_view text) {
    std::int64_t commits = 0;
    for (std::size_t at = 0; (at = text.find("\"active\":", at)) != std::string_view::npos; ++at) {
      ++commits;
    }
    return commits;
  }
  // The complete lines of a prefix of the journal.
  static std::string whole_lines(const std::string& text) {
    const std::size_t end = text.rfind('\n');
    return end == std::string::npos ? std::string() : text.substr(0, end + 1);
  }

  KilledDive dive_;
  fs::path folder_;
  std::string path_;
  std::string reference_;
  std::string whole_;
};

TEST_F(JournalTest, CutAnywhereItEndsAtTheLastWholeLine) {
  const std::size_t header = whole_.find('\n') + 1;
  std::size_t cuts = 0;
  for (std::size_t size = 0; size < whole_.size(); size += size < 3000 ? 1 : 61) {
    const std::string cut = whole_.substr(0, size);
    const auto journal = parse_journal(cut);
    ASSERT_EQ(journal.has_value(), size >= header) << size;
    if (!journal) continue;
    const std::string kept = whole_lines(cut);
    ASSERT_EQ(journal->commits, commits_in(kept)) << size;
    ASSERT_EQ(journal->checkpoint.has_value(), journal->commits > 0);
    ++cuts;
  }
  EXPECT_GT(cuts, 1000U);
}

TEST_F(JournalTest, DamagedAnywhereItEndsBefore) {
  Random random(5);
  const std::size_t header = whole_.find('\n') + 1;
  for (int i = 0; i < 500; ++i) {
    std::string damaged = whole_;
    const std::size_t at = header + random.bits() % (whole_.size() - header);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random.bits() % 7)));
    const auto journal = parse_journal(damaged);
    ASSERT_TRUE(journal);
    EXPECT_EQ(journal->commits, commits_in(whole_lines(whole_.substr(0, at)))) << at;
  }
}

TEST_F(JournalTest, WhatIsNoneIsRefused) {
  for (const char* content : {"", "\n", "hello\n", "0123456789abcdef {}\n"}) {
    write(content);
    EXPECT_FALSE(read_journal(path_)) << content;
  }
  EXPECT_FALSE(read_journal((folder_ / "none").string()));
  EXPECT_FALSE(JournalWriter::create((folder_ / "no" / "folder").string(), {}));
}

TEST_F(JournalTest, GoesOnAfterATornEndInTheOtherBank) {
  const std::string torn = whole_.substr(0, whole_.size() / 2);
  write(torn);
  const auto before = read_journal(path_);
  ASSERT_TRUE(before);
  std::vector<std::string> payload;
  dive_.resume(path_, payload);
  EXPECT_EQ(first_bank_of(path_), torn) << "untouched until the other bank is full";
  const auto after = read_journal(path_);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->generation, before->generation + 1);
  EXPECT_GT(after->commits, before->commits);
}

TEST_F(JournalTest, ForTheLogItIsOneSnapshotOfTheSameState) {
  const auto journal = parse_journal(whole_);
  ASSERT_TRUE(journal);
  const std::string text = to_text(*journal);
  EXPECT_LT(text.size(), whole_.size() / 4);
  const auto again = parse_journal(text);
  ASSERT_TRUE(again);
  EXPECT_EQ(to_text(*again), text);
  EXPECT_EQ(again->commits, journal->commits);
  EXPECT_EQ(again->trail.size(), journal->trail.size());
  EXPECT_EQ(again->checkpoint->X_WB.p, journal->checkpoint->X_WB.p) << "every bit";
}

TEST_F(JournalTest, HasTheBiasesOfTheImu) {
  auto journal = parse_journal(whole_);
  ASSERT_TRUE(journal);
  EXPECT_FALSE(journal->checkpoint->imu_bias) << "a dive without the visual-inertial estimator";
  const estimation::ImuBias bias{
      1'234'567, {0.05, -1.0 / 3.0, 0.0}, {0.1, 0.2, -0.3}, 0.0012, 0.034};
  journal->checkpoint->imu_bias = bias;
  const auto again = parse_journal(to_text(*journal));
  ASSERT_TRUE(again && again->checkpoint->imu_bias);
  const estimation::ImuBias& read = *again->checkpoint->imu_bias;
  EXPECT_EQ(read.utime, bias.utime);
  EXPECT_EQ(read.gyro_B, bias.gyro_B);
  EXPECT_EQ(read.accel_B, bias.accel_B);
  EXPECT_EQ(read.gyro_sigma, bias.gyro_sigma);
  EXPECT_EQ(read.accel_sigma, bias.accel_sigma);
}

TEST_F(JournalTest, KilledAfterEveryLineTheLastCommitIsThere) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of dives");
  const auto lines = std::ranges::count(whole_, '\n');
  for (std::int64_t line = 1; line <= lines; line += 3) {
    dive_.kill_after_line(path_, line);
    const std::string kept = first_bank_of(path_);
    ASSERT_EQ(std::ranges::count(kept, '\n'), line);
    ASSERT_TRUE(whole_.starts_with(kept)) << "the dive is the same, as far as it came";
    const auto journal = read_journal(path_);
    ASSERT_TRUE(journal);
    ASSERT_EQ(journal->commits, commits_in(kept));
  }
}

TEST_F(JournalTest, KilledAtAnyMomentTheLastCommitIsThere) {
  Random random(11);
  for (int i = 0; i < 20; ++i) {
    dive_.kill_after(path_, static_cast<std::int64_t>(random.bits() % 30'000));
    const std::string kept = first_bank_of(path_);
    ASSERT_TRUE(whole_.starts_with(kept));
    const auto journal = read_journal(path_);
    ASSERT_EQ(journal.has_value(), !whole_lines(kept).empty());
    if (journal) {
      ASSERT_EQ(journal->commits, commits_in(whole_lines(kept)));
    }
    fs::remove(path_);
  }
}

TEST_F(JournalTest, TheDiveGoesOnFromAnyCommitAndRepeatsNothing) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of dives");
  std::vector<std::size_t> ends;
  for (std::size_t at = 0; (at = whole_.find('\n', at)) != std::string::npos; ++at) {
    ends.push_back(at + 1);
  }
  for (std::size_t line = 1; line < ends.size(); line += 7) {
    const std::string kept = whole_.substr(0, ends[line]);
    write(kept);
    const auto journal = read_journal(path_);
    ASSERT_TRUE(journal);
    std::vector<std::string> payload;
    const DiveResult result = dive_.resume(path_, payload);
    EXPECT_EQ(result.outcome, "success") << "line " << line << ": " << result.cause;
    const std::size_t done = journal->checkpoint ? journal->checkpoint->done_once.size() : 0;
    EXPECT_EQ(payload.size(), 2U - done) << "line " << line;
    if (!journal->checkpoint) continue;
    // Completed goals are not visited again: from c the surface is near.
    if (journal->checkpoint->goals_done == 2) {
      EXPECT_LT(result.distance_m, 8.0) << "line " << line;
    }
    EXPECT_EQ(result.transitions.front().record.cause, "the executive was restarted");
  }
}

// The writer's thread, without the thread.
class Day {
 public:
  explicit Day(const std::string& journal)
      : checkpoint_(to_json_text(*parse_journal(journal)->checkpoint)) {}

  JournalFile begin() {
    JournalOptions options;
    options.open = FakeDisk::open(disk_);
    return {std::move(options), JournalState{.header = {"digest", 1}}, 1};
  }
  /// A commit, or every third time a breadcrumb half a metre further.
  void pass(JournalFile& file) {
    if (++passes_ % 3 == 0) {
      angle_ += 0.01;
      const behaviors::Trail::Breadcrumb breadcrumb{
          {50.0 * std::cos(angle_), 50.0 * std::sin(angle_), -3.0}, true};
      trail_.add(breadcrumb.p_W, breadcrumb.open_above);
      return file.take(breadcrumb_bytes(breadcrumb));
    }
    ++commits_;
    std::string entry(1, static_cast<char>(JournalEntry::kCommit));
    entry += checkpoint_;
    file.take({reinterpret_cast<const std::uint8_t*>(entry.data()), entry.size()});
  }

  std::shared_ptr<FakeDisk> disk_ = std::make_shared<FakeDisk>();
  behaviors::Trail trail_;
  std::int64_t commits_ = 0;

 private:
  std::string checkpoint_;
  std::int64_t passes_ = 0;
  double angle_ = 0.0;
};

TEST_F(JournalTest, HasTheTrailAsALoopClosureHasMovedIt) {
  Day day(whole_.substr(0, whole_.size() / 2));
  JournalFile file = day.begin();
  ASSERT_TRUE(file.begin());
  for (int i = 0; i < 90; ++i) day.pass(file);
  day.trail_.move({{{0, {0.0, {3.0, -4.0}}}}});
  file.take(trail_bytes(day.trail_));
  for (int i = 0; i < 90; ++i) day.pass(file);
  EXPECT_EQ(file.lost(), 0);
  write(day.disk_->content());
  const auto journal = read_journal(path_);
  ASSERT_TRUE(journal) << journal.error();
  EXPECT_EQ(journal->commits, day.commits_);
  ASSERT_EQ(journal->trail.size(), day.trail_.size());
  for (std::size_t i = 0; i < journal->trail.size(); ++i) {
    EXPECT_EQ(journal->trail[i].p_W, day.trail_.breadcrumbs()[i].p_W) << i;
    EXPECT_TRUE(journal->trail[i].open_above);
  }
}

TEST_F(JournalTest, AfterADayItHasItsSizeAndItsTrailAndTheDiveGoesOn) {
  // 24 h at 0.4 m/s are 70,000 breadcrumbs. Commits are fewer here: each is as large as the next.
  Day day(whole_.substr(0, whole_.size() / 2));
  JournalFile file = day.begin();
  ASSERT_TRUE(file.begin());
  for (int i = 0; i < 210'000; ++i) day.pass(file);
  EXPECT_EQ(file.lost(), 0);
  EXPECT_EQ(day.disk_->content().size(), kJournalBytes);
  EXPECT_GT(day.disk_->syncs(), 50) << "banks are on the disk before the other is overwritten";
  write(day.disk_->content());
  const auto journal = read_journal(path_);
  ASSERT_TRUE(journal) << journal.error();
  EXPECT_EQ(journal->commits, day.commits_);
  EXPECT_EQ(journal->trail_spacing_m, day.trail_.spacing());
  ASSERT_EQ(journal->trail.size(), day.trail_.size());
  EXPECT_EQ(journal->trail.back().p_W, day.trail_.newest().p_W);
  EXPECT_LT(to_text(*journal).size(), kJournalBankBytes) << "the log's header has room for it";
  std::vector<std::string> payload;
  EXPECT_EQ(dive_.resume(path_, payload).outcome, "success");
}

// Whatever part of the last write has reached the file, where banks are changed too.
TEST_F(JournalTest, CutInAnyWriteTheLastCommitIsThere) {
  Day day(whole_);
  JournalFile file = day.begin();
  ASSERT_TRUE(file.begin());
  const int first_sync = day.disk_->syncs();
  int changes = 0;
  for (int pass = 1; changes < 3; ++pass) {
    const std::string before = day.disk_->content();
    const std::int64_t commits = day.commits_;
    day.pass(file);
    const std::string& after = day.disk_->content();
    const bool has_changed = day.disk_->syncs() - first_sync > changes;
    if (!has_changed && pass % 500 != 0) continue;
    changes = day.disk_->syncs() - first_sync;
    std::size_t first = 0;
    while (first < after.size() && before[first] == after[first]) ++first;
    std::size_t last = after.size();
    while (last > first && before[last - 1] == after[last - 1]) --last;
    for (std::size_t cut = first; cut < last; cut += 1 + (last - first) / 4) {
      std::string torn = before;
      std::copy(after.begin() + static_cast<std::ptrdiff_t>(first),
                after.begin() + static_cast<std::ptrdiff_t>(cut),
                torn.begin() + static_cast<std::ptrdiff_t>(first));
      write(torn);
      const auto journal = read_journal(path_);
      ASSERT_TRUE(journal) << journal.error();
      EXPECT_EQ(journal->commits, commits);
    }
    write(after);
    EXPECT_EQ(read_journal(path_)->commits, day.commits_);
  }
}

TEST_F(JournalTest, OnAFullDiskItGoesOnInItsOwnSpace) {
  Day day(whole_);
  JournalFile file = day.begin();
  ASSERT_TRUE(file.begin());
  day.disk_->set_room(kJournalBytes);  // not a byte more
  for (int i = 0; i < 5000; ++i) day.pass(file);
  EXPECT_EQ(file.lost(), 0);
  write(day.disk_->content());
  EXPECT_EQ(read_journal(path_)->commits, day.commits_);
  // There a new one is refused, with the reason.
  const auto full = JournalWriter::create("/dev/full", {});
  ASSERT_FALSE(full);
  EXPECT_THAT(full.error(), ::testing::HasSubstr("2 MiB"));
  EXPECT_THAT(full.error(), ::testing::HasSubstr("No space left"));
}

TEST_F(JournalTest, AWriteThatFailsIsCountedAndTheOtherBankTakesOver) {
  Day day(whole_);
  JournalFile file = day.begin();
  ASSERT_TRUE(file.begin());
  for (int i = 0; i < 10; ++i) day.pass(file);
  day.disk_->set_room(0);
  const std::int64_t commits = day.commits_;
  for (int i = 0; i < 30; ++i) day.pass(file);
  EXPECT_EQ(file.lost(), 30);
  EXPECT_FALSE(file.is_whole());
  write(day.disk_->content());
  EXPECT_EQ(read_journal(path_)->commits, commits) << "the last one before";
  day.disk_->set_room(1U << 30U);
  while (!file.is_whole()) {  // it tries once a second
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    day.pass(file);
  }
  write(day.disk_->content());
  const auto journal = read_journal(path_);
  EXPECT_EQ(journal->commits, day.commits_);
  EXPECT_EQ(journal->generation, 2);
}

// On a vehicle nothing waits, and a payload command is not safe until the disk has it.
TEST_F(JournalTest, OfAStalledDiskPayloadCommandsAreNotSafe) {
  const auto disk = std::make_shared<FakeDisk>();
  JournalOptions options;
  options.when_full = WhenFull::kDrop;
  options.open = FakeDisk::open(disk);
  auto journal = JournalWriter::create("", {"digest", 1}, std::move(options));
  ASSERT_TRUE(journal);
  bool was_unsafe = false;
  bool is_stalled = false;
  const DiveResult result = dive_.dive(*journal, [&](const StepOutputs& outputs) {
    const bool has_payload = std::ranges::any_of(outputs.actions, [](const ActionRecord& action) {
      return action.kind == ActionRecord::Kind::kPayload;
    });
    if (!is_stalled && !has_payload && outputs.status.state == "ready") {
      disk->stall();  // after "lights", before "marker"
      is_stalled = true;
    }
    if (has_payload && is_stalled) was_unsafe = !journal->has_commands();
  });
  EXPECT_EQ(result.outcome, "success") << "the dive goes on";
  EXPECT_TRUE(was_unsafe);
  EXPECT_FALSE(journal->has_commands());
  disk->go_on();
  EXPECT_TRUE(journal->close());
  EXPECT_TRUE(journal->has_commands());
  EXPECT_EQ(journal->lost(), 0) << "the queue had room";
}

}  // namespace
}  // namespace dive::mission
