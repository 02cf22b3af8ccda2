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
  /// Opens both; with `--resume` continues from the journal. Prints an error and returns nothing if
  /// they cannot be opened.
  [[nodiscard]] static std::optional<Recording> open(const RunArguments& arguments,
                                                     const LoadedMission& loaded);

  /// Seed of the dive: the journal's if it is resumed.
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] const std::optional<Resume>& resume() const { return resume_; }
  [[nodiscard]] const std::string& log_path() const { return log_path_; }

  void keep(const Executive& executive, const StepOutputs& outputs);
  void write(const StepInputs& inputs, const StepOutputs& outputs,
             const std::optional<TruthRecord>& truth);
  /// Prints an error if anything was lost; returns false if it was part of the log.
  [[nodiscard]] bool close();

 private:
  std::string log_path_;
  std::string journal_path_;
  std::uint64_t seed_ = 0;
  std::optional<Resume> resume_;
  std::optional<JournalWriter> journal_;
  std::optional<LogWriter> log_;
  bool has_journal_ = true;
  bool has_log_ = true;
};

}  // namespace dive::mission
