#include "estimation/visual_inertial/filter/window_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

#include "estimation/visual_inertial/filter/fitted_point.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using imu_error::kPosition;
using imu_error::kVelocity;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

// Unknowns: cameras 6 each, time offset 1, frames 9 each, biases 6.
constexpr int kCamera = 6;  // attitude, position
constexpr int kFrame = 9;   // attitude, position, velocity
constexpr int kBiases = 6;
constexpr Eigen::Index kTwoFrames = 18;
constexpr int kMaxFitSteps = 25;
constexpr int kMaxDampings = 6;
constexpr double kSettled = 0.01;  // change of the cost, which is in sigmas squared
constexpr double kLeastDamping = 1e-9;
constexpr double kOutlierOfFit = 3.0;   // sigmas
constexpr double kExact = 1e-6;         // sigma of a calibration that is not estimated
constexpr double kClearlyBehind = 3.0;  // sigmas of the inverse depth
constexpr double kLost = 100.0;         // cost of a point that is not before a camera

struct Values {
  std::vector<Pose> cameras_B;
  double time_offset_s = 0.0;  // change of the configured one
  std::vector<Kinematics> frames;
  Vector3d gyro_bias = Vector3d::Zero();
  Vector3d accel_bias = Vector3d::Zero();
  ImuIntrinsics intrinsics;  // not estimated
  std::vector<FittedPoint> points;

  [[nodiscard]] ImuState imu(std::size_t frame) const {
    return {frames[frame], gyro_bias, accel_bias, intrinsics};
  }
};

// H x = g, with the points eliminated from it; what is needed to find their step afterwards.
struct Eliminated {
  Matrix3d inverse = Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  MatrixXd cross;  // 3 rows; columns of the calibration, then 6 for each of `frames`
  std::vector<std::size_t> frames;  // that see it; the first is its anchor
};

struct FitSystem {
  MatrixXd H;
  VectorXd g;
  std::vector<Eliminated> points;
  double cost = 0.0;
  // Of the images alone:
  double image_cost = 0.0;
  int images = 0;
  int outliers = 0;
};

// The terms of one point before it is eliminated, in the columns of Eliminated::cross.
struct Scratch {
  MatrixXd H;
  VectorXd g;
  Matrix3d own = Matrix3d::Zero();
};

// A range of columns, and the place where it begins among others.
struct Part {
  Eigen::Index from, to, size;
};

// Adds terms H, g in the columns `from` to those `to`.
template <typename Parts, typename Matrix, typename Vector>
void scatter(const Parts& parts, const Matrix& H, const Vector& g, MatrixXd& H_to, VectorXd& g_to) {
  for (const Part& row : parts) {
    g_to.segment(row.to, row.size) += g.segment(row.from, row.size);
    for (const Part& other : parts) {
      H_to.block(row.to, other.to, row.size, other.size) +=
          H.block(row.from, other.from, row.size, other.size);
    }
  }
}

// Columns of one view: anchor's camera, own camera, time offset, anchor, frame. Two of them may be
// the same column of the point.
constexpr Eigen::Index kOfView = 25;
using ViewParts = std::array<Part, 5>;

class Problem {
 public:
  Problem(const StartWindow& window, const VisualInertialOptions& options,
          const std::vector<Pose>& cameras_B, const WindowPriors& priors, const Kinematics& first)
      : window_(window),
        options_(options),
        cameras_B_(cameras_B),
        priors_(priors),
        first_(first),
        calibration_(kCamera * static_cast<Eigen::Index>(cameras_B.size()) + 1) {}

  [[nodiscard]] Values begin(const ImuState& first) const;
  [[nodiscard]] FitSystem linearise(const Values& at, double damping) const;
  [[nodiscard]] Values moved(const Values& at, const FitSystem& normal, const VectorXd& step) const;

 private:
  void add_calibration(const Values& at, FitSystem& normal) const;
  void add_priors(const Values& at, FitSystem& normal) const;
  void add_views(const Values& at, std::size_t index, FitSystem& normal, Scratch& sum) const;
  void add_imu(const Values& at, std::size_t frame, FitSystem& normal) const;
  void add_point(const Values& at, std::size_t index, double damping, FitSystem& normal) const;
  [[nodiscard]] double best_inverse_depth(const FeatureTrack& track, const Values& at,
                                          const FittedPoint& point) const {
    return estimation::best_inverse_depth(track, {at.frames, at.cameras_B}, point,
                                          options_.pixel_sigma);
  }
  [[nodiscard]] Eigen::Index bias_column() const { return column(window_.size()); }
  [[nodiscard]] Eigen::Index column(std::size_t frame) const {
    return calibration_ + kFrame * static_cast<Eigen::Index>(frame);
  }

