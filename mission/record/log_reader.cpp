#include <bitset>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_digest.h"
#include "mission/record/log_events.h"

namespace dive::mission {
namespace {

/// Puts one event after the other into a tick; in the order of Channel, or not at all.
class TickBuilder {
 public:
  bool add(const LogEvent& event) {
    const auto channel = static_cast<std::size_t>(event.channel);
    const bool repeats = event.channel == Channel::kTransition ||
                         event.channel == Channel::kFailsafe || event.channel == Channel::kAction;
    const bool in_order = count_ == 0 || (event.timestamp == tick_.inputs.now &&
                                          (channel > last_ || (channel == last_ && repeats)));
    if (!in_order || ++count_ > kMaxEventsPerTick) return false;
    tick_.inputs.now = event.timestamp;
    last_ = channel;
    seen_.set(channel);
    return decode_into_tick(event);
  }

  /// Does `mark`, of that timestamp, close a whole tick?
  [[nodiscard]] bool closes(const TickMark& mark, Utime timestamp, std::uint64_t digest) const {
    for (const Channel always :
         {Channel::kCommand, Channel::kRates, Channel::kEstimate, Channel::kStatus}) {
      if (!seen_.test(static_cast<std::size_t>(always))) return false;
    }
    return mark.utime == timestamp && timestamp == tick_.inputs.now && mark.events == count_ &&
           mark.digest == digest;
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] LoggedTick take() { return std::move(tick_); }

 private:
  bool decode_into_tick(const LogEvent& event) {
    StepInputs& in = tick_.inputs;
    StepOutputs& out = tick_.outputs;
    switch (event.channel) {
      case Channel::kImu:
        return decode(event.data, in.imu.emplace());
      case Channel::kDepth:
        return decode(event.data, in.depth.emplace());
      case Channel::kHealth:
        return decode(event.data, in.health.emplace());
      case Channel::kPlan:
        return decode(event.data, in.plan.emplace());
      case Channel::kOperator:
        return decode(event.data, in.operator_command.emplace());
      case Channel::kMap:
        return decode(event.data, in.seen);
      case Channel::kSurroundings:
        return decode(event.data, in.map_update.emplace());
      case Channel::kVision:
        return decode(event.data, in.vision.emplace());
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
  int count_ = 0;
};

}  // namespace

struct LogReader::Impl {
  explicit Impl(LogEventFile event_file) : file(std::move(event_file)) {}

  /// The next event; its number must be the next one.
  LogEventFile::Read read() {
    const LogEventFile::Read got = file.next(event);
    if (got != LogEventFile::Read::kEvent) return got;
    return event.number == next_number++ ? got : LogEventFile::Read::kDamaged;
  }
  void count_in() {
    digest.add(to_string(event.channel));
    digest.add(event.data);
  }

  LogEventFile file;
  LogHeader header;
  LogEvent event;  // Reused.
  Fnv1a64 digest;
  std::int64_t next_number = 0;
  std::int64_t events_read = 0;
  bool ended = false;
  bool torn = false;
};

LogReader::LogReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LogReader::LogReader(LogReader&&) noexcept = default;
LogReader::~LogReader() = default;

tl::expected<LogReader, std::string> LogReader::open(const std::string& path) {
  auto file = LogEventFile::open(path);
  if (!file) return tl::unexpected(file.error());
  auto impl = std::make_unique<Impl>(std::move(*file));
  if (impl->read() != LogEventFile::Read::kEvent) {
    return tl::unexpected(fmt::format("'{}' is not a dive log", path));
  }
  if (impl->event.channel != Channel::kHeader) {
    return tl::unexpected(fmt::format("'{}' does not begin with a dive's header", path));
  }
  if (impl->event.timestamp != 0 || !decode(impl->event.data, impl->header) ||
      impl->header.digest != log_digest(impl->header)) {
    return tl::unexpected(
        fmt::format("the header of '{}' is damaged or of another version of dive", path));
  }
  impl->count_in();
  impl->events_read = 1;
  return LogReader(std::move(impl));
}

std::optional<LoggedTick> LogReader::next() {
  Impl& log = *impl_;
  TickBuilder tick;
  while (!log.ended && !log.torn) {
    switch (log.read()) {
      case LogEventFile::Read::kEnd:
        log.ended = true;
        log.torn = tick.count() > 0;
        break;
      case LogEventFile::Read::kDamaged:
        log.torn = true;
        break;
      case LogEventFile::Read::kEvent:
        if (log.event.channel != Channel::kTick) {
          log.torn = !tick.add(log.event);
          log.count_in();
          break;
        }
        if (TickMark mark; decode(log.event.data, mark) &&
                           tick.closes(mark, log.event.timestamp, log.digest.value())) {
          log.count_in();
          log.events_read += tick.count() + 1;
          return tick.take();
        }
        log.torn = true;
        break;
    }
  }
  return std::nullopt;
}

const LogHeader& LogReader::header() const { return impl_->header; }
bool LogReader::torn() const { return impl_->torn; }
std::int64_t LogReader::events_read() const { return impl_->events_read; }

}  // namespace dive::mission
