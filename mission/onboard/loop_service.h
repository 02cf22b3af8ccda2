#pragma once
// Loop closure beside the visual-inertial estimator, on a worker of its own: keyframes in, and what
// closed loops say of the estimator's words. A keyframe is answered a stated time after it came,
// never when the machine happens to be ready; while one is looked at no other is taken. So a worker
// that is late has fewer keyframes and later corrections, and on a vehicle nothing waits for it.

#include <functional>
#include <optional>

#include "common/clock.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/loop_closure/loop_finder.h"
#include "mission/onboard/delayed_worker.h"

namespace dive::mission {

struct LoopSettings {
  estimation::LoopCloserOptions closer;
  Utime latency = 400'000;  ///< From a keyframe to its answer, in dive time, at least.
};

class LoopService {
 public:
  /// LoopFinder::look(), or what stands in for it. Called on the worker, for one after the other.
  using Look =
      std::function<std::optional<estimation::LoopCorrection>(const estimation::Keyframe&)>;

  LoopService(Look look, const LoopSettings& settings, Late late);

  /// Accepted when it is far enough from the last one and the worker is idle.
  void submit(estimation::Keyframe keyframe, Utime now);
  /// Every tick: takes what is found once its time has come.
  void poll(Utime now);
  /// A word of the estimator as the loops correct it that were closed since it began.
  void correct(estimation::VisionEstimate& word) const;

 private:
  void accept(estimation::LoopCorrection correction);

  Look look_;  ///< The worker's while it is busy.
  LoopSettings settings_;
  std::optional<Pose> last_;                              ///< Keyframe that was taken, ...
  Utime begun_from_ = 0;                                  ///< ... and by which filter.
  std::optional<estimation::LoopCorrection> correction_;  ///< Of that filter.
  estimation::ClosedLoops loops_;
  DelayedWorker<std::optional<estimation::LoopCorrection>> worker_;
};

}  // namespace dive::mission
