#include "mission/link/inbox.h"

#include <algorithm>

namespace dive::mission {
namespace {

constexpr std::size_t kMaxRequests = 8;  // authentic ones that wait for a later tick, and others

std::optional<Inbox::Request> take_from(std::deque<Inbox::Request>& requests) {
  if (requests.empty()) return std::nullopt;
  auto next = std::ranges::find_if(requests, [](const Inbox::Request& request) {
    return request.request.command == OperatorCommand::kAbort;
  });
  if (next == requests.end()) next = requests.begin();
  const Inbox::Request taken = *next;
  requests.erase(next);
  return taken;
}

}  // namespace

Inbox::Inbox(link::Bus& bus, Clock& clock, bool lockstep, bool has_range_camera,
             std::optional<std::size_t> image_bytes)
    : clock_(clock), lockstep_(lockstep), has_range_camera_(has_range_camera) {
  listen_to_sensors(bus);
  if (image_bytes) listen_to_cameras(bus, *image_bytes);
  bus.listen<link::Truth>(
      link::channel::kTruth, [this](const link::Truth& truth) { keep(truth); },
      link::kMaxTruthPacket);
  bus.listen<link::SimTick>(link::channel::kSimTick, [this](const link::SimTick& tick) {
    is_asked_again_ = tick_ && tick_->utime == tick.utime;
    if (!tick_ || tick.utime >= tick_->utime) tick_ = tick;
  });
  bus.listen<link::OperatorRequest>(
      link::channel::kRequest,
      [this, &bus](const link::OperatorRequest& request) {
        keep(Request{request, bus.sender().trust, clock_.now()});
      },
      link::Bus::kMaxFixedSize, link::Access::kAnyone);
}

void Inbox::listen_to_sensors(link::Bus& bus) {
  bus.listen<ImuSample>(link::channel::kAhrs,
                        [this](const ImuSample& sample) { keep(imu_, imu_clock_, sample); });
  bus.listen<DepthSample>(link::channel::kDepth, [this](const DepthSample& sample) {
    keep(depth_, depth_clock_, sample);
  });
  bus.listen<HealthSample>(link::channel::kHealth, [this](const HealthSample& sample) {
    keep(health_, health_clock_, sample);
  });
  if (!has_range_camera_) return;
  bus.listen<RangeScan>(
      link::channel::kRange,
      [this](const RangeScan& scan) {
        if (lockstep_ || ahead_) keep(scan_, range_clock_, scan);
      },
      link::kMaxScanPacket);
}

void Inbox::listen_to_cameras(link::Bus& bus, std::size_t image_bytes) {
  cameras_.emplace();
  // Stamps cannot be converted before our time is fixed.
  const auto add = [this](auto sample) {
    if (lockstep_) {
      cameras_->add(std::move(sample), std::nullopt);
    } else if (ahead_) {
      cameras_->add(std::move(sample), clock_.now() + *ahead_);
    }
  };
  bus.listen<ImuSample>(link::channel::kImu, add);
  bus.listen<ImageFrame>(link::channel::kImage, add, link::image_packet_size(image_bytes));
}

std::optional<Utime> Inbox::first_time() const {
  if (lockstep_) return is_whole(-1) ? std::optional(tick_->utime) : std::nullopt;
  if (!imu_ || !depth_) return std::nullopt;
  return std::max({imu_->utime, depth_->utime, Utime{0}});  // a clock may be before its origin
}

bool Inbox::is_whole(Utime last) const {
  const auto has = [](const auto& sample, const std::optional<Utime>& utime) {
    return !utime || (sample && sample->utime == *utime);
  };
  return tick_ && tick_->utime > last && has(imu_, tick_->ahrs) && has(depth_, tick_->depth) &&
         has(health_, tick_->health) && (!has_range_camera_ || has(scan_, tick_->range)) &&
         (!cameras_ || cameras_->has(*tick_)) && truth_ && truth_->utime == tick_->utime;
}

void Inbox::take(StepInputs& inputs) {
  const auto move = [this](auto& from, const std::optional<Utime>& utime, auto& to) {
    if (lockstep_ && !utime) return;
    to = from;
    if (!lockstep_) from.reset();
  };
  const link::SimTick tick = tick_.value_or(link::SimTick{});
  move(imu_, tick.ahrs, inputs.imu);
  move(depth_, tick.depth, inputs.depth);
  move(health_, tick.health, inputs.health);
}

std::optional<RangeScan> Inbox::take_scan() {
  if (lockstep_ && !tick_.value_or(link::SimTick{}).range) return std::nullopt;
  return std::exchange(scan_, std::nullopt);
}

std::optional<link::Truth> Inbox::take_truth() {
  std::optional<link::Truth> truth = truth_;
  if (truth_) truth_->contacts.clear();
  return truth;
}

int Inbox::clock_jumps() const {
  return imu_clock_.jumps() + depth_clock_.jumps() + health_clock_.jumps() + range_clock_.jumps() +
         (cameras_ ? cameras_->clock_jumps() : 0);
}

// A flood of other requests never displaces an abort, and anonymous ones never an authentic one.
void Inbox::keep(const Request& request) {
  auto& requests = request.trust == link::Trust::kAuthentic ? requests_ : anonymous_requests_;
  if (requests.size() < kMaxRequests) {
    requests.push_back(request);
  } else if (request.request.command == OperatorCommand::kAbort) {
    requests.back() = request;
  }
}

std::optional<Inbox::Request> Inbox::take_request() {
  const std::optional<Request> request = take_from(requests_);
  return request ? request : take_from(anonymous_requests_);
}

// In lock-step the same truth arrives more than once.
void Inbox::keep(const link::Truth& truth) {
  if (truth_ && truth_->utime == truth.utime) return;
  std::vector<std::string> contacts;
  if (truth_) contacts = std::move(truth_->contacts);
  contacts.insert(contacts.end(), truth.contacts.begin(), truth.contacts.end());
  truth_ = truth;
  truth_->contacts = std::move(contacts);
}

// Adds the newest sample, converted to our clock where the vehicle's may be set.
template <typename Sample>
void Inbox::keep(std::optional<Sample>& kept, link::SampleClock& sample_clock, Sample sample) {
  if (!lockstep_ && ahead_) {
    sample.utime = sample_clock.ours(sample.utime, clock_.now() + *ahead_);
  }
  if (!kept || sample.utime >= kept->utime) kept = std::move(sample);
}

}  // namespace dive::mission
