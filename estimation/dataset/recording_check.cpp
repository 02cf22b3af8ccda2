#include "estimation/dataset/recording_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "estimation/dataset/camera_check.h"
#include "estimation/dataset/sample_times.h"

namespace dive::estimation {
namespace {

constexpr double kMinImuRate_hz = 50.0;           // of the visual-inertial estimator
constexpr double kMinPrimitiveImuRate_hz = 10.0;  // of the primitive one
constexpr double kGoodImuRate_hz = 100.0;         // below it, motion between samples is lost
constexpr double kMaxImuRate_hz = 20'000.0;       // no IMU is faster
constexpr double kImageGap_s = 1.0;               // what is reported; in periods if they are long
constexpr double kImageGapPeriods = 3.0;
constexpr double kClockJump_s = 3600.0;  // too long to dead-reckon
constexpr double kRateTolerance = 0.2;   // of the rate that sensor.yaml states
constexpr double kMaxEndGap_s = 0.1;     // of images without IMU samples

struct Interval {
  Utime begin = 0;
  Utime end = 0;
};

template <typename Sample>
Interval interval_of(const std::vector<Sample>& samples) {
  return {samples.front().utime, samples.back().utime};
}

bool overlap(const Interval& a, const Interval& b) { return a.begin <= b.end && b.begin <= a.end; }

std::string to_string(const Interval& interval) {
  return fmt::format("from {:.3f} s to {:.3f} s", to_seconds(interval.begin),
                     to_seconds(interval.end));
}

template <typename Sample>
void clear(std::vector<Sample>& samples, SampleOrigin& origin) {
  samples.clear();
  origin.lines.clear();
}

// The checks of one recording, in the order of its sensors.
class RecordingCheck {
 public:
  RecordingCheck(Recording& recording, const RunOptions& options)
      : recording_(recording),
        visual_(options.estimator == EstimatorKind::kVisualInertial),
        options_(options) {}

  void run() {
    if (!has_data()) return;
    check_times();
    check_image_gaps();
    check_imu_rate();
    if (visual_) {
      check_saturation();
      check_cameras(recording_, options_.mono ? 1 : 2);
    }
    check_depth();
    check_velocity();
    check_truth();
  }

 private:
  void add(Diagnostic diagnostic) { recording_.diagnostics.add(std::move(diagnostic)); }

  [[nodiscard]] Interval images() const { return interval_of(recording_.cameras[0].images); }

  // Everything else needs samples and images.
  bool has_data() {
    if (recording_.imu.empty()) {
      add(recording_.imu_origin.of_all(Severity::kError, "NO-IMU", "there are no IMU samples", ""));
    }
    const std::size_t used = visual_ && !options_.mono ? recording_.cameras.size() : 1;
    for (std::size_t i = 0; i < used; ++i) {
      const RecordedCamera& camera = recording_.cameras[i];
      if (!camera.images.empty()) continue;
      add(camera.images_origin.of_all(Severity::kError, "NO-IMAGES",
                                      fmt::format("camera {} has no images", i), ""));
    }
    return recording_.diagnostics.ok();
  }

  void check_image_gaps() {
    const auto& list = recording_.cameras[0].images;
    const double limit_s = std::max(kImageGap_s, kImageGapPeriods * median_step(list));
    std::size_t gaps = 0;
    std::size_t longest = 0;
    double longest_s = 0.0;
    for (std::size_t i = 1; i < list.size(); ++i) {
      const double step_s = to_seconds(list[i].utime - list[i - 1].utime);
      if (step_s <= limit_s) continue;
      ++gaps;
      if (step_s > longest_s) longest = i;
      longest_s = std::max(longest_s, step_s);
    }
    if (gaps == 0) return;
    const bool is_jump = longest_s > kClockJump_s;
    add(recording_.cameras[0].images_origin.at(
        longest, is_jump && !visual_ ? Severity::kError : Severity::kWarning, "IMAGE-GAP",
        fmt::format("{} gap(s) without images; the longest, of {:.3f} s, ends here", gaps,
                    longest_s),
        is_jump ? "if a clock was set, give the recording in two parts" : ""));
  }

