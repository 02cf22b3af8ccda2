#include "mission/record/journal.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "common/assert.h"
#include "common/fnv.h"
#include "common/source_text.h"

namespace dive::mission {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxBytes = 256U << 20U;
constexpr std::size_t kChecksumSize = 16;
constexpr double kPeriod = 0.2;  // s between commits of the position
constexpr int kVersion = 2;

std::string checksum(std::string_view text) {
  Fnv1a64 digest;
  digest.add(text);
  return fmt::format("{:016x}", digest.value());
}

json to_json(const Checkpoint& c) {
  json history = json::object();
  for (const auto& [id, states] : c.history) history[id] = states;
  json result = {{"utime", c.utime},
                 {"elapsed", c.elapsed_s},
                 {"active", c.active},
                 {"active_for", c.active_s},
                 {"history", std::move(history)},
                 {"once", c.done_once},
                 {"p", {c.X_WB.p.x(), c.X_WB.p.y(), c.X_WB.p.z()}},
                 {"q", {c.X_WB.q.x(), c.X_WB.q.y(), c.X_WB.q.z(), c.X_WB.q.w()}},
                 {"v", {c.v_W.x(), c.v_W.y(), c.v_W.z()}},
                 {"sigma", c.sigma_m},
                 {"open_water_battery", c.open_water_battery},
                 {"goals_done", c.goals_done},
                 {"rung", behaviors::to_string(c.rung)},
                 {"rung_cause", std::string(behaviors::to_string(c.rung_cause))},
                 {"abort_cause", c.abort_cause},
                 {"paused", c.paused},
                 {"queries", c.queries}};
  if (c.open_water_elapsed_s) result["open_water_elapsed"] = *c.open_water_elapsed_s;
  return result;
}

/// Throws nlohmann's exceptions if a value is missing or has another type.
Checkpoint checkpoint_from(const json& j) {
  Checkpoint c;
  j.at("utime").get_to(c.utime);
  j.at("elapsed").get_to(c.elapsed_s);
  j.at("active").get_to(c.active);
  j.at("active_for").get_to(c.active_s);
  j.at("history").get_to(c.history);
  j.at("once").get_to(c.done_once);
  const json& p = j.at("p");
  const json& q = j.at("q");
  const json& v = j.at("v");
  c.X_WB.p = {p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>()};
  c.X_WB.q = {q.at(3).get<double>(), q.at(0).get<double>(), q.at(1).get<double>(),
              q.at(2).get<double>()};
  c.v_W = {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
  j.at("sigma").get_to(c.sigma_m);
  j.at("open_water_battery").get_to(c.open_water_battery);
  j.at("goals_done").get_to(c.goals_done);
  const std::string rung = j.at("rung").get<std::string>();
  c.rung = behaviors::find_rung(rung).value_or(behaviors::Rung::kNone);
  c.rung_cause = behaviors::find_failsafe(j.at("rung_cause").get<std::string>())
                     .value_or(behaviors::FailsafeKind::kInternalError);
  j.at("abort_cause").get_to(c.abort_cause);
  j.at("paused").get_to(c.paused);
  j.at("queries").get_to(c.queries);
  if (j.contains("open_water_elapsed"))
    c.open_water_elapsed_s = j.at("open_water_elapsed").get<double>();
  return c;
}

bool has_payload(const StepOutputs& outputs) {
  return std::ranges::any_of(outputs.actions, [](const ActionRecord& action) {
    return action.kind == ActionRecord::Kind::kPayload;
  });
}

std::string line_of(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return checksum(text) + " " + text + "\n";
}

/// The JSON of a line without its line break; empty if the line is torn or damaged.
std::optional<json> parse_line(std::string_view line) {
  if (line.size() < kChecksumSize + 2 || line[kChecksumSize] != ' ') return std::nullopt;
  const std::string_view text = line.substr(kChecksumSize + 1);
  if (checksum(text) != line.substr(0, kChecksumSize)) return std::nullopt;
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded()) return std::nullopt;
  return value;
}

/// The readable part of a journal, and its size in bytes.
struct Contents {
  Journal journal;
  std::size_t whole = 0;
};

tl::expected<Contents, std::string> parse_contents(const std::string& text) {
  Contents contents;
  Journal& journal = contents.journal;
  bool has_header = false;
  while (contents.whole < text.size()) {
    const std::size_t end = text.find('\n', contents.whole);
    if (end == std::string::npos) break;
    const auto value =
        parse_line(std::string_view(text).substr(contents.whole, end - contents.whole));
    if (!value) break;
    try {
      if (!has_header) {
        if (value->at("dive_journal").get<int>() != kVersion) break;
        value->at("digest").get_to(journal.header.digest);
        value->at("seed").get_to(journal.header.seed);
        has_header = true;
      } else if (value->contains("breadcrumb")) {
        const json& c = value->at("breadcrumb");
        journal.trail.push_back(
            {{c.at(0).get<double>(), c.at(1).get<double>(), c.at(2).get<double>()},
             c.at(3).get<bool>()});
      } else {
        journal.checkpoint = checkpoint_from(*value);
        ++journal.commits;
      }
    } catch (const json::exception&) {
      break;  // from another version or program
    }
    contents.whole = end + 1;
  }
  if (!has_header) return tl::unexpected(std::string("this is not a journal of dive's"));
  journal.torn = contents.whole < text.size();
  return contents;
}

tl::expected<Contents, std::string> read_contents(const std::string& path, std::string* text) {
  tl::expected<SourceText, std::string> file = read_source_text(path, kMaxBytes);
  if (!file) return tl::unexpected(fmt::format("cannot read '{}': {}", path, file.error()));
  tl::expected<Contents, std::string> contents = parse_contents(file->content());
  if (!contents) return tl::unexpected(fmt::format("'{}': {}", path, contents.error()));
  if (text != nullptr) *text = file->content().substr(0, contents->whole);
  return contents;
}

}  // namespace

