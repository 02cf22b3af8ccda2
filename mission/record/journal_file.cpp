#include "mission/record/journal_file.h"

#include <cstring>
#include <string_view>
#include <utility>

namespace dive::mission {
namespace {

constexpr auto kBetweenAttempts = std::chrono::seconds(1);

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

using Breadcrumb = behaviors::Trail::Breadcrumb;
constexpr std::size_t kBreadcrumbBytes = 3 * sizeof(double) + 1;

void put(const Breadcrumb& breadcrumb, std::uint8_t* to) {
  std::memcpy(to, breadcrumb.p_W.data(), 3 * sizeof(double));
  to[3 * sizeof(double)] = breadcrumb.open_above ? 1 : 0;
}

Breadcrumb breadcrumb_from(std::span<const std::uint8_t> bytes) {
  Breadcrumb breadcrumb{};
  std::memcpy(breadcrumb.p_W.data(), bytes.data(), 3 * sizeof(double));
  breadcrumb.open_above = bytes[3 * sizeof(double)] != 0;
  return breadcrumb;
}

// The first generation is in the first bank.
std::uint64_t offset_of(std::int64_t generation) {
  return generation % 2 == 1 ? 0 : kJournalBankBytes;
}

}  // namespace

std::array<std::uint8_t, 26> breadcrumb_bytes(const Breadcrumb& breadcrumb) {
  std::array<std::uint8_t, 1 + kBreadcrumbBytes> bytes{};
  bytes[0] = static_cast<std::uint8_t>(JournalEntry::kBreadcrumb);
  put(breadcrumb, bytes.data() + 1);
  return bytes;
}

std::vector<std::uint8_t> trail_bytes(const behaviors::Trail& trail) {
  const std::vector<Breadcrumb>& breadcrumbs = trail.breadcrumbs();
  const double spacing = trail.spacing();
  std::vector<std::uint8_t> bytes(1 + sizeof(double) + kBreadcrumbBytes * breadcrumbs.size());
  bytes[0] = static_cast<std::uint8_t>(JournalEntry::kTrail);
  std::memcpy(bytes.data() + 1, &spacing, sizeof(double));
  std::uint8_t* to = bytes.data() + 1 + sizeof(double);
  for (const Breadcrumb& breadcrumb : breadcrumbs) {
    put(breadcrumb, to);
    to += kBreadcrumbBytes;
  }
  return bytes;
}

JournalFile::JournalFile(JournalOptions options, JournalState state, std::int64_t generation)
    : options_(std::move(options)), state_(std::move(state)), bank_(generation) {}

tl::expected<void, int> JournalFile::open() {
  if (file_) return {};
  auto opened = options_.open();
  if (!opened) return tl::unexpected(opened.error());
  file_ = std::move(*opened);
  return {};
}

// The snapshot comes first: a file with anything in it can be read.
tl::expected<void, int> JournalFile::begin() {
  if (const auto opened = open(); !opened) return opened;
  bank_ = BankText(1);
  const std::string text = bank_.snapshot(state_);
  std::vector<std::uint8_t> zeros(kJournalBytes - text.size());
  if (auto written = file_->write_at(0, bytes_of(text)); !written) return written;
  if (auto written = file_->write_at(text.size(), zeros); !written) return written;
  used_ = text.size();
  needs_snapshot_ = false;
  lines_ = bank_.lines();
  return file_->sync();
}

void JournalFile::take(std::span<const std::uint8_t> entry) {
  ++entries_;
  const auto kind = static_cast<JournalEntry>(entry[0]);
  const std::span<const std::uint8_t> content = entry.subspan(1);
  bool is_written = false;
  if (kind == JournalEntry::kBreadcrumb) {
    const Breadcrumb breadcrumb = breadcrumb_from(content);
    state_.trail.add(breadcrumb.p_W, breadcrumb.open_above);
    is_written = !needs_snapshot_ && append(bank_.breadcrumb(breadcrumb));
  } else if (kind == JournalEntry::kTrail) {
    take_trail(content);
  } else {
    state_.checkpoint.assign(content.begin(), content.end());
    ++state_.commits;
    is_written = !needs_snapshot_ && append(bank_.commit(state_.checkpoint));
  }
  is_written = is_written || write_snapshot();
  if (!is_written) ++lost_;
  is_whole_ = is_written;
  if (is_written && kind == JournalEntry::kCommitAndSync && file_->sync()) synced_ = entries_;
}

// The bank cannot change what it has: a snapshot follows.
void JournalFile::take_trail(std::span<const std::uint8_t> content) {
  double spacing = 0.0;
  std::memcpy(&spacing, content.data(), sizeof(double));
  std::vector<Breadcrumb> breadcrumbs;
  for (auto rest = content.subspan(sizeof(double)); !rest.empty();
       rest = rest.subspan(kBreadcrumbBytes)) {
    breadcrumbs.push_back(breadcrumb_from(rest));
  }
  state_.trail.restore(breadcrumbs, spacing);
}

bool JournalFile::append(const std::string& line) {
  if (used_ + line.size() > kJournalBankBytes) return false;
  if (!file_->write_at(offset_of(bank_.generation()) + used_, bytes_of(line))) {
    needs_snapshot_ = true;
    return false;
  }
  used_ += line.size();
  ++lines_;
  if (options_.on_lines) options_.on_lines(lines_);
  return true;
}

// In the other bank: the present one stays readable until the snapshot is whole, and on the disk
// before it is overwritten in its turn. The line that did not fit is part of the snapshot's state.
bool JournalFile::write_snapshot() {
  const auto now = std::chrono::steady_clock::now();
  if (needs_snapshot_ && now < next_attempt_) return false;
  needs_snapshot_ = true;
  next_attempt_ = now + kBetweenAttempts;
  if (!open()) return false;
  BankText next(bank_.generation() + 1);
  const std::string text = next.snapshot(state_);
  if (text.size() > kJournalBankBytes ||
      !file_->write_at(offset_of(next.generation()), bytes_of(text)) || !file_->sync()) {
    return false;
  }
  bank_ = next;
  used_ = text.size();
  lines_ += bank_.lines();
  needs_snapshot_ = false;
  if (options_.on_lines) options_.on_lines(lines_);
  return true;
}

}  // namespace dive::mission
