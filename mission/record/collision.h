#pragma once
// Place and time of the true vehicle's contacts, for check, log, explanation and drawing.

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"

namespace dive::mission {

/// The first tick of one contact with one obstacle (vehicle::ClearanceMeter defines a contact).
struct Collision {
  struct Estimate {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< Estimated position of the vehicle, m.
    double error_m = 0.0;                           ///< Horizontal position error.
    /// estimation::horizontal_sigma() of the estimate, m.
    double sigma_m = 0.0;
  };

  double t_s = 0.0;  ///< Time since the dive began.
  Eigen::Vector3d p_W =
      Eigen::Vector3d::Zero();  ///< True position of the vehicle's origin on the map, m.
  std::string obstacle;
  std::optional<Estimate> estimate;  ///< Estimate at the same tick; absent if there is none.
};

/// The point of smallest clearance.
struct NearestApproach {
  double clearance_m = std::numeric_limits<double>::infinity();
  double t_s = 0.0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< True position of the vehicle's origin, m.
  std::string obstacle;                           ///< Empty where the clearance is infinite.
};

/// Horizontal distance (m) of the estimated position from the true one.
[[nodiscard]] double horizontal_error(const estimation::StateEstimate& estimate,
                                      const Pose& true_X_WB);

/// One collision for every obstacle whose contact begins at `utime`. An invalid estimate counts as
/// absent.
[[nodiscard]] std::vector<Collision> collisions_at(Utime utime, const Pose& true_X_WB,
                                                   std::span<const std::string> contacts,
                                                   const estimation::StateEstimate& estimate);

/// The obstacles touched, as a log records them.
[[nodiscard]] std::vector<std::string> obstacles_of(std::span<const Collision> collisions);

/// Half a line: "with 'rock/body/shape' at 12.34 s and (1.00, 2.00, -5.00) m; estimated (...) m,
/// error 0.31 m, one sigma 0.12 m".
[[nodiscard]] std::string describe(const Collision& collision);
/// Half a line: "0.13 m from 'rock/body/shape' at 12.34 s and (1.00, 2.00, -5.00) m".
[[nodiscard]] std::string describe(const NearestApproach& nearest);
/// "2 collisions: ...; ...", the first few of them; empty without any.
[[nodiscard]] std::string describe(std::span<const Collision> collisions);

}  // namespace dive::mission
