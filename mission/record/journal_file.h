#pragma once
// The file of a journal, as its thread writes it. Private to mission/record.

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "mission/record/journal.h"
#include "mission/record/journal_bank.h"

namespace dive::mission {

/// What the thread is given: one byte for its kind, and the content.
enum class JournalEntry : std::uint8_t {
  kCommit,         ///< A checkpoint as JSON.
  kCommitAndSync,  ///< The same, that must reach the disk.
  kBreadcrumb,     ///< breadcrumb_bytes()
  kTrail,          ///< trail_bytes(): after a loop closure has moved it.
};
[[nodiscard]] std::array<std::uint8_t, 26> breadcrumb_bytes(
    const behaviors::Trail::Breadcrumb& breadcrumb);
[[nodiscard]] std::vector<std::uint8_t> trail_bytes(const behaviors::Trail& trail);

class JournalFile {
 public:
  /// Continues at `state`, in the bank that follows `generation`. Opens nothing yet.
  JournalFile(JournalOptions options, JournalState state, std::int64_t generation);

  /// Opens the file, writes the first snapshot and allocates the rest. The error is that of errno.
  [[nodiscard]] tl::expected<void, int> begin();
  void take(std::span<const std::uint8_t> entry);

  // From any thread:
  /// Number of the last entry up to which all are on the disk.
  [[nodiscard]] std::uint64_t synced() const { return synced_.load(); }
  [[nodiscard]] std::int64_t lost() const { return lost_.load(); }
  /// True if the last entry was written.
  [[nodiscard]] bool is_whole() const { return is_whole_.load(); }

 private:
  void take_trail(std::span<const std::uint8_t> content);
  [[nodiscard]] bool append(const std::string& line);
  [[nodiscard]] bool write_snapshot();
  [[nodiscard]] tl::expected<void, int> open();

  const JournalOptions options_;
  JournalState state_;
  BankText bank_;
  std::unique_ptr<RecordFile> file_;
  std::uint64_t used_ = 0;      // Bytes of the bank.
  bool needs_snapshot_ = true;  // The bank cannot be continued.
  std::chrono::steady_clock::time_point next_attempt_;
  std::uint64_t entries_ = 0;
  std::int64_t lines_ = 0;  // In all.
  std::atomic<std::uint64_t> synced_ = 0;
  std::atomic<std::int64_t> lost_ = 0;
  std::atomic<bool> is_whole_ = true;
};

}  // namespace dive::mission