  const StartWindow& window_;
  const VisualInertialOptions& options_;
  const std::vector<Pose>& cameras_B_;
  const WindowPriors& priors_;
  Kinematics first_;
  Eigen::Index calibration_;  // columns of the cameras and of the time offset
};

Values Problem::begin(const ImuState& first) const {
  Values values;
  values.cameras_B = cameras_B_;
  values.gyro_bias = first.gyro_bias;
  values.accel_bias = first.accel_bias;
  values.intrinsics = first.intrinsics;
  values.frames.push_back(first.motion);
  for (std::size_t k = 0; k + 1 < window_.size(); ++k) {
    values.frames.push_back(
        propagate_over(values.imu(k), window_.imu[k], options_.imu, options_.gravity).state.motion);
  }
  for (const FeatureTrack& track : window_.tracks) {
    FittedPoint point{index_of(track.observations.front()), track.observations.front().left,
                      kUsualInverseDepth};
    point.inverse_depth = best_inverse_depth(track, values, point);
    values.points.push_back(point);
  }
  return values;
}

// A term r = J x of the unknowns of some columns, with a weight.
template <typename Jacobian, typename Residual>
void add_term(Eigen::Index at, const Jacobian& J, const Residual& r, double weight, FitSystem& n) {
  n.H.block(at, at, J.cols(), J.cols()) += weight * J.transpose() * J;
  n.g.segment(at, J.cols()) += weight * J.transpose() * r;
  n.cost += weight * r.squaredNorm();
}

void Problem::add_calibration(const Values& at, FitSystem& normal) const {
  const bool is_free = options_.calibrate_extrinsics;
  const double turn = is_free ? deg_to_rad(options_.extrinsic_sigma_deg) : kExact;
  const double shift = is_free ? options_.extrinsic_sigma_m : kExact;
  const double offset = options_.calibrate_time_offset ? options_.time_offset_sigma_s : kExact;
  const Matrix3d I = Matrix3d::Identity();
  for (std::size_t i = 0; i < at.cameras_B.size(); ++i) {
    const Eigen::Index column = kCamera * static_cast<Eigen::Index>(i);
    const Vector3d turned = so3_log(at.cameras_B[i].q.conjugate() * cameras_B_[i].q);
    add_term(column, I, turned, weight_of(turn), normal);
    add_term(column + 3, I, Vector3d(cameras_B_[i].p - at.cameras_B[i].p), weight_of(shift),
             normal);
  }
  add_term(calibration_ - 1, Eigen::Matrix<double, 1, 1>(1.0),
           Eigen::Matrix<double, 1, 1>(-at.time_offset_s), weight_of(offset), normal);
}

