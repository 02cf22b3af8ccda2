#pragma once
// The state of the filter, and the covariance of its errors:
//
//   [ IMU 15 | its intrinsics 18 | cameras 6 each | their intrinsics 4 each | refractive index 1 |
//     time offset 1 | landmarks 3 each | clones 6 each ]
//
// Quantities that are not calibrated have no columns. Attitude errors are on the right, R_true = R
// Exp(theta); the rest is additive; a camera or clone is [theta, p], a camera's intrinsics are [fx,
// fy, cx, cy]. Jacobians are evaluated at the newest estimate, and every correction turns the
// covariance with it: see doc/visual-inertial/README.md.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/clock.h"
#include "estimation/visual_inertial/filter/imu_propagation.h"

namespace dive::estimation {

struct Clone {
  std::int64_t frame = 0;  ///< Number of the frame taken at this pose.
  Utime utime = 0;         ///< Its time, by the IMU's clock.
  Pose X_WB;
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< Turn rate then, rad/s.
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();     ///< Velocity then, m/s.

  /// The pose `seconds` later, within the exposure of one image.
  [[nodiscard]] Pose after(double seconds) const {
    if (seconds == 0.0) return X_WB;
    return {X_WB.p + seconds * v_W, (X_WB.q * so3_exp(seconds * rate_B)).normalized()};
  }
};

struct MapLandmark {
  std::int64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  std::int64_t last_frame = 0;  ///< Frame of the last accepted observation.
  int rejected = 0;             ///< Consecutive rejections.
};

/// Columns of the error state.
struct Columns {
  int start = 0;
  int size = 0;
};

class FilterState {
 public:
  explicit FilterState(const VisualInertialOptions& options);

  ImuState imu;
  std::vector<Pose> cameras_B;
  double time_offset_s = 0.0;
  /// With the estimated intrinsics; their X_BC is not used, cameras_B is.
  std::vector<CameraModel> models;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] auto covariance() const { return P_.topLeftCorner(size_, size_); }
  [[nodiscard]] const std::vector<Clone>& clones() const { return clones_; }
  [[nodiscard]] std::vector<MapLandmark>& landmarks() { return landmarks_; }
  [[nodiscard]] const std::vector<MapLandmark>& landmarks() const { return landmarks_; }

  [[nodiscard]] std::optional<Columns> imu_intrinsics_columns() const;
  [[nodiscard]] std::optional<Columns> camera_columns(std::size_t camera) const;
  [[nodiscard]] std::optional<Columns> camera_intrinsics_columns(std::size_t camera) const;
  [[nodiscard]] std::optional<Columns> refractive_index_columns() const;
  [[nodiscard]] bool calibrates_intrinsics() const {
    return calibrates_intrinsics_ || calibrates_index_;
  }
  [[nodiscard]] std::optional<Columns> offset_columns() const;
  [[nodiscard]] Columns landmark_columns(std::size_t landmark) const;
  [[nodiscard]] Columns clone_columns(std::size_t clone) const;
  /// Calibration of the cameras and their clock, then all clones: the columns of a feature's
  /// Jacobian.
  [[nodiscard]] std::array<Columns, 2> view_columns() const {
    return {{{cameras_start(), landmarks_start() - cameras_start()},
             {clones_start(), size_ - clones_start()}}};
  }

  /// Sets the IMU's state, all but its intrinsics, and its covariance; removes everything else
  /// except the calibration.
  void begin(const ImuState& state, const Matrix15d& covariance);
  /// States that the biases were found at this rate and specific force (in B, without bias), and
  /// hold what the errors of the intrinsics add there: b = found + T v. Demands a state that has
  /// just begun.
  void correlate_biases(const ImuReading& at);
  /// With G the effect of the intrinsics C: P_IX' = F P_IX + G P_CX, P_II' = (F P_II + G P_CI) F^T
  /// + (F P_IC + G P_CC) G^T + Q.
  void propagate(const ImuStep& step);
  /// Copies the pose; its error includes that of the time offset, by the rate (rad/s) and the
  /// velocity.
  void clone(std::int64_t frame, Utime utime, const Eigen::Vector3d& rate_B);
  void drop_clone(std::size_t clone);
  void drop_landmark(std::size_t landmark);
  /// Adds a landmark determined by the three rows r = H x + H_f f + n, n ~ N(0, variance I), H over
  /// view_columns(); `p_W` is its triangulated position. False, without any change, if H_f is
  /// singular. Moves the clones' columns.
  bool add_landmark(const MapLandmark& landmark, const Eigen::Matrix3Xd& H,
                    const Eigen::Matrix3d& H_f, const Eigen::Vector3d& r, double variance);

  /// Adds this much uncertainty (m, one sigma) to the height of everything at once, which no image
  /// and no IMU measures.
  void forget_height(double sigma_m);

  /// The update with r = H x + n, H over `columns` in that order, n ~ N(0, diag(variances)). False,
  /// without any change, if the result would not be finite or not positive.
  bool correct(std::span<const Columns> columns, const Eigen::MatrixXd& H, const Eigen::VectorXd& r,
               const Eigen::VectorXd& variances);
  /// H P H^T for the same H.
  [[nodiscard]] Eigen::MatrixXd innovation(std::span<const Columns> columns,
                                           const Eigen::MatrixXd& H) const;

  [[nodiscard]] bool is_finite() const;

 private:
  void add_error(const Eigen::VectorXd& error);
  /// One column per radian of a turn: about x, y and z of W, then of B, if it is not defined.
  using Turns =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, Eigen::Dynamic, 6>;
  /// True if no measurement tells the axes of B: the IMU's and those of all cameras are estimated.
  [[nodiscard]] bool is_body_free() const { return calibrates_imu_ && calibrates_cameras_; }
  /// Change of every error as all of the estimate turns.
  [[nodiscard]] Turns turn_directions() const;
  /// To be called after the estimate has changed, with turn_directions() from before.
  void turn_covariance(const Turns& before);
  /// Mirrors what only the lower triangle has into three columns.
  void make_whole(int at);
  void remove(Columns columns);
  [[nodiscard]] int landmarks_start() const;
  [[nodiscard]] int clones_start() const {
    return landmarks_start() + 3 * static_cast<int>(landmarks_.size());
  }

  [[nodiscard]] int cameras_start() const {
    return imu_error::kSize + (calibrates_imu_ ? ImuIntrinsics::kSize : 0);
  }
  [[nodiscard]] int camera_intrinsics_start() const {
    return cameras_start() + (calibrates_cameras_ ? 6 * static_cast<int>(cameras_B.size()) : 0);
  }
  void set_prior(const VisualInertialOptions& options);

  bool calibrates_imu_;
  bool calibrates_cameras_;
  bool calibrates_intrinsics_;
  bool calibrates_index_;
  bool calibrates_offset_;
  int size_;
  Eigen::MatrixXd P_;  ///< Allocated at its maximum size, of which size_ is in use.
  Eigen::MatrixXd scratch_;
  std::vector<Clone> clones_;
  std::vector<MapLandmark> landmarks_;
};

/// One sigma along the axis where it is largest.
[[nodiscard]] double largest_sigma(const Eigen::Matrix3d& covariance);

}  // namespace dive::estimation
