#include <bitset>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_events.h"

namespace dive::mission {
namespace {

/// Adds events to a tick one by one; rejects an event out of the order of Channel.
class TickBuilder {
 public:
  bool add(const LogEvent& event) {
    const auto channel = static_cast<std::size_t>(event.channel);
    const bool repeats = event.channel == Channel::kObstacles ||
                         event.channel == Channel::kTransition ||
                         event.channel == Channel::kFailsafe || event.channel == Channel::kAction;
    const bool in_order = count_ == 0 || (event.timestamp == tick_.inputs.now &&
                                          (channel > last_ || (channel == last_ && repeats)));
    if (!in_order || ++count_ > kMaxEventsPerTick) return false;
    tick_.inputs.now = event.timestamp;
    if (count_ == 1) offset_ = event.offset;
    last_ = channel;
    seen_.set(channel);
    return decode_into_tick(event);
  }

  /// True if `event` is a mark that closes a complete tick.
  [[nodiscard]] bool is_closed_by(const LogEvent& event) const {
    TickMark mark;
    if (event.channel != Channel::kTick || !decode(event.data, mark)) return false;
    for (const Channel always :
         {Channel::kCommand, Channel::kRates, Channel::kEstimate, Channel::kStatus}) {
      if (!seen_.test(static_cast<std::size_t>(always))) return false;
    }
    return mark.utime == event.timestamp && event.timestamp == tick_.inputs.now &&
           mark.events == count_;
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  [[nodiscard]] LoggedTick take() { return std::move(tick_); }

 private:
  bool decode_into_tick(const LogEvent& event) {
    StepInputs& in = tick_.inputs;
    StepOutputs& out = tick_.outputs;
    switch (event.channel) {
      case Channel::kAhrs:
        return decode(event.data, in.imu.emplace());
      case Channel::kDepth:
        return decode(event.data, in.depth.emplace());
      case Channel::kHealth:
        return decode(event.data, in.health.emplace());
      case Channel::kPlan:
        return decode(event.data, in.plan.emplace());
      case Channel::kOperator:
        return decode(event.data, in.operator_command.emplace());
      case Channel::kObstacles:
        return decode(event.data, in.obstacles.emplace_back());
      case Channel::kFreeAhead:
        return decode(event.data, in.free_ahead.emplace());
      case Channel::kObstacleAhead:
        return decode(event.data, in.obstacle_ahead.emplace());
      case Channel::kPoseCorrection:
        return decode(event.data, in.pose_correction.emplace());
      case Channel::kMapCorrection:
        return decode(event.data, in.map_correction.emplace());
      case Channel::kMapFix:
        return decode(event.data, in.map_fix.emplace());
      case Channel::kVision:
        return decode(event.data, in.vision.emplace());
      case Channel::kLoss:
        return decode(event.data, in.loss.emplace());
      case Channel::kCommand:
        return decode(event.data, out.command);
      case Channel::kRates:
        return decode(event.data, out.rates);
      case Channel::kEstimate:
        return decode(event.data, out.estimate);
      case Channel::kStatus:
        return decode(event.data, out.status);
      case Channel::kPlanQuery:
        return decode(event.data, out.plan_query.emplace());
      case Channel::kTransition:
        return decode(event.data, out.transitions.emplace_back());
      case Channel::kFailsafe:
        return decode(event.data, out.failsafes.emplace_back());
      case Channel::kAction:
        return decode(event.data, out.actions.emplace_back());
      case Channel::kTruth:
        return decode(event.data, tick_.truth.emplace());
      case Channel::kHeader:
      case Channel::kTick:
        return false;
    }
    return false;
  }

  LoggedTick tick_;
  std::bitset<kChannelNames.size()> seen_;
  std::size_t last_ = 0;
  std::uint64_t offset_ = 0;  // File offset of the tick's first event.
  int count_ = 0;
};

std::string not_a_log(const std::string& path) {
  return fmt::format("{}: not a log written by dive: give a .lcmlog file that dive run wrote",
                     path);
}

std::string other_version(const std::string& path) {
  return fmt::format(
      "{}: this log was written by another version of dive: read it with that version", path);
}

}  // namespace

struct LogReader::Impl {
  explicit Impl(LogEventFile event_file) : file(std::move(event_file)) {}

