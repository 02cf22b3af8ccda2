#pragma once
// The last seconds of the IMU, checked, and delivered as intervals between readings.

#include <deque>
#include <optional>
#include <vector>

#include "common/measurements.h"
#include "estimation/visual_inertial/filter/imu_propagation.h"

namespace dive::estimation {

enum class ImuCheck { kGood, kSaturated, kGap, kNotFinite, kStamp };

class ImuBuffer {
 public:
  /// Number of stored samples; older ones are dropped.
  static constexpr std::size_t kCapacity = 4096;

  explicit ImuBuffer(const VisualInertialOptions& options) : options_(options) {}

  /// Rejects samples that are not finite or not newer than the last one; keeps saturated ones and
  /// those after a gap, with extra uncertainty. A stamp 5 s ahead is accepted only if the next one
  /// agrees with it.
  ImuCheck add(const ImuSample& sample);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] Utime oldest() const { return entries_.front().sample.utime; }
  [[nodiscard]] const ImuSample& newest() const { return entries_.back().sample; }

  /// Covers `from` to `to` without a hole, in steps of at most 50 ms (100 for a longer gap). Before
  /// the first and after the last sample the nearest one is used; beyond a usual step its
  /// uncertainty is that of a gap.
  void intervals(Utime from, Utime to, std::vector<ImuInterval>& out) const;
  /// The interpolated reading.
  [[nodiscard]] ImuReading at(Utime utime) const;

  struct Scatter {
    ImuReading mean;
    double gyro_sigma = 0.0;   ///< rad/s, of all axes together
    double accel_sigma = 0.0;  ///< m/s^2
  };
  /// Scatter of the last `seconds`; empty if there is less than that, or fewer than five samples.
  [[nodiscard]] std::optional<Scatter> scatter(double seconds) const;

  void forget_before(Utime utime);

 private:
  struct Entry {
    ImuSample sample;
    bool gyro_saturated = false;
    bool accel_saturated = false;
    Utime saturated_since = 0;  ///< Start of the present saturation, if any.
  };
  void append(const Entry& a, const Entry& b, Utime from, Utime to,
              std::vector<ImuInterval>& out) const;

  VisualInertialOptions options_;
  std::deque<Entry> entries_;
  std::optional<Utime> leapt_to_;  ///< A stamp far ahead, not accepted yet.
};

}  // namespace dive::estimation
