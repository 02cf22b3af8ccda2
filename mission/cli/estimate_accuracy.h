#pragma once
// The errors of an estimated trajectory beside a recording's ground truth, computed and printed.

#include <optional>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "estimation/dataset/recording.h"
#include "estimation/dataset/trajectory.h"
#include "estimation/dataset/trajectory_error.h"
#include "estimation/state_estimate.h"

namespace dive::mission {

using Estimates = std::vector<estimation::StateEstimate>;

struct Accuracy {
  double distance_m = 0.0;  ///< Ground-truth distance if present, else estimated.
  int poses = 0;            ///< Number of poses with a known truth.
  std::optional<estimation::AbsoluteError> yaw_aligned;
  std::optional<estimation::AbsoluteError> rigidly_aligned;
  std::optional<double> drift_percent;
  std::optional<estimation::Nees> nees;  ///< Of estimates with a covariance only.
  std::vector<estimation::RelativeError> relative;
};

[[nodiscard]] estimation::Trajectory trajectory_of(const Estimates& estimates);

[[nodiscard]] Accuracy accuracy_of(const estimation::Recording& recording,
                                   const estimation::Trajectory& estimate);
/// With NEES.
[[nodiscard]] Accuracy accuracy_of(const estimation::Recording& recording,
                                   const Estimates& estimates);

[[nodiscard]] nlohmann::ordered_json to_json(const Accuracy& accuracy);
void print_accuracy(const Accuracy& accuracy);

}  // namespace dive::mission
