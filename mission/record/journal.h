#pragma once
// The journal: what a restarted executive needs, kept before it takes effect (write-ahead). A text
// file of lines, each with its own checksum, "HEX16 JSON": a header, then commits and crumbs of the
// trail in the order in which they happened. Whatever instant the process dies at, what was
// committed last is found again; a line that is torn or damaged ends it.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "mission/executive/executive.h"

namespace dive::mission {

struct JournalHeader {
  std::string digest;  ///< Of mission, map and vehicle: log_digest().
  std::uint64_t seed = 0;
};

class JournalWriter {
 public:
  /// A new journal in the place of any older one; fails with a sentence.
  [[nodiscard]] static tl::expected<JournalWriter, std::string> create(const std::string& path,
                                                                       const JournalHeader& header);
  /// Goes on with one that read_journal() accepted; a torn end is cut off first.
  [[nodiscard]] static tl::expected<JournalWriter, std::string> append(const std::string& path);
  JournalWriter(JournalWriter&&) noexcept;
  JournalWriter& operator=(JournalWriter&&) noexcept;
  ~JournalWriter();

  /// To be called after every step and before its outputs are given to anyone: commits when the
  /// step changed something that a restart must know (a transition, a rung, an action, a goal), and
  /// five times a second for the position. True when nothing was lost so far; a full disk does not
  /// stop a dive.
  bool keep(const Executive& executive, const StepOutputs& outputs);
  /// Commits so far.
  [[nodiscard]] std::int64_t commits() const;
  /// For tests: told after every line that has reached the file.
  void on_line(void (*told)(std::int64_t lines));

 private:
  struct Impl;
  explicit JournalWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

struct Journal {
  JournalHeader header;
  std::optional<Committed> committed;  ///< The last; none when it died before the first.
  std::vector<behaviors::Trail::Crumb> trail;
  std::int64_t commits = 0;
  bool torn = false;  ///< Something after it could not be read.
};

/// Fails with a sentence: no such file, not a journal. `text`, if given, gets what was read of it
/// that is whole.
[[nodiscard]] tl::expected<Journal, std::string> read_journal(const std::string& path,
                                                              std::string* text = nullptr);
/// The same from memory.
[[nodiscard]] tl::expected<Journal, std::string> parse_journal(const std::string& text);

}  // namespace dive::mission
