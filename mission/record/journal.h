#pragma once
// The journal: the data for a restarted executive, written before they take effect (write-ahead). A
// text file of lines, each with its own checksum, "HEX16 JSON": a header, then commits and
// breadcrumbs of the trail in the order in which they happened. The last commit is recovered
// whatever the instant at which the process dies; a torn or damaged line ends the journal.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "mission/executive/executive.h"

namespace dive::mission {

struct JournalHeader {
  std::string digest;  ///< log_digest() of mission, map and vehicle.
  std::uint64_t seed = 0;
};

class JournalWriter {
 public:
  /// Creates a journal in the place of any older one. The error is a sentence.
  [[nodiscard]] static tl::expected<JournalWriter, std::string> create(const std::string& path,
                                                                       const JournalHeader& header);
  /// Continues one that read_journal() accepted; first cuts off a torn end.
  [[nodiscard]] static tl::expected<JournalWriter, std::string> append(const std::string& path);
  JournalWriter(JournalWriter&&) noexcept;
  JournalWriter& operator=(JournalWriter&&) noexcept;
  ~JournalWriter();

  /// Called after every step and before its outputs are published: commits if the step changed
  /// something that a restart needs (a transition, a rung, an action, a goal), and five times a
  /// second for the position. True if nothing was lost so far; a full disk does not stop a dive.
  bool keep(const Executive& executive, const StepOutputs& outputs);
  /// Number of commits so far.
  [[nodiscard]] std::int64_t commits() const;
  /// For tests: called after every line written to the file.
  void on_line(void (*told)(std::int64_t lines));

 private:
  struct Impl;
  explicit JournalWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

struct Journal {
  JournalHeader header;
  /// Last commit; absent if the process died before the first.
  std::optional<Checkpoint> checkpoint;
  std::vector<behaviors::Trail::Breadcrumb> trail;
  std::int64_t commits = 0;
  bool torn = false;  ///< The rest of the file could not be read.
};

/// The error is a sentence: no such file, not a journal. `text`, if given, receives the intact part
/// of the file.
[[nodiscard]] tl::expected<Journal, std::string> read_journal(const std::string& path,
                                                              std::string* text = nullptr);
/// Parses a journal from memory.
[[nodiscard]] tl::expected<Journal, std::string> parse_journal(const std::string& text);

}  // namespace dive::mission
