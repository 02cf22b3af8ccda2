#pragma once
// Messages received from the vehicle and topside since the last tick. Sensor stamps are converted
// to the executive's clock; all buffers are bounded.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/range_scan.h"
#include "mission/executive/io.h"
#include "mission/link/camera_inbox.h"
#include "vehicle/link/bus.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/sample_clock.h"

namespace dive::mission {

class Inbox {
 public:
  /// Range scans are ignored unless `has_range_camera`, images and raw IMU samples without
  /// `image_bytes`: the size of the largest image.
  Inbox(link::Bus& bus, Clock& clock, bool lockstep, bool has_range_camera,
        std::optional<std::size_t> image_bytes);
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;

  struct Request {
    link::OperatorRequest request;
    link::Trust trust = link::Trust::kAnonymous;
    Utime arrived = 0;
  };

  /// Vehicle time of the newest sample; empty before attitude and depth have arrived.
  [[nodiscard]] std::optional<Utime> first_time() const;

  /// In lock-step: true if a complete tick later than `last` has arrived.
  [[nodiscard]] bool is_whole(Utime last) const;
  /// In lock-step: the current tick of the vehicle.
  [[nodiscard]] Utime tick() const { return tick_ ? tick_->utime : -1; }
  /// In lock-step: true if the vehicle has repeated the same tick since the last call.
  [[nodiscard]] bool is_asked_again() { return std::exchange(is_asked_again_, false); }

  /// Fixes the offset of our clock: `now` is the vehicle's time at our time `local`.
  void set_time(Utime now, Utime local) { ahead_ = now - local; }

  /// Moves the samples of a tick into `inputs`.
  void take(StepInputs& inputs);
  /// The scan of a tick.
  [[nodiscard]] std::optional<RangeScan> take_scan();
  /// With cameras: their images, and the raw IMU samples.
  [[nodiscard]] std::vector<ImuSample> take_imu_samples() { return cameras_->take_inertial(); }
  [[nodiscard]] StereoPair take_images(Utime now) {
    return lockstep_ ? cameras_->take_pair(*tick_) : cameras_->take_pair(now);
  }
  [[nodiscard]] const std::optional<CameraInbox>& cameras() const { return cameras_; }

  /// The next request: authentic ones first, and an abort before all others.
  [[nodiscard]] std::optional<Request> take_request();
  /// The newest message, with all contacts since the last call.
  [[nodiscard]] std::optional<link::Truth> take_truth();
  [[nodiscard]] int clock_jumps() const;

 private:
  void listen_to_sensors(link::Bus& bus);
  void listen_to_cameras(link::Bus& bus, std::size_t image_bytes);
  void keep(const Request& request);
  void keep(const link::Truth& truth);
  template <typename Sample>
  void keep(std::optional<Sample>& kept, link::SampleClock& sample_clock, Sample sample);

  Clock& clock_;
  bool lockstep_;
  bool has_range_camera_;
  std::optional<Utime> ahead_;  ///< Offset of the vehicle's time from our clock, us.
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  std::optional<HealthSample> health_;
  std::optional<RangeScan> scan_;
  std::optional<CameraInbox> cameras_;
  std::optional<link::Truth> truth_;
  std::optional<link::SimTick> tick_;
  bool is_asked_again_ = false;
  link::SampleClock imu_clock_;
  link::SampleClock depth_clock_;
  link::SampleClock health_clock_;
  link::SampleClock range_clock_;
  std::deque<Request> requests_;            ///< Authentic.
  std::deque<Request> anonymous_requests_;  ///< All others.
};

}  // namespace dive::mission
