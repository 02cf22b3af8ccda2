#pragma once
// The measurement model of a landmark observed from clones:
//
//   u = R_i^T (f - p_i),   c = R_BC^T (u - p_BC),   z = [c_x / c_z, c_y / c_z]
//
// with the Jacobians derived in doc/visual-inertial/features.md, evaluated at the newest estimate.
// The rows of a system are in pixels, by the camera's model. The clone of a rolling shutter is
// moved on to the exposure of the observation's row.

#include <optional>
#include <vector>

#include "estimation/visual_inertial/filter/feature_tracks.h"
#include "estimation/visual_inertial/filter/filter_state.h"
#include "estimation/visual_inertial/filter/triangulation.h"

namespace dive::estimation {

using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

/// Jacobians of one image point: z = h(clone, camera, landmark).
struct ViewJacobians {
  Matrix26d clone;   ///< [theta, p]
  Matrix26d camera;  ///< [theta, p]
  Matrix23d landmark;
};

/// Empty if the point is not in front of the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> project(const Pose& X_WB, const Pose& X_BC,
                                                     const Eigen::Vector3d& p_W);
[[nodiscard]] std::optional<ViewJacobians> view_jacobians(const Pose& X_WB, const Pose& X_BC,
                                                          const Eigen::Vector3d& p_W);

/// r = H x + H_f f + n, in pixels: rows of equal noise.
struct LinearSystem {
  Eigen::MatrixXd H;
  Eigen::MatrixX3d H_f;
  Eigen::VectorXd r;
};

/// All observations of a track, H over state.view_columns(); empty if one of them cannot be
/// projected.
[[nodiscard]] std::optional<LinearSystem> track_system(const FilterState& state,
                                                       const FeatureTrack& track,
                                                       const Eigen::Vector3d& p_W);
/// A landmark of the state in the newest clone, H over [calibration, landmark, that clone], H_f
/// empty.
[[nodiscard]] std::optional<LinearSystem> landmark_system(const FilterState& state,
                                                          std::size_t landmark,
                                                          const TrackObservation& observation);
[[nodiscard]] std::vector<View> views_of(const FilterState& state, const FeatureTrack& track);

/// Transforms the rows by the Householder reflections that make H_f upper triangular: the first
/// three rows then determine the landmark, the others do not depend on it (the rows of a nullspace
/// projection).
void separate_landmark(LinearSystem& system);
/// Sigma of the depth before the left camera at the newest clone, as a share of it: by the images,
/// poses and calibration. Demands a separated system.
[[nodiscard]] double depth_share(const FilterState& state, const LinearSystem& separated,
                                 const Eigen::Vector3d& p_W, double pixel_sigma);
/// Reduces the number of rows to that of the columns, if larger, without loss: R and Q^T r of H = Q
/// R.
void compress(Eigen::MatrixXd& H, Eigen::VectorXd& r);

/// The quantile of chi^2 with `dof` degrees of freedom that has the tail probability of `sigma` in
/// a normal distribution (Wilson and Hilferty 1931).
[[nodiscard]] double chi_square_limit(double sigma, Eigen::Index dof);

}  // namespace dive::estimation
