#include "mission/cli/recording.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/record/log_digest.h"

namespace dive::mission {
namespace {

std::string default_log_path(const Mission& mission, std::uint64_t seed) {
  return fmt::format("dive-runs/{}-seed{}.lcmlog", mission.id, seed);
}

/// Names of a dive's log and journal.
struct Names {
  std::string log;
  std::string journal;
  bool is_log_numbered = false;  ///< The log gets the next free number.
};

std::string journal_of(const std::string& log) { return log + ".journal"; }

/// The journal of a new dive stands beside its log; a dive that is resumed continues the one named,
/// or that of the log named, or the newest one of those that were not named.
Names names_of(const RunArguments& arguments, const Mission& mission) {
  Names names{arguments.log, arguments.journal, arguments.resume};
  if (names.log.empty()) {
    names.log = default_log_path(mission, arguments.seed);
    names.is_log_numbered = true;
    if (arguments.resume && names.journal.empty()) {
      const int newest = newest_numbered(names.log, ".journal");
      names.journal = journal_of(numbered(names.log, std::max(newest, 1)));
    }
  }
  if (arguments.resume && names.journal.empty()) names.journal = journal_of(names.log);
  return names;
}

/// On a vehicle nothing may delay the control loop; a simulation loses nothing.
WhenFull when_full(const RunArguments& arguments) {
  const bool is_real_time = !arguments.link.url.empty() && !arguments.link.lockstep;
  return is_real_time ? WhenFull::kDrop : WhenFull::kWait;
}

JournalOptions journal_options(const RunArguments& arguments) {
  JournalOptions options;
  options.when_full = when_full(arguments);
  return options;
}

/// A dive that is resumed goes on without a log if the disk has no room for one.
tl::expected<std::optional<OutputFile>, int> create_log(const Names& names,
                                                        const RunArguments& arguments) {
  create_folder_of(names.log);
  tl::expected<OutputFile, OutputError> file =
      names.is_log_numbered ? OutputFile::create_numbered(names.log)
                            : OutputFile::create(names.log, existing(arguments.force));
  if (file) return std::optional<OutputFile>(std::move(*file));
  const int status = report(file.error());
  if (arguments.resume && file.error().kind == OutputError::Kind::kNotKept) return std::nullopt;
  return tl::unexpected(status);
}

/// Locks the journal against other processes. Prints an error and returns false if another one has
/// it. A disk that has no room for the lock does not stop a dive.
bool lock_journal(const std::string& path, std::optional<FileLock>& lock) {
  tl::expected<FileLock, OutputError> acquired = FileLock::acquire(path);
  if (acquired) {
    lock.emplace(std::move(*acquired));
    return true;
  }
  if (acquired.error().kind == OutputError::Kind::kLocked) {
    complain(fmt::format("{}: another dive is writing this journal", path));
    return false;
  }
  note(fmt::format("dive: the journal is not locked: {}", acquired.error().message));
  return true;
}

/// The journal of a new dive. An empty file is no journal: a process that ended before it wrote any
/// leaves one.
tl::expected<JournalWriter, int> create_journal(const std::string& path,
                                                const RunArguments& arguments,
                                                const JournalHeader& header,
                                                std::optional<OutputFile>& name) {
  std::error_code ignored;
  const bool is_empty = std::filesystem::is_regular_file(path, ignored) &&
                        std::filesystem::file_size(path, ignored) == 0;
  tl::expected<OutputFile, OutputError> file =
      OutputFile::create(path, existing(arguments.force || is_empty));
  if (!file) return tl::unexpected(report(file.error()));
  tl::expected<JournalWriter, std::string> writer =
      JournalWriter::create(path, header, journal_options(arguments));
  if (!writer) {
    complain(writer.error());
    return tl::unexpected<int>(kExitInternal);
  }
  name.emplace(std::move(*file));
  return std::move(*writer);
}

/// Continues a journal, with the state to continue from in `from` and its seed in the header;
/// prints an error and returns the exit status if that is impossible.
tl::expected<JournalWriter, int> continue_journal(const std::string& path,
                                                  const RunArguments& arguments, LogHeader& header,
                                                  std::optional<Resume>& from) {
  const auto refuse = [&](const std::string& why) {
    complain(why);
    return tl::unexpected<int>(kExitUsage);
  };
  const tl::expected<Journal, std::string> journal = read_journal(path);
  if (!journal) return refuse(journal.error());
  if (journal->header.digest != log_digest(header)) {
    return refuse(
        fmt::format("'{}': a dive of another mission, map or vehicle wrote this journal: give the "
                    "mission, map and vehicle of that dive, or move the journal away to begin a "
                    "new dive",
                    path));
  }
  header.seed = journal->header.seed;
  header.resume = to_text(*journal);
  if (journal->checkpoint) {
    from =
        Resume{*journal->checkpoint, journal->trail, journal->trail_spacing_m, header.resume_gap_s};
  }
  return JournalWriter::append(path, *journal, journal_options(arguments));
}

}  // namespace

TruthRecord truth_record(const vehicle::GroundTruth& truth, const TickContacts& contacts) {
  return {truth.utime, truth.X_WB, obstacles_of(contacts.begun), contacts.nearest.clearance_m,
          contacts.nearest.obstacle};
}

tl::expected<DiveRecording, int> DiveRecording::open(const RunArguments& arguments,
                                                     const LoadedMission& loaded) {
  LogHeader header = header_of(loaded, arguments.seed);
  // The built-in simulator starts at the estimated pose, with its own clock.
  if (arguments.resume && arguments.link.url.empty()) header.resume_gap_s = 0.0;
  const Names names = names_of(arguments, loaded.mission);
  DiveRecording recording;
  tl::expected<std::optional<OutputFile>, int> log = create_log(names, arguments);
  if (!log) return tl::unexpected(log.error());
  recording.log_path_ = *log ? (*log)->path() : names.log;
  recording.journal_path_ = names.journal.empty() ? journal_of(recording.log_path_) : names.journal;
  if (*log) recording.log_file_.emplace(std::move(**log));

  if (!arguments.resume) create_folder_of(recording.journal_path_);
  if (!lock_journal(recording.journal_path_, recording.lock_)) {
    return tl::unexpected<int>(kExitUsage);
  }
  tl::expected<JournalWriter, int> journal =
      arguments.resume
          ? continue_journal(recording.journal_path_, arguments, header, recording.resume_)
          : create_journal(recording.journal_path_, arguments,
                           JournalHeader{log_digest(header), header.seed}, recording.journal_file_);
  if (!journal) return tl::unexpected(journal.error());
  recording.journal_ = std::move(*journal);

  recording.seed_ = header.seed;
  if (recording.log_file_ && !recording.open_log(header, arguments)) {
    return tl::unexpected<int>(kExitInternal);
  }
  return recording;
}

bool DiveRecording::open_log(const LogHeader& header, const RunArguments& arguments) {
  LogOptions options;
  options.when_full = when_full(arguments);
  options.is_optional = arguments.resume;
  tl::expected<LogWriter, std::string> writer = LogWriter::create(log_path_, header, options);
  if (!writer) {
    complain(fmt::format("{}: {}", log_path_, writer.error()));
    return false;
  }
  if (const std::string error = writer->disk_error(); !error.empty()) {
    note(fmt::format("dive: {}: {}: the dive goes on, and its log is lost until it can be written",
                     log_path_, error));
  }
  log_ = std::move(*writer);
  return true;
}

void DiveRecording::keep(const Executive& executive, const StepOutputs& outputs) {
  journal_->keep(executive, outputs);
}

void DiveRecording::write(const StepInputs& inputs, const StepOutputs& outputs,
                          const std::optional<TruthRecord>& truth) {
  if (log_file_) log_file_->keep();
  if (journal_file_) journal_file_->keep();
  if (log_) log_->write(inputs, outputs, truth);
}

void DiveRecording::close() {
  if (!journal_->close()) {
    complain(fmt::format("{}: the journal is not complete (disk full?)", journal_path_));
  }
  if (!log_) {
    complain(fmt::format("{}: there is no log of this dive", log_path_));
    return;
  }
  if (log_->close()) return;
  const std::string error = log_->disk_error();
  complain(fmt::format("{}: the log is not complete: {} ticks are lost ({})", log_path_,
                       log_->lost(), error.empty() ? "the disk was too slow" : error));
}

}  // namespace dive::mission
