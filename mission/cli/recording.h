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
#include "mission/simulation/simulated_dive.h"

namespace dive::mission {

/// The ground truth of one tick for the log.
[[nodiscard]] TruthRecord truth_record(const vehicle::GroundTruth& truth,
                                       const TickContacts& contacts);

/// Log and journal of a dive.
class DiveRecording {
 public:
  /// Opens both; with `--resume` continues from the journal. A log that is not named, and every log
  /// of a dive that is resumed, gets the next free number. Prints an error and returns the exit
  /// status if they cannot be opened.
  [[nodiscard]] static tl::expected<DiveRecording, int> open(const RunArguments& arguments,
                                                             const LoadedMission& loaded);

  /// Seed of the dive: the journal's if it is resumed.
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] const std::optional<Resume>& resume() const { return resume_; }
  [[nodiscard]] const std::string& log_path() const { return log_path_; }

  void keep(const Executive& executive, const StepOutputs& outputs);
  void write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  [[nodiscard]] bool has_journaled_commands() const { return journal_->has_commands(); }
  /// Ticks and commits that were lost; its payload commands are those of the link.
  [[nodiscard]] RecordingLoss loss() const {
    return {log_ ? log_->lost() : 0, journal_->lost(), 0};
  }
  /// Prints an error if anything was lost, which does not change the result of the dive.
  void close();

 private:
  /// Prints an error and returns false if the log cannot be written.
  [[nodiscard]] bool open_log(const LogHeader& header, const RunArguments& arguments);

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
};

}  // namespace dive::mission
