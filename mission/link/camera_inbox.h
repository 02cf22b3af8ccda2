#pragma once
// Orders the messages of a vehicle with visual-inertial estimation: IMU samples in sequence, images
// in pairs. Bounded for any input.
//
// Cameras and IMU must share one clock, because the filter depends on their relative timing: the
// IMU's stamps reveal a clock that was set.

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "mission/onboard/vehicle_port.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/sample_clock.h"

namespace dive::mission {

/// Counts of the messages.
struct CameraInboxStats {
  std::int64_t pairs = 0;     ///< Image pairs delivered.
  std::int64_t unpaired = 0;  ///< Left images delivered without a right image.
  /// Images late, duplicate, without a left image, or too many.
  std::int64_t images_dropped = 0;
  std::int64_t imu_samples = 0;          ///< IMU samples delivered.
  std::int64_t imu_samples_dropped = 0;  ///< IMU samples late, duplicate, or too many.
};

class CameraInbox {
 public:
  /// Maximum difference of the stamps in a pair, us.
  static constexpr Utime kTogether = 1000;
  /// Time for which a left image waits for its right one, us.
  static constexpr Utime kPatience = 60'000;
  static constexpr std::size_t kMaxImages = 2;        ///< Maximum of waiting images per camera.
  static constexpr std::size_t kMaxImuSamples = 256;  ///< Maximum of waiting IMU samples.

  /// `arrived`: arrival time on our clock, to which stamps are converted; absent in lock-step,
  /// where stamps are already on our clock.
  void add(ImuSample sample, std::optional<Utime> arrived);
  /// Ignores cameras other than the front pair.
  void add(ImageFrame frame, std::optional<Utime> arrived);

  /// IMU samples, oldest first, each once.
  [[nodiscard]] std::vector<ImuSample> take_inertial();
  /// The oldest left image with its right image, or alone if the right one will not arrive.
  [[nodiscard]] StereoPair take_pair(Utime now);

  /// In lock-step: true if everything of that tick has arrived.
  [[nodiscard]] bool has(const link::SimTick& tick) const;
  /// The images of that tick.
  [[nodiscard]] StereoPair take_pair(const link::SimTick& tick);

  [[nodiscard]] const CameraInboxStats& stats() const { return stats_; }
  /// Number of clock jumps.
  [[nodiscard]] int clock_jumps() const { return clock_.jumps(); }

 private:
  struct Image {
    Utime utime = 0;
    Utime arrived = 0;
    ImageFrame frame;
  };

  void drop_images(std::deque<Image>& row, Utime until);

  link::SampleClock clock_;
  std::deque<ImuSample> inertial_;           ///< Ordered by stamp.
  std::array<std::deque<Image>, 2> images_;  ///< Ordered by stamp, per camera.
  /// Stamp of the last IMU sample delivered.
  Utime last_inertial_ = std::numeric_limits<Utime>::min();
  /// Stamp of the last left image delivered.
  Utime last_left_ = std::numeric_limits<Utime>::min();
  CameraInboxStats stats_;
};

}  // namespace dive::mission
