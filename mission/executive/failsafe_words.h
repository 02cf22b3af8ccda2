#pragma once
// Why a failsafe holds, in words with the figures of the moment. Private to mission/executive.

#include <optional>
#include <string>

#include <Eigen/Core>

#include "behaviors/behavior.h"
#include "behaviors/failsafes.h"
#include "common/measurements.h"
#include "mission/document/mission.h"

namespace dive::mission {

/// What there is to say of it.
struct FailsafeFigures {
  HealthSample health;
  std::optional<double> altitude_m;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  double estimated_depth_m = 0.0;
  double measured_depth_m = 0.0;
  double position_sigma_m = 0.0;
  const behaviors::Progress* progress = nullptr;
  bool out_of_replans = false;
  const std::string* retrace_failure = nullptr;
  const std::string* internal_error = nullptr;
};

[[nodiscard]] std::string describe(behaviors::FailsafeKind kind, const Mission& mission,
                                   const FailsafeFigures& figures);

}  // namespace dive::mission