struct JournalWriter::Impl {
  explicit Impl(int file) : descriptor(file) {}
  ~Impl() { ::close(descriptor); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void put(const json& value) {
    const std::string line = line_of(value);
    for (std::size_t written = 0; written < line.size() && !failed;) {
      const ssize_t n = ::write(descriptor, line.data() + written, line.size() - written);
      if (n < 0 && errno == EINTR) continue;
      failed = n <= 0;
      if (!failed) written += static_cast<std::size_t>(n);
    }
    ++lines;
    if (told != nullptr) told(lines);
  }

  int descriptor;
  bool failed = false;
  std::int64_t lines = 0;
  std::int64_t commits = 0;
  std::size_t breadcrumbs = 0;
  Utime last_commit = 0;
  bool started = false;
  std::string goal;
  void (*told)(std::int64_t) = nullptr;
};

JournalWriter::JournalWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
JournalWriter::JournalWriter(JournalWriter&&) noexcept = default;
JournalWriter& JournalWriter::operator=(JournalWriter&&) noexcept = default;
JournalWriter::~JournalWriter() = default;

tl::expected<JournalWriter, std::string> JournalWriter::create(const std::string& path,
                                                               const JournalHeader& header) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) {
    return tl::unexpected(
        fmt::format("cannot create '{}': {}", path, std::generic_category().message(errno)));
  }
  auto impl = std::make_unique<Impl>(file);
  impl->put({{"dive_journal", kVersion}, {"digest", header.digest}, {"seed", header.seed}});
  if (impl->failed) return tl::unexpected(fmt::format("cannot write '{}'", path));
  return JournalWriter(std::move(impl));
}

tl::expected<JournalWriter, std::string> JournalWriter::append(const std::string& path) {
  const tl::expected<Contents, std::string> contents = read_contents(path, nullptr);
  if (!contents) return tl::unexpected(contents.error());
  const int file = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file < 0 || ::ftruncate(file, static_cast<off_t>(contents->whole)) != 0) {
    const std::string reason = std::generic_category().message(errno);
    if (file >= 0) ::close(file);
    return tl::unexpected(fmt::format("cannot go on with '{}': {}", path, reason));
  }
  auto impl = std::make_unique<Impl>(file);
  impl->commits = contents->journal.commits;
  impl->breadcrumbs = contents->journal.trail.size();
  return JournalWriter(std::move(impl));
}

bool JournalWriter::keep(const Executive& executive, const StepOutputs& outputs) {
  Impl& journal = *impl_;
  const behaviors::Trail& trail = executive.trail();
  if (trail.dropped() > journal.breadcrumbs) {  // at most one per step
    journal.breadcrumbs = trail.dropped();
    const auto& [p_W, open_above] = trail.newest();
    journal.put({{"breadcrumb", {p_W.x(), p_W.y(), p_W.z(), open_above}}});
  }
  const Utime now = outputs.estimate.utime;
  const bool changed = !outputs.transitions.empty() || !outputs.failsafes.empty() ||
                       !outputs.actions.empty() || outputs.status.goal != journal.goal;
  const bool due = journal.started && to_seconds(now - journal.last_commit) >= kPeriod;
  if (!outputs.status.finished && (changed || due)) {
    journal.started = true;
    journal.last_commit = now;
    journal.goal = outputs.status.goal;
    ++journal.commits;
    journal.put(to_json(executive.checkpoint()));
    // The system preserves a line when the process dies, but not when the machine loses power. A
    // vehicle that restarts after a power loss was away for too long to continue, and only must not
    // repeat its actions. Waiting for the disk may take tens of milliseconds.
    if (has_payload(outputs)) ::fdatasync(journal.descriptor);
  }
  return !journal.failed;
}

std::int64_t JournalWriter::commits() const { return impl_->commits; }
void JournalWriter::on_line(void (*told)(std::int64_t)) { impl_->told = told; }

tl::expected<Journal, std::string> read_journal(const std::string& path, std::string* text) {
  tl::expected<Contents, std::string> contents = read_contents(path, text);
  if (!contents) return tl::unexpected(contents.error());
  return std::move(contents->journal);
}

tl::expected<Journal, std::string> parse_journal(const std::string& text) {
  tl::expected<Contents, std::string> contents = parse_contents(text);
  if (!contents) return tl::unexpected(contents.error());
  return std::move(contents->journal);
}

}  // namespace dive::mission
