#include "estimation/visual_inertial/filter/filter_state.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using imu_error::kSize;

// A copy has no error of its own; this keeps the covariance positive definite: 1 urad, 1 um.
constexpr double kCopyVariance = 1e-12;
constexpr double kMinPivot = 1e-9;  // of H_f, relative

void turn(Eigen::Quaterniond& q, const Vector3d& by) { q = (q * so3_exp(by)).normalized(); }

Pose corrected(const Pose& pose, const Eigen::Ref<const VectorXd>& error) {
  Pose result{pose.p + error.segment<3>(3), pose.q};
  turn(result.q, error.head<3>());
  return result;
}

int largest_size(const VisualInertialOptions& options) {
  return kSize + ImuIntrinsics::kSize + 10 * static_cast<int>(options.cameras.size()) + 2 +
         3 * (options.max_landmarks + 1) + 6 * (options.max_clones + 1);
}

}  // namespace

double largest_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
}

FilterState::FilterState(const VisualInertialOptions& options)
    : time_offset_s(options.time_offset_s),
      models(options.cameras),
      calibrates_imu_(options.imu_scale_sigma > 0.0),
      calibrates_cameras_(options.calibrate_extrinsics),
      calibrates_intrinsics_(options.focal_sigma > 0.0),
      calibrates_index_(options.refractive_index_sigma > 0.0),
      calibrates_offset_(options.calibrate_time_offset),
      P_(MatrixXd::Zero(largest_size(options), largest_size(options))) {
  for (const CameraModel& camera : options.cameras) cameras_B.push_back(camera.X_BC);
  size_ = landmarks_start();
  set_prior(options);
}

void FilterState::set_prior(const VisualInertialOptions& options) {
  const double attitude = std::pow(deg_to_rad(options.extrinsic_sigma_deg), 2);
  const double position = std::pow(options.extrinsic_sigma_m, 2);
  for (std::size_t i = 0; i < cameras_B.size(); ++i) {
    if (const auto columns = camera_columns(i)) {
      P_.diagonal().segment<3>(columns->start).setConstant(attitude);
      P_.diagonal().segment<3>(columns->start + 3).setConstant(position);
    }
    if (const auto columns = camera_intrinsics_columns(i)) {
      const CameraModel& camera = options.cameras[i];
      const Eigen::Vector4d sigmas(options.focal_sigma * camera.fx, options.focal_sigma * camera.fy,
                                   options.centre_sigma_px, options.centre_sigma_px);
      P_.diagonal().segment<4>(columns->start) = sigmas.cwiseAbs2();
    }
  }
  if (const auto columns = refractive_index_columns()) {
    P_(columns->start, columns->start) = std::pow(options.refractive_index_sigma, 2);
  }
  if (const auto columns = imu_intrinsics_columns()) {
    P_.diagonal()
        .segment<ImuIntrinsics::kSize>(columns->start)
        .setConstant(std::pow(options.imu_scale_sigma, 2));
  }
  if (const auto columns = offset_columns()) {
    P_(columns->start, columns->start) = std::pow(options.time_offset_sigma_s, 2);
  }
}

std::optional<Columns> FilterState::imu_intrinsics_columns() const {
  if (!calibrates_imu_) return std::nullopt;
  return Columns{kSize, ImuIntrinsics::kSize};
}

std::optional<Columns> FilterState::camera_columns(std::size_t camera) const {
  if (!calibrates_cameras_) return std::nullopt;
  return Columns{cameras_start() + 6 * static_cast<int>(camera), 6};
}

std::optional<Columns> FilterState::camera_intrinsics_columns(std::size_t camera) const {
  if (!calibrates_intrinsics_) return std::nullopt;
  return Columns{camera_intrinsics_start() + 4 * static_cast<int>(camera), 4};
}

std::optional<Columns> FilterState::refractive_index_columns() const {
  if (!calibrates_index_) return std::nullopt;
  return Columns{landmarks_start() - (calibrates_offset_ ? 2 : 1), 1};
}

std::optional<Columns> FilterState::offset_columns() const {
  if (!calibrates_offset_) return std::nullopt;
  return Columns{landmarks_start() - 1, 1};
}

