#include "estimation/visual_inertial/filter/imu_buffer.h"

#include <algorithm>
#include <cmath>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::Vector3d;

constexpr Utime kMaxStep = 50'000;  // us, of one interval
constexpr Utime kMaxSteps = 100;    // maximum number of intervals between two samples
constexpr Utime kLeap = 5'000'000;  // us

ImuReading reading(const ImuSample& sample) { return {sample.gyro_B, sample.accel_B}; }

ImuReading between(const ImuSample& a, const ImuSample& b, Utime utime) {
  if (b.utime <= a.utime) return reading(a);
  const double t =
      std::clamp(to_seconds(utime - a.utime) / to_seconds(b.utime - a.utime), 0.0, 1.0);
  return {a.gyro_B + t * (b.gyro_B - a.gyro_B), a.accel_B + t * (b.accel_B - a.accel_B)};
}

bool reaches(const Vector3d& value, double limit) {
  return value.cwiseAbs().maxCoeff() >= 0.999 * limit;
}

}  // namespace

ImuCheck ImuBuffer::add(const ImuSample& sample) {
  if (!sample.gyro_B.allFinite() || !sample.accel_B.allFinite()) return ImuCheck::kNotFinite;
  if (!entries_.empty() && sample.utime <= newest().utime) return ImuCheck::kStamp;
  if (!entries_.empty() && sample.utime - newest().utime > kLeap) {
    const bool is_agreed =
        leapt_to_ && sample.utime > *leapt_to_ && sample.utime - *leapt_to_ < kLeap;
    leapt_to_ = sample.utime;
    if (!is_agreed) return ImuCheck::kStamp;
  }
  leapt_to_.reset();
  Entry entry{sample, reaches(sample.gyro_B, options_.gyro_limit),
              reaches(sample.accel_B, options_.accel_limit)};
  entry.sample.gyro_B = sample.gyro_B.cwiseMax(-options_.gyro_limit).cwiseMin(options_.gyro_limit);
  entry.sample.accel_B =
      sample.accel_B.cwiseMax(-options_.accel_limit).cwiseMin(options_.accel_limit);
  const bool goes_on =
      !entries_.empty() && (entries_.back().gyro_saturated || entries_.back().accel_saturated);
  entry.saturated_since = goes_on ? entries_.back().saturated_since : sample.utime;
  const bool is_gap =
      !entries_.empty() && to_seconds(sample.utime - newest().utime) > options_.longest_imu_step_s;
  entries_.push_back(entry);
  if (entries_.size() > kCapacity) entries_.pop_front();
  if (is_gap) return ImuCheck::kGap;
  return entry.gyro_saturated || entry.accel_saturated ? ImuCheck::kSaturated : ImuCheck::kGood;
}

// A constant error e over T seconds has the weight of white noise of density e sqrt(T).
void ImuBuffer::append(const Entry& a, const Entry& b, Utime from, Utime to,
                       std::vector<ImuInterval>& out) const {
  const double span = to_seconds(std::max(b.sample.utime, to) - std::min(a.sample.utime, from));
  const double uncertainty = span > options_.longest_imu_step_s ? std::sqrt(span) : 0.0;
  // The error of a saturated sensor has one sign during the whole saturation.
  const bool is_saturated = b.gyro_saturated || b.accel_saturated;
  const Utime since = is_saturated ? b.saturated_since : a.saturated_since;
  const double saturated = std::sqrt(std::max(span, to_seconds(b.sample.utime - since)));
  const Utime longest = std::max(kMaxStep, (to - from) / kMaxSteps + 1);
  for (Utime begin = from; begin < to;) {
    const Utime end = std::min(begin + longest, to);
    ImuInterval interval;
    interval.begin = between(a.sample, b.sample, begin);
    interval.end = between(a.sample, b.sample, end);
    interval.dt = to_seconds(end - begin);
    interval.gyro = options_.unknown_rate_sigma * uncertainty;
    interval.accel = options_.unknown_accel_sigma * uncertainty;
    if (a.gyro_saturated || b.gyro_saturated) interval.gyro += options_.gyro_limit * saturated;
    if (a.accel_saturated || b.accel_saturated) interval.accel += options_.accel_limit * saturated;
    out.push_back(interval);
    begin = end;
  }
}

void ImuBuffer::intervals(Utime from, Utime to, std::vector<ImuInterval>& out) const {
  DIVE_DEMAND(!entries_.empty());
  out.clear();
  auto next = std::upper_bound(entries_.begin(), entries_.end(), from,
                               [](Utime t, const Entry& e) { return t < e.sample.utime; });
  Utime begin = from;
  for (; begin < to && next != entries_.end(); ++next) {
    const Utime end = std::min(to, next->sample.utime);
    append(next == entries_.begin() ? *next : *std::prev(next), *next, begin, end, out);
    begin = end;
  }
  if (begin < to) append(entries_.back(), entries_.back(), begin, to, out);
}

ImuReading ImuBuffer::at(Utime utime) const {
  DIVE_DEMAND(!entries_.empty());
  const auto next = std::upper_bound(entries_.begin(), entries_.end(), utime,
                                     [](Utime t, const Entry& e) { return t < e.sample.utime; });
  if (next == entries_.end()) return reading(newest());
  if (next == entries_.begin()) return reading(next->sample);
  return between(std::prev(next)->sample, next->sample, utime);
}

std::optional<ImuBuffer::Scatter> ImuBuffer::scatter(double seconds) const {
  if (entries_.empty()) return std::nullopt;
  const Utime since = newest().utime - from_seconds(seconds);
  if (oldest() > since) return std::nullopt;
  const auto first = std::lower_bound(entries_.begin(), entries_.end(), since,
                                      [](const Entry& e, Utime t) { return e.sample.utime < t; });
  const auto count = static_cast<double>(std::distance(first, entries_.end()));
  if (count < 5.0) return std::nullopt;
  Scatter scatter;
  for (auto i = first; i != entries_.end(); ++i) {
    scatter.mean.gyro_B += i->sample.gyro_B / count;
    scatter.mean.accel_B += i->sample.accel_B / count;
  }
  for (auto i = first; i != entries_.end(); ++i) {
    scatter.gyro_sigma += (i->sample.gyro_B - scatter.mean.gyro_B).squaredNorm() / count;
    scatter.accel_sigma += (i->sample.accel_B - scatter.mean.accel_B).squaredNorm() / count;
  }
  scatter.gyro_sigma = std::sqrt(scatter.gyro_sigma);
  scatter.accel_sigma = std::sqrt(scatter.accel_sigma);
  return scatter;
}

void ImuBuffer::forget_before(Utime utime) {
  // Keeps the sample before `utime` for interpolation.
  while (entries_.size() > 1 && entries_[1].sample.utime <= utime) entries_.pop_front();
}

}  // namespace dive::estimation