void Problem::add_priors(const Values& at, FitSystem& normal) const {
  const Kinematics& first = at.frames.front();
  const Matrix3d I = Matrix3d::Identity();
  using Scalar = Eigen::Matrix<double, 1, 1>;
  for (int axis = 0; axis < 3; ++axis) {
    add_term(column(0) + kPosition + axis, Scalar(1.0),
             Scalar(first_.p_WB[axis] - first.p_WB[axis]),
             weight_of(priors_.position_sigma_m[axis]), normal);
  }
  // Turned about the vertical since the beginning.
  const Eigen::RowVector3d by_theta = first.q_WB.toRotationMatrix().row(2);
  const Vector3d turned = so3_log(first.q_WB * first_.q_WB.conjugate());
  add_term(column(0), by_theta, Eigen::Matrix<double, 1, 1>(-turned.z()),
           weight_of(priors_.heading_sigma), normal);
  add_term(bias_column(), I, Vector3d(priors_.bias.gyro_bias - at.gyro_bias),
           weight_of(priors_.gyro_bias_sigma), normal);
  add_term(bias_column() + 3, I, Vector3d(priors_.bias.accel_bias - at.accel_bias),
           weight_of(priors_.accel_bias_sigma), normal);
  for (std::size_t k = 0; k < window_.size(); ++k) {
    const Kinematics& frame = at.frames[k];
    if (priors_.rest_sigma) {
      const double sigma = *priors_.rest_sigma * std::sqrt(static_cast<double>(window_.size()));
      add_term(column(k) + kVelocity, I, Vector3d(-frame.v_WB), weight_of(sigma), normal);
    }
    if (!window_.depth_m[k]) continue;
    const Vector3d sensor = frame.q_WB * options_.depth_sensor_B;
    Eigen::Matrix<double, 1, 6> J = Eigen::Matrix<double, 1, 6>::Zero();
    J.head<3>() = -(frame.q_WB.toRotationMatrix() * skew(options_.depth_sensor_B)).row(2);
    J[kPosition + 2] = 1.0;
    const double r = -*window_.depth_m[k] - frame.p_WB.z() - sensor.z();
    add_term(column(k), J, Eigen::Matrix<double, 1, 1>(r), weight_of(options_.depth_sigma_m),
             normal);
  }
  if (!priors_.speed) return;
  const Kinematics& frame = at.frames[priors_.speed->frame];
  const Vector3d v_B = frame.q_WB.conjugate() * frame.v_WB;
  Eigen::Matrix<double, 3, kFrame> J = Eigen::Matrix<double, 3, kFrame>::Zero();
  J.leftCols<3>() = skew(v_B);
  J.rightCols<3>() = frame.q_WB.conjugate().toRotationMatrix();
  add_term(column(priors_.speed->frame), J, Vector3d(priors_.speed->v_B - v_B),
           weight_of(priors_.speed->sigma), normal);
}

void Problem::add_imu(const Values& at, std::size_t frame, FitSystem& normal) const {
  const ImuStep step =
      propagate_over(at.imu(frame), window_.imu[frame], options_.imu, options_.gravity);
  const Kinematics& predicted = step.state.motion;
  const Kinematics& next = at.frames[frame + 1];
  Vector9d r;  // of the prediction: the error that would make it the next frame
  r << so3_log(predicted.q_WB.conjugate() * next.q_WB), next.p_WB - predicted.p_WB,
      next.v_WB - predicted.v_WB;
  const Eigen::LLT<Matrix9d> noise(step.noise.topLeftCorner<9, 9>());
  if (noise.info() != Eigen::Success) return;
  // Whitened; F x_k - x_{k+1} = r to first order.
  Eigen::Matrix<double, 9, 2 * kFrame + kBiases> J;
  J << step.transition.topLeftCorner<9, 9>(), -Matrix9d::Identity(),
      step.transition.topRightCorner<9, kBiases>();
  noise.matrixL().solveInPlace(J);
  noise.matrixL().solveInPlace(r);
  const Eigen::Matrix<double, 2 * kFrame + kBiases, 2 * kFrame + kBiases> H = J.transpose() * J;
  const Eigen::Matrix<double, 2 * kFrame + kBiases, 1> g = J.transpose() * r;
  const std::array<Part, 2> parts{
      {{0, column(frame), kTwoFrames}, {kTwoFrames, bias_column(), kBiases}}};
  scatter(parts, H, g, normal.H, normal.g);
  normal.cost += r.squaredNorm();
}

