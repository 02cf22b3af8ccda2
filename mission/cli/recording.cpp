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

std::optional<LogWriter> open_log(const std::string& path, const LogHeader& header) {
  tl::expected<LogWriter, std::string> writer = LogWriter::create(path, header);
  if (!writer) {
    complain(fmt::format("{}: {}", path, writer.error()));
    return std::nullopt;
  }
  return std::move(*writer);
}

/// A new journal, or the old one with the state to continue from in `from` and its seed in the
/// header; prints an error and returns nothing if that is impossible.
std::optional<JournalWriter> open_journal(const std::string& path, bool resume, LogHeader& header,
                                          std::optional<Resume>& from) {
  const auto refuse = [&](const std::string& why) {
    complain(why);
    return std::nullopt;
  };
  const JournalHeader ours{log_digest(header), header.seed};
  if (!resume) {
    tl::expected<JournalWriter, std::string> writer = JournalWriter::create(path, ours);
    if (!writer) return refuse(writer.error());
    return std::move(*writer);
  }
  tl::expected<Journal, std::string> journal = read_journal(path, &header.resume);
  if (!journal) return refuse(journal.error());
  if (journal->header.digest != ours.digest) {
    return refuse(fmt::format("'{}' is of another mission, map or vehicle", path));
  }
  header.seed = journal->header.seed;
  if (journal->checkpoint) {
    from = Resume{std::move(*journal->checkpoint), std::move(journal->trail), header.resume_gap_s};
  }
  tl::expected<JournalWriter, std::string> writer = JournalWriter::append(path);
  if (!writer) return refuse(writer.error());
  return std::move(*writer);
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
  recording.journal_ =
      open_journal(recording.journal_path_, arguments.resume, header, recording.resume_);
  if (!recording.journal_) return std::nullopt;
  recording.log_ = open_log(recording.log_path_, header);
  if (!recording.log_) return std::nullopt;
  recording.seed_ = header.seed;
  return recording;
}

void Recording::keep(const Executive& executive, const StepOutputs& outputs) {
  has_journal_ = journal_->keep(executive, outputs);
}

void Recording::write(const StepInputs& inputs, const StepOutputs& outputs,
                      const std::optional<TruthRecord>& truth) {
  has_log_ &= log_->write(inputs, outputs, truth);
}

bool Recording::close() {
  has_log_ &= log_->close();
  if (!has_journal_) {
    complain(fmt::format("{}: the journal is not complete (disk full?)", journal_path_));
  }
  if (!has_log_) complain(fmt::format("{}: the log is not complete (disk full?)", log_path_));
  return has_log_;
}

}  // namespace dive::mission