  void check_times() {
    const Interval imu = interval_of(recording_.imu);
    const SampleOrigin& origin = recording_.cameras[0].images_origin;
    if (!overlap(imu, images())) {
      add(origin.of_all(
          Severity::kError, "NO-OVERLAP",
          fmt::format("its images are {}, the IMU's samples ({}) {}: at no time "
                      "are there both",
                      to_string(images()), recording_.imu_origin.file, to_string(imu)),
          "stamp all sensors by one clock, in nanoseconds"));
      return;
    }
    const Utime gap = from_seconds(kMaxEndGap_s);
    const auto& list = recording_.cameras[0].images;
    const auto is_outside = [&](const RecordedImage& image) {
      return image.utime < imu.begin - gap || image.utime > imu.end + gap;
    };
    const auto outside = std::count_if(list.begin(), list.end(), is_outside);
    if (outside == 0) return;
    const auto first = std::find_if(list.begin(), list.end(), is_outside) - list.begin();
    add(origin.at(static_cast<std::size_t>(first), Severity::kWarning, "NO-IMU",
                  fmt::format("{} of {} images are at times without IMU samples, which are {}",
                              outside, list.size(), to_string(imu)),
                  ""));
  }

  void check_imu_rate() {
    const double step = median_step(recording_.imu);
    if (step <= 0.0) return;
    const double rate_hz = 1.0 / step;
    const double min_hz = visual_ ? kMinImuRate_hz : kMinPrimitiveImuRate_hz;
    const SampleOrigin& origin = recording_.imu_origin;
    if (rate_hz < min_hz) {
      add(origin.of_all(
          Severity::kError, "IMU-RATE",
          fmt::format("the IMU was recorded at {:.3g} Hz; the {} estimator needs at "
                      "least {:g} Hz, and {:g} Hz for its accuracy",
                      rate_hz, visual_ ? "visual-inertial" : "primitive", min_hz, kGoodImuRate_hz),
          "record every sample of the IMU"));
      return;
    }
    if (rate_hz > kMaxImuRate_hz) {
      add(origin.of_all(
          Severity::kError, "IMU-RATE",
          fmt::format("the IMU was recorded at {:.3g} Hz, faster than any IMU: are its "
                      "stamps in nanoseconds?",
                      rate_hz),
          "stamp all sensors in nanoseconds"));
      return;
    }
    if (const double stated_hz = recording_.imu_rate_hz;
        stated_hz > 0.0 && std::abs(rate_hz - stated_hz) > kRateTolerance * stated_hz) {
      add(origin.of_all(
          Severity::kWarning, "IMU-RATE",
          fmt::format("the IMU was recorded at {:.3g} Hz; its calibration states {:g} Hz", rate_hz,
                      stated_hz),
          ""));
    } else if (visual_ && rate_hz < 0.95 * kGoodImuRate_hz) {
      add(origin.of_all(Severity::kWarning, "IMU-RATE",
                        fmt::format("the IMU was recorded at {:.3g} Hz; below {:g} Hz the estimate "
                                    "gets worse with every fast motion",
                                    rate_hz, kGoodImuRate_hz),
                        ""));
    }
    check_gaps();
  }

  void check_gaps() {
    const ImuSummary imu = summary_of(recording_);
    if (imu.gaps == 0) return;
    add(recording_.imu_origin.at(
        imu.first_gap, Severity::kWarning, "IMU-GAP",
        fmt::format("{} gap(s) without IMU samples, the longest of {:.3f} s; the first ends here",
                    imu.gaps, imu.longest_gap_s),
        ""));
  }

