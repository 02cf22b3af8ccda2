#pragma once
// The last seconds of the IMU, checked, and handed on as intervals between readings.

#include <deque>
#include <optional>
#include <vector>

#include "common/measurements.h"
#include "estimation/visual_inertial/imu_propagation.h"

namespace dive::estimation {

enum class ImuVerdict { kGood, kSaturated, kGap, kNotFinite, kStamp };

class ImuBuffer {
 public:
  /// Of what it keeps; older samples are forgotten.
  static constexpr std::size_t kCapacity = 4096;

  explicit ImuBuffer(const VisualInertialOptions& options) : options_(options) {}

  /// What is not finite, and what is not newer than the last one, is left out; what is saturated
  /// or comes after a gap is kept, with the doubt it deserves. A stamp 5 s ahead is believed only
  /// when the next one agrees with it.
  ImuVerdict add(const ImuSample& sample);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] Utime oldest() const { return entries_.front().sample.utime; }
  [[nodiscard]] const ImuSample& newest() const { return entries_.back().sample; }

  /// Covers `from` to `to` without a hole, in steps of at most 50 ms (100 for a longer gap). Before
  /// the first and after the last sample the nearest one holds; what is held longer than a usual
  /// step is doubted as a gap is.
  void intervals(Utime from, Utime to, std::vector<ImuInterval>& out) const;
  /// Interpolated.
  [[nodiscard]] ImuReading at(Utime utime) const;

  struct Scatter {
    ImuReading mean;
    double gyro_sigma = 0.0;   ///< rad/s, of all axes together
    double accel_sigma = 0.0;  ///< m/s^2
  };
  /// Of the last `seconds`; nothing while less than that, or fewer than five samples, is there.
  [[nodiscard]] std::optional<Scatter> scatter(double seconds) const;

  void forget_before(Utime utime);

 private:
  struct Entry {
    ImuSample sample;
    bool gyro_saturated = false;
    bool accel_saturated = false;
    Utime saturated_since = 0;  ///< When that began, if one is.
  };
  void append(const Entry& a, const Entry& b, Utime from, Utime to,
              std::vector<ImuInterval>& out) const;

  VisualInertialOptions options_;
  std::deque<Entry> entries_;
  std::optional<Utime> leapt_to_;  ///< A stamp far ahead, not believed yet.
};

}  // namespace dive::estimation
