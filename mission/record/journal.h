#pragma once
// The journal: the data for a restarted executive. Another thread writes them, usually within a
// millisecond; only payload commands wait until they are on the disk (has_commands()).
//
// A file of fixed size, allocated before the dive, so that it needs no further space: two banks of
// 1 MiB, each a text of lines with a checksum, "HEX16 JSON", and zeros. A bank begins with a
// snapshot (header, trail, last checkpoint); commits and breadcrumbs follow in the order in which
// they happened. A full bank is followed by a snapshot in the other one. The checksum covers the
// bank's generation and the number of the line, so that an older text below is never read. The last
// commit in the file is recovered whatever the instant at which the process dies; a torn or damaged
// line ends a bank.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "common/background_output.h"
#include "mission/executive/executive.h"
#include "mission/record/record_file.h"

namespace dive::mission {

inline constexpr std::size_t kJournalBankBytes = 1U << 20U;
inline constexpr std::size_t kJournalBytes = 2 * kJournalBankBytes;  ///< Size of the file.

struct JournalHeader {
  std::string digest;  ///< log_digest() of mission, map and vehicle.
  std::uint64_t seed = 0;
};

struct Journal {
  JournalHeader header;
  /// Last commit; absent if the process died before the first.
  std::optional<Checkpoint> checkpoint;
  std::vector<behaviors::Trail::Breadcrumb> trail;
  double trail_spacing_m = behaviors::kTrailSpacing;
  std::int64_t commits = 0;
  std::int64_t generation = 0;  ///< Generation of the bank from which it was read.
};

/// The error is a sentence: no such file, not a journal.
[[nodiscard]] tl::expected<Journal, std::string> read_journal(const std::string& path);
/// Parses one bank.
[[nodiscard]] tl::expected<Journal, std::string> parse_journal(const std::string& text);
/// One bank with the state of `journal`, as parse_journal() reads it: for the log's header.
[[nodiscard]] std::string to_text(const Journal& journal);

struct JournalOptions {
  /// kWait, in simulation: keep() returns when a payload command is on the disk.
  WhenFull when_full = WhenFull::kWait;
  /// For tests: opens the file instead of the system; and is called on the writer's thread with the
  /// number of lines after every line.
  OpenRecordFile open = {};
  std::function<void(std::int64_t lines)> on_lines = {};
};

/// Commits are encoded by the caller and written by another thread.
class JournalWriter {
 public:
  /// Creates a journal in the place of any older one, and allocates all its space. The error is a
  /// sentence.
  [[nodiscard]] static tl::expected<JournalWriter, std::string> create(const std::string& path,
                                                                       const JournalHeader& header,
                                                                       JournalOptions options = {});
  /// Continues the journal at `path`, read by read_journal(), in its other bank. A file that cannot
  /// be written does not stop the dive: its commits are lost, and the writer tries again once a
  /// second.
  [[nodiscard]] static JournalWriter append(const std::string& path, const Journal& journal,
                                            JournalOptions options = {});
  JournalWriter(JournalWriter&&) noexcept;
  JournalWriter& operator=(JournalWriter&&) noexcept;
  ~JournalWriter();

  /// Called after every step and before its outputs are published: commits if the step changed
  /// something that a restart needs (a transition, a rung, an action, a goal), and five times a
  /// second for the position.
  void keep(const Executive& executive, const StepOutputs& outputs);
  /// True if the commits of all payload commands so far are on the disk: they may be executed,
  /// because a restarted executive will not repeat them.
  [[nodiscard]] bool has_commands() const;
  /// Number of commits and breadcrumbs lost so far.
  [[nodiscard]] std::int64_t lost() const;
  /// Waits for the disk, for at most ten seconds. Returns false if the last commit was lost.
  bool close();

 private:
  struct Impl;
  explicit JournalWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::mission