int FilterState::landmarks_start() const {
  const int intrinsics = calibrates_intrinsics_ ? 4 * static_cast<int>(cameras_B.size()) : 0;
  return camera_intrinsics_start() + intrinsics + (calibrates_index_ ? 1 : 0) +
         (calibrates_offset_ ? 1 : 0);
}

Columns FilterState::landmark_columns(std::size_t landmark) const {
  return {landmarks_start() + 3 * static_cast<int>(landmark), 3};
}

Columns FilterState::clone_columns(std::size_t clone) const {
  return {clones_start() + 6 * static_cast<int>(clone), 6};
}

void FilterState::begin(const ImuState& state, const Matrix15d& covariance) {
  const ImuIntrinsics known = imu.intrinsics;
  imu = state;
  imu.intrinsics = known;
  clones_.clear();
  landmarks_.clear();
  size_ = landmarks_start();
  P_.topLeftCorner<kSize, kSize>() = covariance;
  P_.block(0, kSize, kSize, size_ - kSize).setZero();
  P_.block(kSize, 0, size_ - kSize, kSize).setZero();
}

void FilterState::correlate_biases(const ImuReading& at) {
  DIVE_DEMAND(clones_.empty() && landmarks_.empty());
  const auto columns = imu_intrinsics_columns();
  if (!columns) return;
  Eigen::Matrix<double, 6, ImuIntrinsics::kSize> J;
  J << of_elements(at.gyro_B), Matrix3x9d::Zero(), Matrix3x9d::Zero(), of_elements(at.accel_B);
  const Eigen::Matrix<double, 6, ImuIntrinsics::kSize> cross =
      J * P_.block<ImuIntrinsics::kSize, ImuIntrinsics::kSize>(columns->start, columns->start);
  P_.block<6, 6>(imu_error::kGyroBias, imu_error::kGyroBias) += cross * J.transpose();
  P_.block<6, ImuIntrinsics::kSize>(imu_error::kGyroBias, columns->start) = cross;
  P_.block<ImuIntrinsics::kSize, 6>(columns->start, imu_error::kGyroBias) = cross.transpose();
}

void FilterState::propagate(const ImuStep& step) {
  imu = step.state;
  scratch_.noalias() = step.transition * P_.topRows<kSize>().leftCols(size_);
  const auto columns = imu_intrinsics_columns();
  if (columns) {
    scratch_.topRows<9>().noalias() +=
        step.by_intrinsics * P_.middleRows<ImuIntrinsics::kSize>(columns->start).leftCols(size_);
  }
  Matrix15d next = scratch_.leftCols<kSize>() * step.transition.transpose();
  if (columns) {
    next.leftCols<9>().noalias() +=
        scratch_.middleCols<ImuIntrinsics::kSize>(columns->start) * step.by_intrinsics.transpose();
  }
  next += step.noise;
  const int rest = size_ - kSize;
  P_.topLeftCorner<kSize, kSize>() = 0.5 * (next + next.transpose());
  P_.block(0, kSize, kSize, rest) = scratch_.rightCols(rest);
  P_.block(kSize, 0, rest, kSize) = scratch_.rightCols(rest).transpose();
}

void FilterState::clone(std::int64_t frame, Utime utime, const Vector3d& rate_B) {
  DIVE_DEMAND(size_ + 6 <= P_.rows());
  const Pose pose{imu.motion.p_WB, imu.motion.q_WB};
  clones_.push_back({frame, utime, pose, rate_B, imu.motion.v_WB});
  const int at = size_;
  size_ += 6;
  P_.block(at, 0, 6, at) = P_.topRows<6>().leftCols(at);
  if (const auto offset = offset_columns()) {
    Vector6d by_offset;
    by_offset << rate_B, imu.motion.v_WB;
    P_.block(at, 0, 6, at).noalias() += by_offset * P_.row(offset->start).head(at);
    const Vector6d cross = P_.block<6, 1>(at, offset->start);
    P_.block<6, 6>(at, at) = P_.block<6, 6>(at, 0) + cross * by_offset.transpose();
  } else {
    P_.block<6, 6>(at, at) = P_.block<6, 6>(at, 0);
  }
  P_.block(0, at, at, 6) = P_.block(at, 0, 6, at).transpose();
  const Matrix6d own = P_.block<6, 6>(at, at);
  P_.block<6, 6>(at, at) = 0.5 * (own + own.transpose());
  P_.diagonal().segment<6>(at).array() += kCopyVariance;
}

