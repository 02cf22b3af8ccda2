// The last commit is recovered whatever the instant at which the process dies, and the dive
// continues from there without repeating actions that are executed once.

#include "mission/record/journal.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/random.h"
#include "test/common/sanitizers.h"
#include "test/mission/record/killed_dive.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
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
    whole_ = content_of(reference_);
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
    ASSERT_EQ(journal->torn, kept.size() < size);
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
    EXPECT_TRUE(journal->torn);
    EXPECT_EQ(journal->commits, commits_in(whole_lines(whole_.substr(0, at)))) << at;
  }
}

TEST_F(JournalTest, WhatIsNoneIsRefused) {
  for (const char* content : {"", "\n", "hello\n", "0123456789abcdef {}\n"}) {
    write(content);
    EXPECT_FALSE(read_journal(path_)) << content;
    EXPECT_FALSE(JournalWriter::append(path_)) << content;
  }
  EXPECT_FALSE(read_journal((folder_ / "none").string()));
  EXPECT_FALSE(JournalWriter::create((folder_ / "no" / "folder").string(), {}));
}

TEST_F(JournalTest, GoesOnAfterATornEnd) {
  write(whole_.substr(0, whole_.size() / 2));
  ASSERT_TRUE(JournalWriter::append(path_));
  EXPECT_EQ(content_of(path_), whole_lines(whole_.substr(0, whole_.size() / 2)));
}

TEST_F(JournalTest, KilledAfterEveryLineTheLastCommitIsThere) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of dives");
  const auto lines = std::ranges::count(whole_, '\n');
  for (std::int64_t line = 1; line <= lines; line += 3) {
    dive_.kill_after_line(path_, line);
    const std::string kept = content_of(path_);
    ASSERT_EQ(std::ranges::count(kept, '\n'), line);
    ASSERT_TRUE(whole_.starts_with(kept)) << "the dive is the same, as far as it came";
    const auto journal = read_journal(path_);
    ASSERT_TRUE(journal);
    ASSERT_FALSE(journal->torn);
    ASSERT_EQ(journal->commits, commits_in(kept));
  }
}

TEST_F(JournalTest, KilledAtAnyMomentTheLastCommitIsThere) {
  Random random(11);
  for (int i = 0; i < 20; ++i) {
    dive_.kill_after(path_, static_cast<std::int64_t>(random.bits() % 30'000));
    const std::string kept = content_of(path_);
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

}  // namespace
}  // namespace dive::mission
