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

// Rows of one image point: r = H x + H_f f + n, in pixels.
struct ViewRows {
  Vector2d r;
  ViewJacobians by;
  Eigen::Matrix<double, 2, 5> by_intrinsics = Eigen::Matrix<double, 2, 5>::Zero();
};

std::optional<ViewRows> view_rows(const FilterState& state, const Clone& clone, std::size_t camera,
                                  const TrackObservation& observation, const Vector3d& p_W) {
  const Pose X_WB = clone.after(observation.row_s[camera]);
  const Pose& X_BC = state.cameras_B[camera];
  const auto expected = project(X_WB, X_BC, p_W);
  auto jacobians = view_jacobians(X_WB, X_BC, p_W);
  if (!expected || !jacobians) return std::nullopt;
  const CameraModel& model = state.models[camera];
  const auto pixel = model.project(expected->homogeneous());
  if (!pixel) return std::nullopt;
  const Eigen::Matrix2d to_pixels = model.jacobian(*expected);
  ViewRows rows;
  rows.r = observation.pixel[camera] - *pixel;
  if (state.calibrates_intrinsics()) rows.by_intrinsics = model.intrinsics_jacobian(*expected);
  if (observation.row_s[camera] != 0.0) {
    // R Exp(theta) Exp(w t) = R Exp(w t) Exp(Exp(-w t) theta)
    jacobians->clone.leftCols<3>() *= so3_exp(-observation.row_s[camera] * clone.rate_B).matrix();
  }
  rows.by = {to_pixels * jacobians->clone, to_pixels * jacobians->camera,
             to_pixels * jacobians->landmark};
  return rows;
}

// Writes the columns of the calibration, which begin at `start`, into two rows of H.
void set_calibration(const FilterState& state, std::size_t camera, const ViewRows& rows, int start,
                     Eigen::Ref<MatrixXd> H) {
  if (const auto own = state.camera_columns(camera)) {
    H.middleCols<6>(own->start - start) = rows.by.camera;
  }
  if (const auto own = state.camera_intrinsics_columns(camera)) {
    H.middleCols<4>(own->start - start) = rows.by_intrinsics.leftCols<4>();
  }
  if (const auto own = state.refractive_index_columns()) {
    H.col(own->start - start) = rows.by_intrinsics.col(4);
  }
}

// The observed point by the present intrinsics, normalised.
Vector2d normalised(const FilterState& state, std::size_t camera,
                    const TrackObservation& observation) {
  const Vector2d& as_configured = camera == 0 ? observation.left : *observation.right;
  if (!state.calibrates_intrinsics()) return as_configured;
  return state.models[camera].undistort(observation.pixel[camera]).value_or(as_configured);
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
    const auto add = [&](std::size_t camera) {
      views.push_back({clone->after(observation.row_s[camera]) * state.cameras_B[camera],
                       normalised(state, camera, observation), observation.to_pixels[camera]});
    };
    // The last one is the anchor: a left one.
    if (observation.right) add(1);
    add(0);
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
      const auto view = view_rows(state, *clone, camera, observation, p_W);
      if (!view) return std::nullopt;
      system.r.segment<2>(row) = view->r;
      system.H_f.middleRows<2>(row) = view->by.landmark;
      system.H.block<2, 6>(row, at) = view->by.clone;
      set_calibration(state, camera, *view, columns[0].start, system.H.middleRows<2>(row));
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
    const auto view = view_rows(state, clone, camera, observation, mark.p_W);
    if (!view) return std::nullopt;
    system.r.segment<2>(row) = view->r;
    set_calibration(state, camera, *view, calibration.start, system.H.middleRows<2>(row));
    system.H.block<2, 3>(row, calibration.size) = view->by.landmark;
    system.H.block<2, 6>(row, calibration.size + 3) = view->by.clone;
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

// The depth is e_z^T c, and f = H_f^-1 (r - H x - n).
double depth_share(const FilterState& state, const LinearSystem& separated, const Vector3d& p_W,
                   double pixel_sigma) {
  const Pose& X_WB = state.clones().back().X_WB;
  const Pose& X_BC = state.cameras_B[0];
  const Matrix3d R_BW = X_WB.q.conjugate().toRotationMatrix();
  const Matrix3d R_CB = X_BC.q.conjugate().toRotationMatrix();
  const Vector3d u = R_BW * (p_W - X_WB.p);
  const Vector3d c = R_CB * (u - X_BC.p);
  const Eigen::RowVector3d by_landmark = R_CB.row(2) * R_BW;
  const Eigen::RowVector3d by_rows = by_landmark * separated.H_f.topRows<3>().inverse();
  MatrixXd J = -by_rows * separated.H.topRows<3>();
  const auto columns = state.view_columns();
  J.rightCols<6>() += (Vector6d() << (R_CB.row(2) * skew(u)).transpose(), -by_landmark.transpose())
                          .finished()
                          .transpose();
  if (const auto own = state.camera_columns(0)) {
    const Eigen::Index at = own->start - columns[0].start;
    J.middleCols<3>(at) += skew(c).row(2);
    J.middleCols<3>(at + 3) -= R_CB.row(2);
  }
  const double variance =
      state.innovation(columns, J)(0, 0) + pixel_sigma * pixel_sigma * by_rows.squaredNorm();
  return std::sqrt(variance) / c.z();
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
