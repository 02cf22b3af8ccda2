#pragma once
// The visual-inertial estimator off the control thread. A pair of pictures is answered a stated
// time after it was taken, never when the machine happens to be ready, so that a simulated dive is
// the same on every machine.

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

/// What there is when a pair of pictures has been dealt with.
struct SeenPair {
  const ImageFrame* left = nullptr;
  const ImageFrame* right = nullptr;  ///< None where none came.
  const estimation::VisionEstimate* word = nullptr;
  std::span<const estimation::Landmark> landmarks;  ///< That corrected the filter, in its frame.
};

/// Makes of such a pair what a range sensor would have told of that moment, or nothing. Called on
/// the worker, for one pair after the other.
using RangeMaker = std::function<std::optional<RangeScan>(const SeenPair&)>;

class VisionService {
 public:
  /// `latency`: from the moment of a pair to its answer, in dive time, at least. With `loops`, and
  /// two cameras, places are recognised, and what is said is corrected by that. Demands options
  /// that validate.
  VisionService(const estimation::VisionOptions& options, std::uint64_t seed, Utime latency,
                Late late = Late::kWait, RangeMaker make_range = nullptr,
                const std::optional<LoopSettings>& loops = std::nullopt);

  void hear(std::span<const ImuSample> samples);
  void hear(const DepthSample& sample);
  /// A pair, of which either may be missing, after the observe() of that tick. Waits until the
  /// inertial samples have reached it, and with Late::kNotYet until the worker is free; of those
  /// that wait only the newest is kept.
  void submit(std::optional<ImageFrame> left, std::optional<ImageFrame> right, Utime now);
  /// What was published this tick. What can be started by what was heard so far is started.
  void observe(const estimation::StateEstimate& published);

  /// The next answer once its time has come. Where no pictures come there are answers that say so.
  [[nodiscard]] std::optional<estimation::VisionEstimate> poll(Utime now);
  /// What was made of the pair of that answer, once: measured at its frame_utime, in B.
  [[nodiscard]] std::optional<RangeScan> take_scan();

 private:
  struct Pair {
    std::optional<ImageFrame> left;
    std::optional<ImageFrame> right;
    Utime asked = 0;
  };
  struct Answer {
    estimation::VisionEstimate word;
    std::optional<RangeScan> scan;
    std::optional<estimation::Keyframe> keyframe = {};  ///< What may be one.
  };

  [[nodiscard]] bool is_ripe(Utime now) const;
  void launch(Utime asked, std::optional<Pair> pair);
  [[nodiscard]] Answer work(estimation::VisionInput input);

  estimation::VisionPipeline pipeline_;  ///< The worker's while it is busy.
  double period_s_;
  Utime latency_;
  RangeMaker make_range_;
  std::optional<LoopService> loops_;
  std::vector<ImuSample> imu_;  ///< Not handed to the worker yet ...
  std::vector<DepthSample> depth_;
  Utime newest_imu_ = 0;
  estimation::StateEstimate published_;
  std::optional<Pair> next_;  ///< ... and neither is this.
  Utime launched_ = 0;
  std::optional<RangeScan> scan_;
  DelayedWorker<Answer> worker_;
};

}  // namespace dive::mission
