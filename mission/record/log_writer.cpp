#include <chrono>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/record/log.h"
#include "mission/record/log_channels.h"
#include "mission/record/log_codec.h"
#include "mission/record/log_file.h"
#include "mission/record/log_frame.h"

namespace dive::mission {

namespace {

constexpr std::size_t kQueueThatWaits = 1U << 20U;   // bytes
constexpr std::size_t kQueueThatDrops = 32U << 20U;  // bytes: holds the largest tick
constexpr auto kMaxWait = std::chrono::seconds(5);   // for the disk, twice

std::string name_of(int error) { return std::generic_category().message(error); }

}  // namespace

struct LogWriter::Impl {
  Impl(std::shared_ptr<LogFile> file_in, WhenFull when_full)
      : file(std::move(file_in)),
        output(when_full == WhenFull::kDrop ? kQueueThatDrops : kQueueThatWaits, when_full,
               [file = file](std::span<const std::uint8_t> block) { file->append(block); }) {}

  /// Encodes one event of the tick at `timestamp`.
  template <typename... Value>
  void put(Channel channel, Utime timestamp, const Value&... value) {
    is_whole = is_whole && encode(value..., packet);
    if (is_whole) append_record({number, timestamp, 0, 0}, to_string(channel), packet, tick);
    ++number;
    ++events;
  }

  std::shared_ptr<LogFile> file;  // Belongs to the output's thread.
  BackgroundOutput output;
  Packet packet;                   // Reused buffer.
  std::vector<std::uint8_t> tick;  // Reused buffer: the records of this tick.
  std::int64_t number = 1;         // Number of the next event, after the header's.
  std::int32_t events = 0;         // Events of this tick so far.
  bool is_whole = true;            // All events of this tick could be encoded.
  bool is_closed = false;
  std::int64_t lost = 0;  // Ticks that never reached the queue.
  /// First event of the ticks lost at the end, if they are.
  std::optional<std::pair<std::int64_t, Utime>> lost_since;
};

LogWriter::LogWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LogWriter::LogWriter(LogWriter&&) noexcept = default;
LogWriter& LogWriter::operator=(LogWriter&&) noexcept = default;
LogWriter::~LogWriter() = default;

tl::expected<LogWriter, std::string> LogWriter::create(const std::string& path,
                                                       const LogHeader& header,
                                                       LogOptions options) {
  Packet packet;
  if (!encode(header, packet)) {
    return tl::unexpected(fmt::format(
        "cannot create '{}': mission, map or vehicle is too large or not a text", path));
  }
  std::vector<std::uint8_t> record;
  append_record({}, to_string(Channel::kHeader), packet, record);
  OpenRecordFile open = std::move(options.open);
  if (!open) open = [path] { return create_record_file(path); };
  auto file = std::make_shared<LogFile>(std::move(open), std::move(record));
  const tl::expected<void, int> begun = file->begin();
  if (!begun && !options.is_optional) {
    return tl::unexpected(fmt::format("cannot create '{}': {}", path, name_of(begun.error())));
  }
  return LogWriter(std::make_unique<Impl>(std::move(file), options.when_full));
}

bool LogWriter::write(const StepInputs& inputs, const StepOutputs& outputs,
                      const std::optional<TruthRecord>& truth) {
  DIVE_DEMAND(impl_ != nullptr);
  Impl& log = *impl_;
  if (log.is_closed) return false;
  const std::int64_t first = log.number;
  log.tick.clear();
  log.events = 0;
  log.is_whole = true;
  const auto& [now, imu, depth, health, plan, operator_command, obstacles, observed_map, free_ahead,
               obstacle_ahead, pose_correction, map_correction, map_fix, vision, loss] = inputs;
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
  if (obstacle_ahead) log.put(Channel::kObstacleAhead, now, now, *obstacle_ahead);
  if (pose_correction) log.put(Channel::kPoseCorrection, now, now, *pose_correction);
  if (map_correction) log.put(Channel::kMapCorrection, now, now, *map_correction);
  if (map_fix) log.put(Channel::kMapFix, now, now, *map_fix);
  if (vision) log.put(Channel::kVision, now, now, *vision);
  if (loss) log.put(Channel::kLoss, now, now, *loss);
  log.put(Channel::kCommand, now, now, command);
  log.put(Channel::kRates, now, now, rates);
  log.put(Channel::kEstimate, now, estimate);
  log.put(Channel::kStatus, now, now, status);
  if (plan_query) log.put(Channel::kPlanQuery, now, now, *plan_query);
  for (const TransitionRecord& t : transitions) log.put(Channel::kTransition, now, now, t);
  for (const FailsafeRecord& f : failsafes) log.put(Channel::kFailsafe, now, now, f);
  for (const ActionRecord& a : actions) log.put(Channel::kAction, now, now, a);
  if (truth) log.put(Channel::kTruth, now, *truth);
  log.is_whole = log.is_whole && log.events <= kMaxEventsPerTick;
  log.put(Channel::kTick, now, TickMark{now, log.events});
  const bool is_queued = log.is_whole && log.output.push(log.tick);
  if (is_queued) {
    log.lost_since.reset();
  } else {
    ++log.lost;
    if (!log.lost_since) log.lost_since = {first, now};
  }
  return is_queued;
}

std::int64_t LogWriter::lost() const { return impl_->lost + impl_->file->lost(); }

std::string LogWriter::disk_error() const {
  const int error = impl_->file->error();
  return error == 0 ? std::string() : name_of(error);
}

bool LogWriter::close() {
  DIVE_DEMAND(impl_ != nullptr);
  Impl& log = *impl_;
  if (log.is_closed) return false;
  log.is_closed = true;
  if (log.lost_since) {
    static_cast<void>(log.output.drain(kMaxWait));  // a full queue has no room for the mark
    log.output.push(loss_mark(log.lost_since->first, log.lost_since->second));
  }
  return log.output.close(kMaxWait) && lost() == 0;
}

}  // namespace dive::mission