void FilterState::remove(Columns columns) {
  const int end = columns.start + columns.size;
  const int tail = size_ - end;
  // One column, then one row at a time: source and destination overlap.
  for (int i = 0; i < tail; ++i) {
    P_.col(columns.start + i).head(size_) = P_.col(end + i).head(size_);
  }
  for (int column = 0; column < size_ - columns.size; ++column) {
    for (int i = 0; i < tail; ++i) P_(columns.start + i, column) = P_(end + i, column);
  }
  size_ -= columns.size;
}

void FilterState::drop_clone(std::size_t clone) {
  DIVE_DEMAND(clone < clones_.size());
  remove(clone_columns(clone));
  clones_.erase(clones_.begin() + static_cast<std::ptrdiff_t>(clone));
}

void FilterState::drop_landmark(std::size_t landmark) {
  DIVE_DEMAND(landmark < landmarks_.size());
  remove(landmark_columns(landmark));
  landmarks_.erase(landmarks_.begin() + static_cast<std::ptrdiff_t>(landmark));
}

bool FilterState::add_landmark(const MapLandmark& landmark, const Eigen::Matrix3Xd& H,
                               const Eigen::Matrix3d& H_f, const Vector3d& r, double variance) {
  DIVE_DEMAND(size_ + 3 <= P_.rows());
  const std::array<Columns, 2> columns = view_columns();
  DIVE_DEMAND(H.cols() == columns[0].size + columns[1].size);
  Eigen::FullPivLU<Eigen::Matrix3d> lu(H_f);
  lu.setThreshold(kMinPivot);
  if (!lu.isInvertible()) return false;
  const Eigen::Matrix3d inverse = lu.inverse();
  // f = H_f^-1 (r - H x - n)
  const Eigen::Matrix3Xd by_state = -inverse * H;
  const Eigen::Matrix3Xd cross =
      by_state.leftCols(columns[0].size) * P_.block(columns[0].start, 0, columns[0].size, size_) +
      by_state.rightCols(columns[1].size) * P_.block(columns[1].start, 0, columns[1].size, size_);
  const Eigen::Matrix3d own = cross.middleCols(columns[0].start, columns[0].size) *
                                  by_state.leftCols(columns[0].size).transpose() +
                              cross.middleCols(columns[1].start, columns[1].size) *
                                  by_state.rightCols(columns[1].size).transpose() +
                              variance * inverse * inverse.transpose();
  const Vector3d shift = inverse * r;
  if (!cross.allFinite() || !own.allFinite() || !shift.allFinite()) return false;

  const int at = clones_start();
  const int tail = size_ - at;
  const MatrixXd below = P_.block(at, 0, tail, size_);  // the clones' rows, moved down
  P_.block(at + 3, 0, tail, at) = below.leftCols(at);
  P_.block(0, at + 3, at, tail) = below.leftCols(at).transpose();
  P_.block(at + 3, at + 3, tail, tail) = below.rightCols(tail);
  P_.block(at, 0, 3, at) = cross.leftCols(at);
  P_.block(at, at + 3, 3, tail) = cross.rightCols(tail);
  P_.block(at, at, 3, 3) = 0.5 * (own + own.transpose());
  P_.block(0, at, at, 3) = cross.leftCols(at).transpose();
  P_.block(at + 3, at, tail, 3) = cross.rightCols(tail).transpose();
  size_ += 3;
  landmarks_.push_back(landmark);
  const Turns before = turn_directions();
  landmarks_.back().p_W += shift;
  turn_covariance(before);
  return true;
}

void FilterState::forget_height(double sigma_m) {
  VectorXd up = VectorXd::Zero(size_);
  up[imu_error::kPosition + 2] = sigma_m;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) up[landmark_columns(i).start + 2] = sigma_m;
  for (std::size_t i = 0; i < clones_.size(); ++i) up[clone_columns(i).start + 5] = sigma_m;
  P_.topLeftCorner(size_, size_) += up * up.transpose();
}

