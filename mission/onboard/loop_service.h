#pragma once
// Loop closure beside the visual-inertial estimator, on its own worker: keyframes in, corrections
// of the estimates or of the observed map out. A keyframe is answered a stated time after it
// arrived, not when the machine is ready; meanwhile no other is accepted. A slow worker means fewer
// keyframes and later corrections, and on a vehicle nothing waits for it.

#include <functional>
#include <optional>

#include "common/clock.h"
#include "common/map_correction.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/loop_closure/loop_finder.h"
#include "mission/onboard/delayed_worker.h"

namespace dive::mission {

struct LoopSettings {
  estimation::LoopCloserOptions closer;
  /// In an unknown environment the observed map moves with the vehicle (take_map_correction()), and
  /// the estimates get only the covariance; else the estimates are corrected.
  bool moves_map = false;
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
  /// DelayedWorker::take_failure()
  [[nodiscard]] std::optional<std::string> take_failure() { return worker_.take_failure(); }
  /// Corrects an estimate by the loops closed since the filter was initialised.
  void correct(estimation::VisionEstimate& vision) const;
  /// The published position was shifted onto the observed map by `by_W`, m. The graph has the
  /// shifted poses, so that a loop does not correct the same error again.
  void align(const Eigen::Vector2d& by_W);
  /// The correction of the map by the newest loop, once.
  [[nodiscard]] std::optional<MapCorrection> take_map_correction();

 private:
  void accept(estimation::LoopCorrection correction);
  [[nodiscard]] Matrix6d turned_back(const Matrix6d& covariance) const;

  Process process_;  ///< The worker's while it is busy.
  LoopSettings settings_;
  std::optional<Pose> last_;                              ///< Pose of the last keyframe.
  Utime init_utime_ = 0;                                  ///< Initialisation of its filter, us.
  std::optional<estimation::LoopCorrection> correction_;  ///< Correction of that filter.
  estimation::ClosedLoops loops_;
  /// Sum of the alignments since the filter was initialised, before the loops' correction, m.
  Eigen::Vector3d aligned_ = Eigen::Vector3d::Zero();
  std::optional<MapCorrection> map_correction_;
  DelayedWorker<std::optional<estimation::LoopCorrection>> worker_;
};

}  // namespace dive::mission
