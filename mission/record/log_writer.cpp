#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <lcm/eventlog.h>

#include "common/assert.h"
#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_frame.h"

namespace dive::mission {

struct LogWriter::Impl {
  struct Destroy {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };

  /// Encodes and writes one event at `timestamp`; does nothing after a failure.
  template <typename... Value>
  void put(Channel channel, Utime timestamp, const Value&... value) {
    failed = failed || !encode(value..., packet) || !append(channel, timestamp);
  }

  bool append(Channel channel, Utime timestamp) {
    const std::string_view name = to_string(channel);
    lcm_eventlog_event_t event{};
    event.timestamp = timestamp;
    event.channellen = static_cast<std::int32_t>(name.size());
    event.channel = const_cast<char*>(name.data());  // LCM only reads it
    seal(name, timestamp);
    event.datalen = static_cast<std::int32_t>(packet.size());
    event.data = packet.data();
    ++events;
    return lcm_eventlog_write_event(file.get(), &event) == 0;
  }

  /// Appends the checksum of the next record to the packet.
  void seal(std::string_view name, Utime timestamp) {
    const FrameBytes frame =
        to_bytes({file->eventcount, timestamp, static_cast<std::uint32_t>(name.size()),
                  static_cast<std::uint32_t>(packet.size() + kChecksumSize)});
    const auto checksum = checksum_bytes(record_checksum(frame, name, packet));
    packet.insert(packet.end(), checksum.begin(), checksum.end());
  }

  /// Closes a tick and passes it to the operating system at once: a crash of this process loses no
  /// complete tick.
  void mark(Utime now) {
    if (events > kMaxEventsPerTick) failed = true;
    put(Channel::kTick, now, TickMark{now, events});
    failed = failed || std::fflush(file->f) != 0;
    events = 0;
  }

  std::unique_ptr<lcm_eventlog_t, Destroy> file;
  Packet packet;            // Reused buffer.
  std::int32_t events = 0;  // Events of this tick so far.
  bool failed = false;
};

LogWriter::LogWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LogWriter::LogWriter(LogWriter&&) noexcept = default;
LogWriter& LogWriter::operator=(LogWriter&&) noexcept = default;
LogWriter::~LogWriter() = default;

tl::expected<LogWriter, std::string> LogWriter::create(const std::string& path,
                                                       const LogHeader& header) {
  auto impl = std::make_unique<Impl>();
  if (!encode(header, impl->packet)) {
    return tl::unexpected(fmt::format(
        "cannot create '{}': mission, map or vehicle is too large or not a text", path));
  }
  errno = 0;
  impl->file.reset(lcm_eventlog_create(path.c_str(), "w"));
  const bool written =
      impl->file != nullptr && impl->append(Channel::kHeader, 0) && std::fflush(impl->file->f) == 0;
  if (!written) {
    const std::string reason = std::generic_category().message(errno);
    return tl::unexpected(fmt::format("cannot create '{}': {}", path, reason));
  }
  impl->events = 0;
  return LogWriter(std::move(impl));
}

bool LogWriter::write(const StepInputs& inputs, const StepOutputs& outputs,
                      const std::optional<TruthRecord>& truth) {
  DIVE_DEMAND(impl_ != nullptr);
  Impl& log = *impl_;
  if (log.failed) return false;
  const auto& [now, imu, depth, health, plan, operator_command, obstacles, observed_map, free_ahead,
               pose_correction, vision] = inputs;
  static_cast<void>(observed_map);  // replay makes it from the obstacles
  const auto& [command, rates, estimate, status, plan_query, transitions, failsafes, actions] =
      outputs;
  if (imu) log.put(Channel::kAhrs, now, *imu);
  if (depth) log.put(Channel::kDepth, now, *depth);
  if (health) log.put(Channel::kHealth, now, *health);
  if (plan) log.put(Channel::kPlan, now, now, *plan);
  if (operator_command) log.put(Channel::kOperator, now, now, *operator_command);
  for (const auto& update : obstacles) log.put(Channel::kObstacles, now, now, update);
  if (free_ahead) log.put(Channel::kFreeAhead, now, now, *free_ahead);
  if (pose_correction) log.put(Channel::kPoseCorrection, now, now, *pose_correction);
  if (vision) log.put(Channel::kVision, now, now, *vision);
  log.put(Channel::kCommand, now, now, command);
  log.put(Channel::kRates, now, now, rates);
  log.put(Channel::kEstimate, now, estimate);
  log.put(Channel::kStatus, now, now, status);
  if (plan_query) log.put(Channel::kPlanQuery, now, now, *plan_query);
  for (const TransitionRecord& t : transitions) log.put(Channel::kTransition, now, now, t);
  for (const FailsafeRecord& f : failsafes) log.put(Channel::kFailsafe, now, now, f);
  for (const ActionRecord& a : actions) log.put(Channel::kAction, now, now, a);
  if (truth) log.put(Channel::kTruth, now, *truth);
  log.mark(now);
  return !log.failed;
}

bool LogWriter::close() {
  DIVE_DEMAND(impl_ != nullptr);
  const bool whole = !impl_->failed && std::fflush(impl_->file->f) == 0;
  impl_->failed = true;
  impl_->file.reset();
  return whole;
}

}  // namespace dive::mission
