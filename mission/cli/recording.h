#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "common/output_file.h"
#include "mission/cli/commands.h"
#include "mission/cli/loading.h"
#include "mission/record/journal.h"
#include "mission/record/log.h"

namespace dive::mission {

/// Log and journal of a dive.
class Recording {
 public:
  /// Opens both; with `--resume` continues from the journal. A log that is not named, and every log
  /// of a dive that is resumed, gets the next free number. Prints an error and returns the exit
  /// status if they cannot be opened.
  [[nodiscard]] static tl::expected<Recording, int> open(const RunArguments& arguments,
                                                         const LoadedMission& loaded);

  /// Seed of the dive: the journal's if it is resumed.
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] const std::optional<Resume>& resume() const { return resume_; }
  [[nodiscard]] const std::string& log_path() const { return log_path_; }

  void keep(const Executive& executive, const StepOutputs& outputs);
  void write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  /// Prints an error if anything was lost, which does not change the result of the dive.
  void close();

 private:
  /// Prints an error if the log cannot be written.
  void open_log(const LogHeader& header);

  std::string log_path_;
  std::string journal_path_;
  std::uint64_t seed_ = 0;
  std::optional<Resume> resume_;
  std::optional<FileLock> lock_;  // of the journal
  // Keep the names for the two, and remove the files if the dive ends before its first tick.
  std::optional<OutputFile> log_file_;
  std::optional<OutputFile> journal_file_;  // of a new dive
  std::optional<JournalWriter> journal_;
  std::optional<LogWriter> log_;
  bool has_journal_ = true;
  bool has_log_ = true;
};

}  // namespace dive::mission
