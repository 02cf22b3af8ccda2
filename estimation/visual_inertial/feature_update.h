#pragma once
// What a landmark seen from clones says of the state:
//
//   u = R_i^T (f - p_i),   c = R_BC^T (u - p_BC),   z = [c_x / c_z, c_y / c_z]
//
// with the Jacobians doc/visual-inertial/features.md derives. Those of clones and landmarks are
// taken where they were first estimated, residuals where they are estimated now.

#include <optional>
#include <vector>

#include "estimation/visual_inertial/feature_tracks.h"
#include "estimation/visual_inertial/filter_state.h"
#include "estimation/visual_inertial/triangulation.h"

namespace dive::estimation {

using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

/// Of one image point: z = h(clone, camera, landmark).
struct ViewJacobians {
  Matrix26d clone;   ///< [theta, p]
  Matrix26d camera;  ///< [theta, p]
  Matrix23d landmark;
};

/// Nothing for what is not before the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> project(const Pose& X_WB, const Pose& X_BC,
                                                     const Eigen::Vector3d& p_W);
[[nodiscard]] std::optional<ViewJacobians> view_jacobians(const Pose& X_WB, const Pose& X_BC,
                                                          const Eigen::Vector3d& p_W);

/// r = H x + H_f f + n, rows of equal noise.
struct LinearSystem {
  Eigen::MatrixXd H;
  Eigen::MatrixX3d H_f;
  Eigen::VectorXd r;
};

/// All views of a track, H over state.view_columns(); nothing when one of them cannot be projected.
[[nodiscard]] std::optional<LinearSystem> track_system(const FilterState& state, const Track& track,
                                                       const Eigen::Vector3d& p_W);
/// A landmark of the state in the newest clone, H over [calibration, landmark, that clone], H_f
/// empty.
[[nodiscard]] std::optional<LinearSystem> landmark_system(const FilterState& state,
                                                          std::size_t landmark,
                                                          const TrackObservation& seen);
[[nodiscard]] std::vector<View> views_of(const FilterState& state, const Track& track);

/// Turns the rows by the Householder reflections that make H_f upper triangular: the first three
/// then determine the landmark, the others are free of it (what a nullspace projection keeps).
void separate_landmark(LinearSystem& system);
/// Replaces more rows than columns by as many as there are columns, without loss: R and Q^T r of
/// H = Q R.
void compress(Eigen::MatrixXd& H, Eigen::VectorXd& r);

/// The value that a chi^2 variable of `dof` degrees exceeds as seldom as a normal one exceeds
/// `sigma` (Wilson and Hilferty 1931).
[[nodiscard]] double chi_square_limit(double sigma, Eigen::Index dof);

}  // namespace dive::estimation
