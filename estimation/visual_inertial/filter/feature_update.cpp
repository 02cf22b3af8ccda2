#include "estimation/visual_inertial/filter/feature_update.h"

#include <cmath>

#include <Eigen/QR>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinDepth = 0.05;  // m in front of a camera

Vector3d in_camera(const Pose& X_WB, const Pose& X_BC, const Vector3d& p_W) {
  return X_BC.q.conjugate() * (X_WB.q.conjugate() * (p_W - X_WB.p) - X_BC.p);
}

const Clone* clone_of(const FilterState& state, std::int64_t frame, std::size_t& index) {
  for (index = 0; index < state.clones().size(); ++index) {
    if (state.clones()[index].frame == frame) return &state.clones()[index];
  }
  return nullptr;
}

Eigen::Index view_count(const FeatureTrack& track) {
  Eigen::Index count = 0;
  for (const TrackObservation& observation : track.observations) count += observation.right ? 2 : 1;
  return count;
}

}  // namespace

std::optional<Vector2d> project(const Pose& X_WB, const Pose& X_BC, const Vector3d& p_W) {
  const Vector3d c = in_camera(X_WB, X_BC, p_W);
  if (!(c.z() > kMinDepth)) return std::nullopt;
  return Vector2d(c.head<2>() / c.z());
}

std::optional<ViewJacobians> view_jacobians(const Pose& X_WB, const Pose& X_BC,
                                            const Vector3d& p_W) {
  const Matrix3d R_BW = X_WB.q.conjugate().toRotationMatrix();
  const Matrix3d R_CB = X_BC.q.conjugate().toRotationMatrix();
  const Vector3d u = R_BW * (p_W - X_WB.p);
  const Vector3d c = R_CB * (u - X_BC.p);
  if (!(c.z() > kMinDepth)) return std::nullopt;
  Matrix23d by_c;
  by_c << 1.0 / c.z(), 0.0, -c.x() / (c.z() * c.z()), 0.0, 1.0 / c.z(), -c.y() / (c.z() * c.z());
  const Matrix23d by_u = by_c * R_CB;
  ViewJacobians jacobians;
  jacobians.landmark = by_u * R_BW;
  jacobians.clone << by_u * skew(u), -jacobians.landmark;
  jacobians.camera << by_c * skew(c), -by_u;
  return jacobians;
}

std::vector<View> views_of(const FilterState& state, const FeatureTrack& track) {
  std::vector<View> views;
  views.reserve(2 * track.observations.size());
  for (const TrackObservation& observation : track.observations) {
    std::size_t index = 0;
    const Clone* clone = clone_of(state, observation.frame, index);
    DIVE_DEMAND(clone != nullptr);
    // The last one is the anchor: a left one.
    if (observation.right) {
      views.push_back(
          {clone->X_WB * state.cameras_B[1], *observation.right, observation.to_pixels[1]});
    }
    views.push_back({clone->X_WB * state.cameras_B[0], observation.left, observation.to_pixels[0]});
  }
  return views;
}

std::optional<LinearSystem> track_system(const FilterState& state, const FeatureTrack& track,
                                         const Vector3d& p_W) {
  const auto columns = state.view_columns();
  const Eigen::Index rows = 2 * view_count(track);
  LinearSystem system{MatrixXd::Zero(rows, columns[0].size + columns[1].size),
                      Eigen::MatrixX3d(rows, 3), VectorXd(rows)};
  Eigen::Index row = 0;
  for (const TrackObservation& observation : track.observations) {
    std::size_t index = 0;
    const Clone* clone = clone_of(state, observation.frame, index);
    DIVE_DEMAND(clone != nullptr);
    const Eigen::Index at = columns[0].size + state.clone_columns(index).start - columns[1].start;
    for (std::size_t camera = 0; camera < (observation.right ? 2U : 1U); ++camera, row += 2) {
      const Pose& X_BC = state.cameras_B[camera];
      const auto expected = project(clone->X_WB, X_BC, p_W);
      const auto jacobians = view_jacobians(clone->X_WB, X_BC, p_W);
      if (!expected || !jacobians) return std::nullopt;
      const Eigen::Matrix2d& to_pixels = observation.to_pixels[camera];
      system.r.segment<2>(row) =
          to_pixels * ((camera == 0 ? observation.left : *observation.right) - *expected);
      system.H_f.middleRows<2>(row) = to_pixels * jacobians->landmark;
      system.H.block<2, 6>(row, at) = to_pixels * jacobians->clone;
      if (const auto own = state.camera_columns(camera)) {
        system.H.block<2, 6>(row, own->start - columns[0].start) = to_pixels * jacobians->camera;
      }
    }
  }
  return system;
}

std::optional<LinearSystem> landmark_system(const FilterState& state, std::size_t landmark,
                                            const TrackObservation& observation) {
  const Clone& clone = state.clones().back();
  DIVE_DEMAND(clone.frame == observation.frame);
  const Columns calibration = state.view_columns()[0];
  const MapLandmark& mark = state.landmarks()[landmark];
  const Eigen::Index rows = observation.right ? 4 : 2;
  LinearSystem system{MatrixXd::Zero(rows, calibration.size + 9), Eigen::MatrixX3d(0, 3),
                      VectorXd(rows)};
  for (std::size_t camera = 0; camera < (observation.right ? 2U : 1U); ++camera) {
    const auto row = static_cast<Eigen::Index>(2 * camera);
    const Pose& X_BC = state.cameras_B[camera];
    const auto expected = project(clone.X_WB, X_BC, mark.p_W);
    const auto jacobians = view_jacobians(clone.X_WB, X_BC, mark.p_W);
    if (!expected || !jacobians) return std::nullopt;
    const Eigen::Matrix2d& to_pixels = observation.to_pixels[camera];
    system.r.segment<2>(row) =
        to_pixels * ((camera == 0 ? observation.left : *observation.right) - *expected);
    if (const auto own = state.camera_columns(camera)) {
      system.H.block<2, 6>(row, own->start - calibration.start) = to_pixels * jacobians->camera;
    }
    system.H.block<2, 3>(row, calibration.size) = to_pixels * jacobians->landmark;
    system.H.block<2, 6>(row, calibration.size + 3) = to_pixels * jacobians->clone;
  }
  return system;
}

void separate_landmark(LinearSystem& system) {
  DIVE_DEMAND(system.H_f.rows() >= 3);
  const Eigen::HouseholderQR<Eigen::MatrixX3d> qr(system.H_f);
  const auto Q = qr.householderQ();
  system.H.applyOnTheLeft(Q.adjoint());
  system.r.applyOnTheLeft(Q.adjoint());
  system.H_f = qr.matrixQR().triangularView<Eigen::Upper>();
}

void compress(MatrixXd& H, VectorXd& r) {
  if (H.rows() <= H.cols()) return;
  const Eigen::Index columns = H.cols();
  const Eigen::HouseholderQR<MatrixXd> qr(H);
  r.applyOnTheLeft(qr.householderQ().adjoint());
  r.conservativeResize(columns);
  H = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
}

double chi_square_limit(double sigma, Eigen::Index dof) {
  const double n = static_cast<double>(dof);
  const double spread = 2.0 / (9.0 * n);
  return n * std::pow(1.0 - spread + sigma * std::sqrt(spread), 3);
}

}  // namespace dive::estimation