MatrixXd FilterState::innovation(std::span<const Columns> columns, const MatrixXd& H) const {
  MatrixXd S = MatrixXd::Zero(H.rows(), H.rows());
  int i = 0;
  for (const Columns& row : columns) {
    int j = 0;
    MatrixXd HP = MatrixXd::Zero(H.rows(), row.size);
    for (const Columns& column : columns) {
      HP.noalias() +=
          H.middleCols(j, column.size) * P_.block(column.start, row.start, column.size, row.size);
      j += column.size;
    }
    S.noalias() += HP * H.middleCols(i, row.size).transpose();
    i += row.size;
  }
  return S;
}

// With S = L L^T and W = P H^T L^-T: x = W L^-1 r, P' = P - W W^T. The lower triangle is computed
// and mirrored, so that P stays symmetric to the last bit.
bool FilterState::correct(std::span<const Columns> columns, const MatrixXd& H, const VectorXd& r,
                          const VectorXd& variances) {
  DIVE_DEMAND(H.rows() == r.size() && r.size() == variances.size());
  if (r.size() == 0 || !H.allFinite() || !r.allFinite()) return false;
  MatrixXd HP = MatrixXd::Zero(H.rows(), size_);
  MatrixXd S = variances.asDiagonal();
  int at = 0;
  for (const Columns& part : columns) {
    HP.noalias() += H.middleCols(at, part.size) * P_.block(part.start, 0, part.size, size_);
    at += part.size;
  }
  DIVE_DEMAND(at == H.cols());
  at = 0;
  for (const Columns& part : columns) {
    S.noalias() += HP.middleCols(part.start, part.size) * H.middleCols(at, part.size).transpose();
    at += part.size;
  }
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return false;
  llt.matrixL().solveInPlace(HP);  // W^T
  const VectorXd error = HP.transpose() * llt.matrixL().solve(r);
  const VectorXd left = P_.diagonal().head(size_) - HP.colwise().squaredNorm().transpose();
  if (!error.allFinite() || !(left.array() > 0.0).all()) return false;
  auto P = P_.topLeftCorner(size_, size_);
  P.selfadjointView<Eigen::Lower>().rankUpdate(HP.transpose(), -1.0);
  // turn_covariance() needs these columns whole, and mirrors the rest.
  make_whole(imu_error::kAttitude);
  if (is_body_free()) make_whole(camera_columns(0)->start);
  add_error(error);
  return true;
}

void FilterState::make_whole(int at) {
  P_.block(0, at, at, 3) = P_.block(at, 0, 3, at).transpose();
  auto own = P_.block<3, 3>(at, at);
  own.triangularView<Eigen::StrictlyUpper>() = own.transpose();
}

void FilterState::add_error(const VectorXd& error) {
  const Turns before = turn_directions();
  turn(imu.motion.q_WB, error.segment<3>(imu_error::kAttitude));
  imu.motion.p_WB += error.segment<3>(imu_error::kPosition);
  imu.motion.v_WB += error.segment<3>(imu_error::kVelocity);
  imu.gyro_bias += error.segment<3>(imu_error::kGyroBias);
  imu.accel_bias += error.segment<3>(imu_error::kAccelBias);
  if (const auto columns = imu_intrinsics_columns()) {
    imu.intrinsics.gyro.reshaped() += error.segment<9>(columns->start);
    imu.intrinsics.accel.reshaped() += error.segment<9>(columns->start + 9);
  }
  for (std::size_t i = 0; i < cameras_B.size(); ++i) {
    const auto columns = camera_columns(i);
    if (columns) cameras_B[i] = corrected(cameras_B[i], error.segment<6>(columns->start));
  }
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (const auto columns = camera_intrinsics_columns(i)) {
      models[i].fx += error[columns->start];
      models[i].fy += error[columns->start + 1];
      models[i].cx += error[columns->start + 2];
      models[i].cy += error[columns->start + 3];
    }
    if (const auto columns = refractive_index_columns()) {
      models[i].refractive_index += error[columns->start];
    }
  }
  if (const auto columns = offset_columns()) time_offset_s += error[columns->start];
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    landmarks_[i].p_W += error.segment<3>(landmark_columns(i).start);
  }
  for (std::size_t i = 0; i < clones_.size(); ++i) {
    clones_[i].X_WB = corrected(clones_[i].X_WB, error.segment<6>(clone_columns(i).start));
  }
  turn_covariance(before);
}