void Problem::add_views(const Values& at, std::size_t index, FitSystem& normal,
                        Scratch& sum) const {
  const FeatureTrack& track = window_.tracks[index];
  const FittedPoint& point = at.points[index];
  Eliminated& out = normal.points[index];
  const auto rate = [&](std::size_t frame) {  // change of a pose with the time offset
    Vector6d by_offset;
    by_offset << window_.gyro_B[frame] - at.gyro_bias, at.frames[frame].v_WB;
    return by_offset;
  };
  const auto at_image = [&](std::size_t frame) {
    const Vector6d by = at.time_offset_s * rate(frame);
    Kinematics pose = at.frames[frame];
    pose.q_WB = pose.q_WB * so3_exp(by.head<3>());
    pose.p_WB += by.tail<3>();
    return pose;
  };
  const Kinematics anchor = at_image(point.anchor);
  for (std::size_t i = 0; i < track.observations.size(); ++i) {
    const auto& view = track.observations[i];
    const Kinematics frame = at_image(index_of(view));
    for (std::size_t camera = 0; camera < (view.right ? 2U : 1U); ++camera) {
      ++normal.images;
      const auto seen = view_of(point, anchor, frame, at.cameras_B[0], at.cameras_B[camera]);
      if (!seen) {
        ++normal.outliers;
        normal.cost += kLost;
        continue;
      }
      const Eigen::Matrix2d whitening = whitening_of(view, camera, options_.pixel_sigma);
      const Vector2d r = whitening * ((camera == 0 ? view.left : *view.right) - seen->image);
      const double sigmas = r.norm();
      const auto [cost, weight] = huber(sigmas);
      normal.cost += cost;
      normal.image_cost += cost;
      normal.outliers += sigmas > kOutlierOfFit ? 1 : 0;
      Eigen::Matrix<double, 2, kOfView> J;
      J << seen->by_anchor_camera, seen->by_camera,
          seen->by_anchor * rate(point.anchor) + seen->by_frame * rate(index_of(view)),
          seen->by_anchor, seen->by_frame;
      J = (whitening * J).eval();
      const ViewParts parts{{{0, 0, kCamera},
                             {6, kCamera * static_cast<Eigen::Index>(camera), kCamera},
                             {12, calibration_ - 1, 1},
                             {13, calibration_, 6},
                             {19, calibration_ + 6 * static_cast<Eigen::Index>(i), 6}}};
      const Matrix23d by_point = whitening * seen->by_point;
      const Eigen::Matrix<double, kOfView, kOfView> H = weight * J.transpose() * J;
      const Eigen::Matrix<double, kOfView, 1> g = weight * J.transpose() * r;
      const Eigen::Matrix<double, 3, kOfView> cross = weight * by_point.transpose() * J;
      scatter(parts, H, g, sum.H, sum.g);
      for (const Part& part : parts) {
        out.cross.middleCols(part.to, part.size) += cross.middleCols(part.from, part.size);
      }
      sum.own.noalias() += weight * by_point.transpose() * by_point;
      out.g.noalias() += weight * by_point.transpose() * r;
    }
  }
}

void Problem::add_point(const Values& at, std::size_t index, double damping,
                        FitSystem& normal) const {
  Eliminated& out = normal.points[index];
  for (const auto& view : window_.tracks[index].observations) out.frames.push_back(index_of(view));
  const Eigen::Index columns = calibration_ + 6 * static_cast<Eigen::Index>(out.frames.size());
  Scratch sum{MatrixXd::Zero(columns, columns), VectorXd::Zero(columns)};
  out.cross = MatrixXd::Zero(3, columns);
  sum.own(2, 2) = weight_of(kInverseDepthSigma);
  out.g.z() = sum.own(2, 2) * (kUsualInverseDepth - at.points[index].inverse_depth);
  add_views(at, index, normal, sum);
  sum.own.diagonal() *= 1.0 + damping;
  out.inverse = sum.own.inverse();
  sum.H.noalias() -= out.cross.transpose() * out.inverse * out.cross;
  sum.g.noalias() -= out.cross.transpose() * (out.inverse * out.g);
  std::vector<Part> parts{{0, 0, calibration_}};
  for (std::size_t i = 0; i < out.frames.size(); ++i) {
    parts.push_back({calibration_ + 6 * static_cast<Eigen::Index>(i), column(out.frames[i]), 6});
  }
  scatter(parts, sum.H, sum.g, normal.H, normal.g);
}

FitSystem Problem::linearise(const Values& at, double damping) const {
  FitSystem normal;
  const Eigen::Index size = bias_column() + kBiases;
  normal.H = MatrixXd::Zero(size, size);
  normal.g = VectorXd::Zero(size);
  normal.points.resize(window_.tracks.size());
  add_calibration(at, normal);
  add_priors(at, normal);
  for (std::size_t k = 0; k + 1 < window_.size(); ++k) add_imu(at, k, normal);
  for (std::size_t i = 0; i < window_.tracks.size(); ++i) add_point(at, i, damping, normal);
  normal.H.diagonal() *= 1.0 + damping;
  return normal;
}

