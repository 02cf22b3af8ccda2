#include "mission/cli/recording.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "mission/cli/terminal.h"
#include "mission/record/log_digest.h"

namespace dive::mission {
namespace {

std::string default_log_path(const Mission& mission, std::uint64_t seed) {
  return fmt::format("dive-runs/{}-seed{}.lcmlog", mission.id, seed);
}

void create_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;  // a problem with the folder is reported when the file is created
  if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
}

/// On a vehicle nothing may delay the control loop; a simulation loses nothing.
WhenFull when_full(const RunArguments& arguments) {
  const bool is_real_time = !arguments.link.url.empty() && !arguments.link.lockstep;
  return is_real_time ? WhenFull::kDrop : WhenFull::kWait;
}

std::optional<LogWriter> open_log(const std::string& path, const LogHeader& header,
                                  const RunArguments& arguments) {
  LogOptions options;
  options.when_full = when_full(arguments);
  options.is_optional = arguments.resume;
  tl::expected<LogWriter, std::string> writer = LogWriter::create(path, header, options);
  if (!writer) {
    complain(fmt::format("{}: {}", path, writer.error()));
    return std::nullopt;
  }
  if (const std::string error = writer->disk_error(); !error.empty()) {
    note(fmt::format("dive: {}: {}: the dive goes on, and its log is lost until it can be written",
                     path, error));
  }
  return std::move(*writer);
}

/// A new journal, or the old one with the state to continue from in `from` and its seed in the
/// header; prints an error and returns nothing if that is impossible.
std::optional<JournalWriter> open_journal(const std::string& path, const RunArguments& arguments,
                                          LogHeader& header, std::optional<Resume>& from) {
  const auto refuse = [&](const std::string& why) {
    complain(why);
    return std::nullopt;
  };
  const JournalHeader ours{log_digest(header), header.seed};
  JournalOptions options;
  options.when_full = when_full(arguments);
  if (!arguments.resume) {
    tl::expected<JournalWriter, std::string> writer =
        JournalWriter::create(path, ours, std::move(options));
    if (!writer) return refuse(writer.error());
    return std::move(*writer);
  }
  const tl::expected<Journal, std::string> journal = read_journal(path);
  if (!journal) return refuse(journal.error());
  if (journal->header.digest != ours.digest) {
    return refuse(fmt::format("'{}' is of another mission, map or vehicle", path));
  }
  header.seed = journal->header.seed;
  header.resume = to_text(*journal);
  if (journal->checkpoint) {
    from =
        Resume{*journal->checkpoint, journal->trail, journal->trail_spacing_m, header.resume_gap_s};
  }
  return JournalWriter::append(path, *journal, std::move(options));
}

}  // namespace

std::optional<Recording> Recording::open(const RunArguments& arguments,
                                         const LoadedMission& loaded) {
  LogHeader header = header_of(loaded, arguments.seed);
  // The built-in simulator starts at the estimated pose, with its own clock.
  if (arguments.resume && arguments.link.url.empty()) header.resume_gap_s = 0.0;
  Recording recording;
  recording.log_path_ =
      arguments.log.empty() ? default_log_path(loaded.mission, arguments.seed) : arguments.log;
  recording.journal_path_ =
      arguments.journal.empty() ? recording.log_path_ + ".journal" : arguments.journal;
  create_folder_of(recording.log_path_);
  recording.journal_ = open_journal(recording.journal_path_, arguments, header, recording.resume_);
  if (!recording.journal_) return std::nullopt;
  recording.log_ = open_log(recording.log_path_, header, arguments);
  if (!recording.log_) return std::nullopt;
  recording.seed_ = header.seed;
  return recording;
}

void Recording::keep(const Executive& executive, const StepOutputs& outputs) {
  journal_->keep(executive, outputs);
}

void Recording::write(const StepInputs& inputs, const StepOutputs& outputs,
                      const std::optional<TruthRecord>& truth) {
  log_->write(inputs, outputs, truth);
}

void Recording::close() {
  if (!journal_->close()) {
    complain(fmt::format("{}: the journal is not complete (disk full?)", journal_path_));
  }
  if (log_->close()) return;
  const std::string error = log_->disk_error();
  complain(fmt::format("{}: the log is not complete: {} ticks are lost ({})", log_path_,
                       log_->lost(), error.empty() ? "the disk was too slow" : error));
}

}  // namespace dive::mission