  /// Adds `event`; true if it closes a complete tick.
  bool add_event() {
    if (event.channel != Channel::kTick && tick.add(event)) return false;
    if (tick.is_closed_by(event)) return true;
    skip_from(event.offset);
    return false;
  }

  /// The data at `offset` are unusable, and so is the tick that contains them.
  void skip_from(std::uint64_t offset) {
    if (!in_gap) gaps.push_back({last_tick, std::nullopt, offset, file.size() - offset});
    in_gap = true;
    tick = {};
  }

  LoggedTick take_tick() {
    LoggedTick whole = tick.take();
    last_tick = whole.inputs.now;
    events_read += tick.count() + 1;
    if (in_gap) {
      gaps.back().to = last_tick;
      gaps.back().bytes = tick.offset() - gaps.back().offset;
      in_gap = false;
    }
    if (show) show(static_cast<double>(tick.offset()) / static_cast<double>(file.size()));
    tick = {};
    return whole;
  }

  LogEventFile file;
  std::optional<LogHeader> header;
  LogEvent event;  // Reused buffer.
  TickBuilder tick;
  std::vector<LogGap> gaps;
  Utime last_tick = 0;
  std::int64_t events_read = 0;
  bool in_gap = false;
  bool ended = false;
  bool torn = false;
  std::function<void(double)> show;  ///< May be empty.
};

LogReader::LogReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LogReader::LogReader(LogReader&&) noexcept = default;
LogReader::~LogReader() = default;

tl::expected<LogReader, std::string> LogReader::open(const std::string& path) {
  auto file = LogEventFile::open(path);
  if (!file) return tl::unexpected(file.error());
  auto impl = std::make_unique<Impl>(std::move(*file));
  LogEventFile::Read got = impl->file.next(impl->event);
  if (got == LogEventFile::Read::kTorn) {
    return tl::unexpected(fmt::format("{}: the log ends within its header: it has no tick", path));
  }
  if (got == LogEventFile::Read::kDamaged) {
    impl->skip_from(0);
    got = impl->file.next(impl->event);
  }
  if (got != LogEventFile::Read::kEvent) {
    return tl::unexpected(impl->file.begins_with_own_channel() ? other_version(path)
                                                               : not_a_log(path));
  }
  if (impl->event.channel != Channel::kHeader) {
    impl->skip_from(0);
    impl->add_event();
  } else if (decode(impl->event.data, impl->header.emplace())) {
    impl->events_read = 1;
  } else {
    return tl::unexpected(other_version(path));
  }
  return LogReader(std::move(impl));
}

std::optional<LoggedTick> LogReader::next() {
  Impl& log = *impl_;
  while (!log.ended) {
    switch (log.file.next(log.event)) {
      case LogEventFile::Read::kEvent:
        if (log.add_event()) return log.take_tick();
        break;
      case LogEventFile::Read::kDamaged:
        log.skip_from(log.file.offset());
        break;
      case LogEventFile::Read::kTorn:
        log.ended = log.torn = true;
        break;
      case LogEventFile::Read::kEnd:
        log.ended = true;
        log.torn = log.tick.count() > 0 && !log.in_gap;
        break;
    }
  }
  return std::nullopt;
}

void LogReader::observe(std::function<void(double)> show) { impl_->show = std::move(show); }
const std::optional<LogHeader>& LogReader::header() const { return impl_->header; }
const std::vector<LogGap>& LogReader::gaps() const { return impl_->gaps; }
bool LogReader::torn() const { return impl_->torn; }
std::int64_t LogReader::events_read() const { return impl_->events_read; }

}  // namespace dive::mission