// A turn of W by w moves p by w x p = -[p]x w. One of B by e leaves p and v, and turns what is
// expressed in B by -e: I + T of the IMU by -[e]x (I + T), a camera's position by [p]x e.
FilterState::Turns FilterState::turn_directions() const {
  Turns n = Turns::Zero(size_, is_body_free() ? 6 : 3);
  n.block<3, 3>(imu_error::kAttitude, 0) = imu.motion.q_WB.conjugate().toRotationMatrix();
  n.block<3, 3>(imu_error::kPosition, 0) = -skew(imu.motion.p_WB);
  n.block<3, 3>(imu_error::kVelocity, 0) = -skew(imu.motion.v_WB);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    n.block<3, 3>(landmark_columns(i).start, 0) = -skew(landmarks_[i].p_W);
  }
  for (std::size_t i = 0; i < clones_.size(); ++i) {
    const int at = clone_columns(i).start;
    n.block<3, 3>(at, 0) = clones_[i].X_WB.q.conjugate().toRotationMatrix();
    n.block<3, 3>(at + 3, 0) = -skew(clones_[i].X_WB.p);
  }
  if (!is_body_free()) return n;
  n.block<3, 3>(imu_error::kAttitude, 3).setIdentity();
  for (std::size_t i = 0; i < clones_.size(); ++i) {
    n.block<3, 3>(clone_columns(i).start, 3).setIdentity();
  }
  const int unit = imu_intrinsics_columns()->start;
  for (int column = 0; column < 3; ++column) {
    const Vector3d axis = Vector3d::Unit(column);
    n.block<3, 3>(unit + 3 * column, 3) = skew(axis + imu.intrinsics.gyro.col(column));
    n.block<3, 3>(unit + 9 + 3 * column, 3) = skew(axis + imu.intrinsics.accel.col(column));
  }
  for (std::size_t i = 0; i < cameras_B.size(); ++i) {
    const int at = camera_columns(i)->start;
    n.block<3, 3>(at, 3) = -cameras_B[i].q.conjugate().toRotationMatrix();
    n.block<3, 3>(at + 3, 3) = skew(cameras_B[i].p);
  }
  return n;
}

// P' = T P T^T with T = I + (N' - N) G^T. A turn of B is read by the left camera's attitude in B,
// one of W by that of B in W less the turn of B: the rows of G are those of N there.
void FilterState::turn_covariance(const Turns& before) {
  const Turns change = turn_directions() - before;
  auto P = P_.topLeftCorner(size_, size_);
  const Eigen::Matrix3d by_body = before.block<3, 3>(imu_error::kAttitude, 0);
  Turns cross(size_, before.cols());  // P G
  cross.leftCols<3>() = P.middleCols<3>(imu_error::kAttitude) * by_body;
  const auto camera = is_body_free() ? camera_columns(0) : std::nullopt;
  Eigen::Matrix3d by_camera = Eigen::Matrix3d::Zero();
  if (camera) {
    by_camera = before.block<3, 3>(camera->start, 3);
    cross.rightCols<3>() = P.middleCols<3>(camera->start) * by_camera;
    cross.leftCols<3>() -= cross.rightCols<3>() * by_body;
  }
  Eigen::MatrixXd variance(before.cols(), before.cols());  // G^T P G
  variance.topRows<3>() = by_body.transpose() * cross.middleRows<3>(imu_error::kAttitude);
  if (camera) {
    variance.bottomRows<3>() = by_camera.transpose() * cross.middleRows<3>(camera->start);
    variance.topRows<3>() -= by_body.transpose() * variance.bottomRows<3>();
  }
  const Turns half = cross + 0.5 * change * variance;
  for (Eigen::Index axis = 0; axis < change.cols(); ++axis) {
    P.selfadjointView<Eigen::Lower>().rankUpdate(change.col(axis), half.col(axis));
  }
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
}

bool FilterState::is_finite() const {
  const Kinematics& m = imu.motion;
  return m.q_WB.coeffs().allFinite() && m.p_WB.allFinite() && m.v_WB.allFinite() &&
         imu.gyro_bias.allFinite() && imu.accel_bias.allFinite() &&
         covariance().diagonal().allFinite();
}

}  // namespace dive::estimation
