#pragma once
// What a study measures in a simulated dive, by ground truth.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "bench/drawn_dives.h"
#include "estimation/state_estimate.h"
#include "vehicle/simulator/ground_truth/ground_truth.h"
#include "vehicle/simulator/sensors/range_camera.h"
#include "vehicle/simulator/simulator.h"

namespace dive::bench {

/// Distances from the vehicle to the obstacles of the world, and to the diver.
class Distances {
 public:
  Distances(const RoutedSetup& setup, const mission::DiveSettings& settings);

  void observe(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD);
  [[nodiscard]] double min_to_world_m() const { return to_world_.min_clearance_m(); }
  [[nodiscard]] double min_to_diver_m() const { return to_diver_.min_clearance_m(); }
  [[nodiscard]] double to_world_now_m() const { return to_world_.clearance(now_.X_WB); }
  /// Infinite without a diver.
  [[nodiscard]] double to_diver_now_m() const;

 private:
  struct Now {
    Pose X_WB;
    std::optional<Pose> X_WD;
  };
  vehicle::ClearanceMeter to_world_;
  vehicle::ClearanceMeter to_diver_;
  Now now_;
};

/// Horizontal errors of the published position: relative to the map, in which the obstacles are,
/// and in the world, to which its covariance refers.
class PositionErrors {
 public:
  explicit PositionErrors(const mission::DiveSettings& settings);

  /// `truth` is relative to the map, as a DiveObserver has it.
  void observe(const estimation::StateEstimate& estimate, const vehicle::GroundTruth& truth);
  /// NEES of the last estimate, in the world; its mean over dives is 2 if the covariance is right.
  [[nodiscard]] double nees() const { return nees_; }
  [[nodiscard]] double nees_in_map() const { return nees_in_map_; }
  [[nodiscard]] double last_m() const { return last_m_; }  ///< Relative to the map, m.
  [[nodiscard]] double p95_m() const;                      ///< Relative to the map, m.

 private:
  Pose world_from_map_;
  double nees_ = 0.0;
  double nees_in_map_ = 0.0;
  double last_m_ = 0.0;
  std::vector<double> errors_m_;
};

/// Where the vehicle is nearest to the obstacles that the map has: that clearance, and what it
/// would be without each cause that makes it less than planned, m.
struct NearestPass {
  double as_stands = std::numeric_limits<double>::infinity();  ///< To the obstacles where they are.
  double as_drawn = 0.0;      ///< The same pose, to the obstacles where the map draws them.
  double as_estimated = 0.0;  ///< At the estimated pose, to the obstacles as drawn.
  double planned = 0.0;       ///< Least clearance of the path being followed, along all of it.
  double off_path = 0.0;      ///< Distance of the estimated position from that path.
  double at_s = 0.0;          ///< Time, s.
};

class NearestPasses {
 public:
  explicit NearestPasses(const RoutedSetup& setup);

  /// `truth` is relative to the map, as a DiveObserver has it. `min_to_world_m`: Distances' of the
  /// same tick.
  void observe(const mission::StepOutputs& out, const vehicle::GroundTruth& truth,
               double min_to_world_m);
  [[nodiscard]] const NearestPass& nearest() const { return nearest_; }

 private:
  vehicle::ClearanceMeter as_drawn_;
  NearestPass nearest_;
};

/// Whether the range camera could observe the unmapped objects: for how long each was in its field
/// of view within 3 m, whatever stood between.
class ObjectsInView {
 public:
  explicit ObjectsInView(const mission::DiveSettings& settings);

  void observe(const Pose& X_WB);
  /// True for an object that was in view for less than a second.
  [[nodiscard]] bool was_hidden(const std::string& name) const;

 private:
  [[nodiscard]] bool is_in_view(const Eigen::AlignedBox3d& box_W, const Pose& X_BW) const;

  vehicle::RangeCameraOptions camera_;
  Eigen::Quaterniond q_CB_;
  std::vector<Eigen::AlignedBox3d> boxes_W_;
  std::vector<std::string> names_;
  std::vector<double> seconds_;
};

}  // namespace dive::bench
