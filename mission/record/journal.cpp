#include "mission/record/journal.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "common/source_text.h"
#include "mission/record/journal_bank.h"
#include "mission/record/journal_file.h"

namespace dive::mission {
namespace {

constexpr double kPeriod = 0.2;                      // s between commits of the position
constexpr std::size_t kQueueThatWaits = 64U << 10U;  // bytes
constexpr std::size_t kQueueThatDrops = 4U << 20U;   // bytes: some minutes

JournalState state_of(const Journal& journal) {
  JournalState state{.header = journal.header, .commits = journal.commits};
  if (journal.checkpoint) state.checkpoint = to_json_text(*journal.checkpoint);
  state.trail.restore(journal.trail, journal.trail_spacing_m);
  return state;
}

JournalOptions with_open(JournalOptions options, const std::string& path, auto open) {
  if (!options.open) options.open = [path, open] { return open(path); };
  return options;
}

}  // namespace

struct JournalWriter::Impl {
  Impl(std::shared_ptr<JournalFile> file_in, WhenFull when_full_in)
      : file(std::move(file_in)),
        when_full(when_full_in),
        output(when_full == WhenFull::kDrop ? kQueueThatDrops : kQueueThatWaits, when_full,
               [file = file](std::span<const std::uint8_t> block) { file->take(block); }) {}

  void push(std::span<const std::uint8_t> bytes) {
    is_queued = output.push(bytes);
    if (!is_queued) ++lost;
  }

  void commit(const Executive& executive, bool has_payload) {
    // The system preserves a line when the process dies, but not when the machine loses power. A
    // vehicle that restarts after a power loss was away for too long to continue, and only must
    // not repeat its actions.
    awaits_sync = awaits_sync || has_payload;
    entry.assign(
        1, static_cast<char>(awaits_sync ? JournalEntry::kCommitAndSync : JournalEntry::kCommit));
    entry += to_json_text(executive.checkpoint());
    push({reinterpret_cast<const std::uint8_t*>(entry.data()), entry.size()});
    if (!has_payload) return;
    payload_entry = output.pushed() + (is_queued ? 0 : 1);
    if (when_full == WhenFull::kWait) static_cast<void>(output.drain(std::chrono::hours(1)));
  }

  std::shared_ptr<JournalFile> file;  // Belongs to the output's thread.
  WhenFull when_full;
  BackgroundOutput output;
  std::string entry;      // Reused buffer.
  std::int64_t lost = 0;  // Entries that never reached the queue.
  bool is_queued = true;  // The last entry.
  std::size_t breadcrumbs = 0;
  std::size_t moves = 0;
  Utime last_commit = 0;
  bool started = false;
  bool awaits_sync = false;         // A payload command's commit is not on the disk yet.
  std::uint64_t payload_entry = 0;  // Its entry: this or a later one must reach the disk.
  std::string goal;
};

JournalWriter::JournalWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
JournalWriter::JournalWriter(JournalWriter&&) noexcept = default;
JournalWriter& JournalWriter::operator=(JournalWriter&&) noexcept = default;
JournalWriter::~JournalWriter() = default;

tl::expected<JournalWriter, std::string> JournalWriter::create(const std::string& path,
                                                               const JournalHeader& header,
                                                               JournalOptions options) {
  const WhenFull when_full = options.when_full;
  auto file = std::make_shared<JournalFile>(with_open(std::move(options), path, create_record_file),
                                            JournalState{.header = header}, 1);
  if (const auto begun = file->begin(); !begun) {
    return tl::unexpected(fmt::format("cannot create '{}' ({} MiB): {}", path, kJournalBytes >> 20U,
                                      std::generic_category().message(begun.error())));
  }
  return JournalWriter(std::make_unique<Impl>(std::move(file), when_full));
}

JournalWriter JournalWriter::append(const std::string& path, const Journal& journal,
                                    JournalOptions options) {
  const WhenFull when_full = options.when_full;
  auto impl = std::make_unique<Impl>(
      std::make_shared<JournalFile>(with_open(std::move(options), path, open_record_file),
                                    state_of(journal), journal.generation),
      when_full);
  impl->breadcrumbs = journal.trail.size();
  return JournalWriter(std::move(impl));
}

void JournalWriter::keep(const Executive& executive, const StepOutputs& outputs) {
  Impl& journal = *impl_;
  const behaviors::Trail& trail = executive.trail();
  if (trail.moves() != journal.moves) {
    journal.moves = trail.moves();
    journal.breadcrumbs = trail.dropped();
    journal.push(trail_bytes(trail));
  } else if (trail.dropped() > journal.breadcrumbs) {  // at most one per step
    journal.breadcrumbs = trail.dropped();
    journal.push(breadcrumb_bytes(trail.newest()));
  }
  if (journal.awaits_sync && has_commands()) journal.awaits_sync = false;
  const Utime now = outputs.estimate.utime;
  const bool changed = !outputs.transitions.empty() || !outputs.failsafes.empty() ||
                       !outputs.actions.empty() || outputs.status.goal != journal.goal;
  const bool due = journal.started && to_seconds(now - journal.last_commit) >= kPeriod;
  if (outputs.status.finished || (!changed && !due)) return;
  journal.started = true;
  journal.last_commit = now;
  journal.goal = outputs.status.goal;
  journal.commit(executive, std::ranges::any_of(outputs.actions, [](const ActionRecord& action) {
                   return action.kind == ActionRecord::Kind::kPayload;
                 }));
}

bool JournalWriter::has_commands() const { return impl_->file->synced() >= impl_->payload_entry; }
std::int64_t JournalWriter::lost() const { return impl_->lost + impl_->file->lost(); }

bool JournalWriter::close() {
  return impl_->output.close() && impl_->is_queued && impl_->file->is_whole();
}

tl::expected<Journal, std::string> read_journal(const std::string& path) {
  const tl::expected<SourceText, std::string> file = read_source_text(path, kJournalBytes);
  if (!file) return tl::unexpected(fmt::format("cannot read '{}': {}", path, file.error()));
  const std::string_view text = file->content();
  std::optional<Journal> journal = parse_bank(text.substr(0, kJournalBankBytes));
  if (text.size() > kJournalBankBytes) {
    std::optional<Journal> other = parse_bank(text.substr(kJournalBankBytes));
    if (other && (!journal || other->generation > journal->generation)) journal = std::move(other);
  }
  if (!journal) {
    return tl::unexpected(fmt::format("'{}': this is not a journal written by dive", path));
  }
  return std::move(*journal);
}

tl::expected<Journal, std::string> parse_journal(const std::string& text) {
  std::optional<Journal> journal = parse_bank(text);
  if (!journal) return tl::unexpected(std::string("this is not a journal written by dive"));
  return std::move(*journal);
}

std::string to_text(const Journal& journal) { return BankText(1).snapshot(state_of(journal)); }

}  // namespace dive::mission