Values Problem::moved(const Values& at, const FitSystem& normal, const VectorXd& step) const {
  Values next = at;
  for (std::size_t i = 0; i < next.cameras_B.size(); ++i) {
    const Vector6d by = step.segment<kCamera>(kCamera * static_cast<Eigen::Index>(i));
    next.cameras_B[i].q = (next.cameras_B[i].q * so3_exp(by.head<3>())).normalized();
    next.cameras_B[i].p += by.tail<3>();
  }
  next.time_offset_s += step[calibration_ - 1];
  for (std::size_t k = 0; k < next.frames.size(); ++k) {
    Kinematics& frame = next.frames[k];
    const Vector9d by = step.segment<kFrame>(column(k));
    frame.q_WB = (frame.q_WB * so3_exp(by.head<3>())).normalized();
    frame.p_WB += by.segment<3>(kPosition);
    frame.v_WB += by.segment<3>(kVelocity);
  }
  next.gyro_bias += step.segment<3>(bias_column());
  next.accel_bias += step.segment<3>(bias_column() + 3);
  for (std::size_t i = 0; i < next.points.size(); ++i) {
    const Eliminated& point = normal.points[i];
    Vector3d g = point.g - point.cross.leftCols(calibration_) * step.head(calibration_);
    for (std::size_t j = 0; j < point.frames.size(); ++j) {
      g -= point.cross.middleCols<6>(calibration_ + 6 * static_cast<Eigen::Index>(j)) *
           step.segment<6>(column(point.frames[j]));
    }
    const Vector3d by = point.inverse * g;
    next.points[i].image += by.head<2>();
    next.points[i].inverse_depth += by.z();
    // Scale and depths change together along a curve, which a linear step leaves.
    next.points[i].inverse_depth = best_inverse_depth(window_.tracks[i], next, next.points[i]);
  }
  return next;
}

// The last frame and the biases from the inverse of H.
std::optional<Matrix15d> covariance_of_last(const MatrixXd& H) {
  const Eigen::LLT<MatrixXd> llt(H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  MatrixXd last = MatrixXd::Zero(H.rows(), imu_error::kSize);
  last.bottomRows<imu_error::kSize>().setIdentity();
  const MatrixXd P = llt.solve(last);
  const Matrix15d own = P.bottomRows<imu_error::kSize>();
  return Matrix15d(0.5 * (own + own.transpose()));
}

}  // namespace

std::optional<WindowFit> fit_window(const StartWindow& window, const VisualInertialOptions& options,
                                    const std::vector<Pose>& cameras_B, const ImuState& first,
                                    const WindowPriors& priors) {
  const Problem problem(window, options, cameras_B, priors, first.motion);
  Values at = problem.begin(first);
  double damping = 1e-5;
  FitSystem normal = problem.linearise(at, damping);
  bool has_converged = false;
  for (int i = 0; i < kMaxFitSteps && !has_converged; ++i) {
    bool is_better = false;
    for (int retry = 0; retry < kMaxDampings && !is_better; ++retry) {
      const VectorXd step = normal.H.ldlt().solve(normal.g);
      if (!step.allFinite()) return std::nullopt;
      Values next = problem.moved(at, normal, step);
      const double lighter = std::max(damping / 10.0, kLeastDamping);
      FitSystem there = problem.linearise(next, lighter);
      is_better = there.cost < normal.cost;
      if (is_better) {
        // A damped step hardly moves along a direction that little determines, such as the scale.
        has_converged = damping <= 10.0 * kLeastDamping && normal.cost - there.cost < kSettled;
        at = std::move(next);
        normal = std::move(there);
        damping = lighter;
      } else {
        damping *= 10.0;
        normal = problem.linearise(at, damping);
      }
    }
    has_converged = has_converged || !is_better;
  }
  const FitSystem end = problem.linearise(at, 0.0);
  const auto covariance = covariance_of_last(end.H);
  if (!covariance || end.images == 0) return std::nullopt;
  WindowFit fit;
  fit.last = at.imu(window.size() - 1);
  fit.covariance = *covariance;
  fit.total = end.cost;
  const double unknowns =
      3.0 * static_cast<double>(window.tracks.size()) + 6.0 * static_cast<double>(window.size());
  fit.cost = end.image_cost / std::max(1.0, 2.0 * end.images - unknowns);
  fit.outliers = static_cast<double>(end.outliers) / end.images;
  int behind = 0;
  for (std::size_t i = 0; i < at.points.size(); ++i) {
    const double sigma = std::sqrt(end.points[i].inverse(2, 2));
    behind += at.points[i].inverse_depth < -kClearlyBehind * sigma ? 1 : 0;
  }
  fit.behind =
      static_cast<double>(behind) / std::max<double>(1.0, static_cast<double>(at.points.size()));
  return fit;
}

}  // namespace dive::estimation
