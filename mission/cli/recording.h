#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "mission/cli/commands.h"
#include "mission/cli/loading.h"
#include "mission/record/journal.h"
#include "mission/record/log.h"

namespace dive::mission {

/// Log and journal of a dive.
class Recording {
 public:
  /// Opens both; with `--resume` continues from the journal, and goes on with a note if log or
  /// journal cannot be written. Prints an error and returns nothing if they cannot be opened.
  [[nodiscard]] static std::optional<Recording> open(const RunArguments& arguments,
                                                     const LoadedMission& loaded);

  /// Seed of the dive: the journal's if it is resumed.
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] const std::optional<Resume>& resume() const { return resume_; }
  [[nodiscard]] const std::string& log_path() const { return log_path_; }

  void keep(const Executive& executive, const StepOutputs& outputs);
  void write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  [[nodiscard]] bool has_journaled_commands() const { return journal_->has_commands(); }
  /// Without payload commands, which are not of the recording.
  [[nodiscard]] RecordingLoss loss() const { return {log_->lost(), journal_->lost(), 0}; }
  /// Prints an error if anything was lost.
  void close();

 private:
  std::string log_path_;
  std::string journal_path_;
  std::uint64_t seed_ = 0;
  std::optional<Resume> resume_;
  std::optional<JournalWriter> journal_;
  std::optional<LogWriter> log_;
};

}  // namespace dive::mission
