#pragma once
// The visual-inertial estimator on a worker thread. The estimate for a pair of images is delivered
// a stated time after the exposure, not when the machine is ready, so that a simulated dive is the
// same on every machine.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/range_scan.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"
#include "mission/onboard/delayed_worker.h"
#include "mission/onboard/loop_service.h"

namespace dive::mission {

/// A processed pair of images and its results.
struct StereoPairResult {
  const ImageFrame* left = nullptr;
  const ImageFrame* right = nullptr;  ///< Null if the image is missing.
  /// The filter's estimate at the time of the images; empty if it is not usable.
  std::optional<estimation::StateEstimate> estimate;
  std::span<const estimation::Landmark> landmarks;  ///< Used by the filter, in its frame.
};

/// Converts a pair to the scan of a range sensor at that time, or to nothing. Called on the worker,
/// for one pair at a time.
using RangeMaker = std::function<std::optional<RangeScan>(const StereoPairResult&)>;

class VisionService {
 public:
  /// `bias`: of the IMU, as found before a restart. `latency`: least time from the exposure of a
  /// pair to its estimate, in dive time, us. With `loops` and two cameras, loop closures correct
  /// the estimates. Demands options that validate.
  VisionService(const estimation::VisionOptions& options, std::uint64_t seed, Utime latency,
                OnLate late = OnLate::kBlock, RangeMaker make_range = nullptr,
                const std::optional<LoopSettings>& loops = std::nullopt,
                const std::optional<estimation::ImuBias>& bias = std::nullopt);

  void add(std::span<const ImuSample> samples);
  void add(const DepthSample& sample);
  /// Submits a pair, of which either image may be missing, after the observe() of that tick. It
  /// waits for the IMU samples up to its time, and with OnLate::kPoll for the worker; of the
  /// waiting pairs only the newest is kept.
  void submit(std::optional<ImageFrame> left, std::optional<ImageFrame> right, Utime now);
  /// Records the published estimate of this tick, and starts the waiting pair if that is possible.
  void observe(const estimation::StateEstimate& published);

  /// The next estimate once it is due. Without images there are estimates with that fault.
  [[nodiscard]] std::optional<estimation::VisionEstimate> poll(Utime now);
  /// DelayedWorker::take_failure(), of the estimator or the loop closure.
  [[nodiscard]] std::optional<std::string> take_failure();
  /// Biases of the IMU as of the last estimate: VisionPipeline::imu_bias().
  [[nodiscard]] const std::optional<estimation::ImuBias>& imu_bias() const { return bias_; }
  /// LoopService::align(); ignored without loops.
  void align(const Eigen::Vector2d& by_W);
  /// LoopService::take_map_correction(); empty without loops.
  [[nodiscard]] std::optional<MapCorrection> take_map_correction();
  /// The scan made from the pair of that estimate, once: measured at its frame_utime, in B.
  [[nodiscard]] std::optional<RangeScan> take_scan();

 private:
  struct Pair {
    std::optional<ImageFrame> left;
    std::optional<ImageFrame> right;
    Utime asked = 0;
  };
  struct Answer {
    estimation::VisionEstimate estimate;
    std::optional<RangeScan> scan;
    std::optional<estimation::Keyframe> keyframe = {};  ///< Candidate.
    std::optional<estimation::ImuBias> bias = {};
  };

  [[nodiscard]] bool is_ripe(Utime now) const;
  void launch(Utime asked, std::optional<Pair> pair);
  [[nodiscard]] Answer work(estimation::VisionInput input);
  [[nodiscard]] Answer process(estimation::VisionInput input);

  std::function<estimation::VisionPipeline()> make_pipeline_;
  estimation::VisionPipeline pipeline_;  ///< The worker's while it is busy.
  double period_s_;
  Utime latency_;
  RangeMaker make_range_;
  std::optional<LoopService> loops_;
  // Not given to the worker yet:
  std::vector<ImuSample> imu_;
  std::vector<DepthSample> depth_;
  Utime newest_imu_ = 0;
  estimation::StateEstimate published_;
  std::optional<Pair> next_;  ///< Waiting pair.
  Utime launched_ = 0;
  std::optional<RangeScan> scan_;
  std::optional<estimation::ImuBias> bias_;
  DelayedWorker<Answer> worker_;
};

}  // namespace dive::mission
