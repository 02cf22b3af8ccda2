#pragma once
// Loop closure beside the visual-inertial estimator, on its own worker: keyframes in, corrections
// of the estimates out. A keyframe is answered a stated time after it arrived, not when the machine
// is ready; meanwhile no other is accepted. A slow worker means fewer keyframes and later
// corrections, and on a vehicle nothing waits for it.

#include <functional>
#include <optional>

#include "common/clock.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/loop_closure/loop_finder.h"
#include "mission/onboard/delayed_worker.h"

namespace dive::mission {

struct LoopSettings {
  estimation::LoopCloserOptions closer;
  Utime latency = 400'000;  ///< Least time from a keyframe to its answer, in dive time, us.
};

class LoopService {
 public:
  /// LoopFinder::process() or a substitute. Called on the worker, for one keyframe at a time.
  using Process =
      std::function<std::optional<estimation::LoopCorrection>(const estimation::Keyframe&)>;

  LoopService(Process process, const LoopSettings& settings, OnLate late);

  /// Submits a keyframe; ignored if it is too near to the last one or the worker is busy.
  void submit(estimation::Keyframe keyframe, Utime now);
  /// Called every tick: applies a correction once it is due.
  void poll(Utime now);
  /// Corrects an estimate by the loops closed since the filter was initialised.
  void correct(estimation::VisionEstimate& vision) const;

 private:
  void accept(estimation::LoopCorrection correction);

  Process process_;  ///< The worker's while it is busy.
  LoopSettings settings_;
  std::optional<Pose> last_;                              ///< Pose of the last keyframe.
  Utime init_utime_ = 0;                                  ///< Initialisation of its filter, us.
  std::optional<estimation::LoopCorrection> correction_;  ///< Correction of that filter.
  estimation::ClosedLoops loops_;
  DelayedWorker<std::optional<estimation::LoopCorrection>> worker_;
};

}  // namespace dive::mission