  void check_saturation() {
    const ImuSummary imu = summary_of(recording_);
    if (imu.saturated == 0) return;
    const RecordedImuNoise& limits = recording_.imu_noise;
    const ImuSample& first = recording_.imu[imu.first_saturated];
    add(recording_.imu_origin.at(
        imu.first_saturated, Severity::kWarning, "IMU-SATURATED",
        fmt::format("{} sample(s) at or beyond {:g} rad/s or {:g} m/s^2 are taken as saturated; "
                    "the first: {:.3g} rad/s, {:.3g} m/s^2",
                    imu.saturated, limits.gyro_range, limits.accel_range,
                    first.gyro_B.cwiseAbs().maxCoeff(), first.accel_B.cwiseAbs().maxCoeff()),
        "give angular rates in rad/s and specific forces in m/s^2"));
  }

  void check_depth() {
    if (!visual_ && !options_.use_depth) {
      add(of_recording(Severity::kError, "the primitive estimator needs the depth", ""));
    }
    if (!options_.use_depth) return;
    if (recording_.depth.empty()) {
      add(visual_ ? of_recording(Severity::kWarning,
                                 "the recording has no depth: nothing bounds the height's error",
                                 "without a depth sensor, say so: --no-depth")
                  : of_recording(Severity::kError,
                                 "the recording has no depth, which the primitive estimator needs",
                                 ""));
      return;
    }
    const Interval depth = interval_of(recording_.depth);
    if (overlap(depth, images())) return;
    add(recording_.depth_origin.of_all(
        visual_ ? Severity::kWarning : Severity::kError, "NO-OVERLAP",
        fmt::format("its samples are {}, the images {}: the depth is not used", to_string(depth),
                    to_string(images())),
        ""));
    clear(recording_.depth, recording_.depth_origin);
  }

  void check_velocity() {
    if (recording_.velocity.empty()) return;
    const Interval velocity = interval_of(recording_.velocity);
    if (overlap(velocity, images())) return;
    add(recording_.velocity_origin.of_all(
        Severity::kWarning, "NO-OVERLAP",
        fmt::format("its samples are {}, the images {}: the velocity is not used",
                    to_string(velocity), to_string(images())),
        ""));
    clear(recording_.velocity, recording_.velocity_origin);
  }

  [[nodiscard]] Diagnostic of_recording(Severity severity, std::string message,
                                        std::string hint) const {
    SampleOrigin whole;
    whole.file = recording_.source;
    return whole.of_all(severity, "NO-DEPTH", std::move(message), std::move(hint));
  }

  void check_truth() {
    if (recording_.truth.empty()) return;
    const Interval truth = interval_of(recording_.truth);
    if (overlap(truth, images())) return;
    add(recording_.truth_origin.of_all(
        options_.start == RunStart::kTruth ? Severity::kError : Severity::kWarning, "NO-OVERLAP",
        fmt::format("its poses are {}, the images {}: there is no truth to compare with",
                    to_string(truth), to_string(images())),
        ""));
    clear(recording_.truth, recording_.truth_origin);
    recording_.has_true_attitude = false;
  }

  Recording& recording_;
  bool visual_;
  const RunOptions& options_;
};

}  // namespace

ImuSummary summary_of(const Recording& recording) {
  const std::vector<ImuSample>& imu = recording.imu;
  const RecordedImuNoise& limits = recording.imu_noise;
  const double longest_step_s = VisualInertialOptions{}.longest_imu_step_s;
  ImuSummary summary;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    if (imu[i].gyro_B.cwiseAbs().maxCoeff() >= limits.gyro_range ||
        imu[i].accel_B.cwiseAbs().maxCoeff() >= limits.accel_range) {
      if (summary.saturated++ == 0) summary.first_saturated = i;
    }
    const double step = i == 0 ? 0.0 : to_seconds(imu[i].utime - imu[i - 1].utime);
    if (step <= longest_step_s) continue;
    if (summary.gaps++ == 0) summary.first_gap = i;
    summary.longest_gap_s = std::max(summary.longest_gap_s, step);
  }
  return summary;
}

void check_recording(Recording& recording, const RunOptions& options) {
  RecordingCheck(recording, options).run();
}

}  // namespace dive::estimation
