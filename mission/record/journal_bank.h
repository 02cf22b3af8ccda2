#pragma once
// The text of one bank of a journal (journal.h). Private to mission/record.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "behaviors/trail.h"
#include "mission/record/journal.h"

namespace dive::mission {

/// A checkpoint as JSON, and back; empty if a value is missing or has another type.
[[nodiscard]] std::string to_json_text(const Checkpoint& checkpoint);

/// State of a journal as its writer and its reader keep it.
struct JournalState {
  JournalHeader header;
  std::string checkpoint = {};  ///< Last commit as JSON; empty before the first.
  behaviors::Trail trail = behaviors::Trail();
  std::int64_t commits = 0;
};

/// Makes the lines of one bank, in order.
class BankText {
 public:
  explicit BankText(std::int64_t generation) : generation_(generation) {}

  /// The first lines.
  [[nodiscard]] std::string snapshot(const JournalState& state);
  [[nodiscard]] std::string commit(std::string_view checkpoint) { return line(checkpoint); }
  [[nodiscard]] std::string breadcrumb(const behaviors::Trail::Breadcrumb& breadcrumb);

  [[nodiscard]] std::int64_t generation() const { return generation_; }
  [[nodiscard]] std::int64_t lines() const { return lines_; }

 private:
  [[nodiscard]] std::string line(std::string_view json);

  std::int64_t generation_;
  std::int64_t lines_ = 0;
};

/// The readable part of a bank; empty without a whole snapshot.
[[nodiscard]] std::optional<Journal> parse_bank(std::string_view text);

}  // namespace dive::mission
