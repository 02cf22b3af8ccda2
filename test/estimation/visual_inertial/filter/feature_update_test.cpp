// The measurement model of a feature: Jacobians against differences, the projection, triangulation.

#include "estimation/visual_inertial/filter/feature_update.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "estimation/visual_inertial/filter/scalar_updates.h"
#include "test/common/arbitrary.h"
#include "test/estimation/visual_inertial/filter/analytic_dive.h"
#include "test/estimation/visual_inertial/filter/filter_dive.h"
#include "test/estimation/visual_inertial/filter/numeric_jacobian.h"

namespace dive::estimation {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::numeric_jacobian;
using testing::turn_by;

Pose disturbed(const Pose& pose, const VectorXd& e) {
  return {pose.p + e.segment<3>(3), turn_by(pose.q, e.segment<3>(0))};
}

// The cameras' projection, written independently.
Vector2d image_of(const Pose& X_WB, const Pose& X_BC, const Vector3d& p_W) {
  const Eigen::Isometry3d W_B = Eigen::Translation3d(X_WB.p) * X_WB.q;
  const Eigen::Isometry3d B_C = Eigen::Translation3d(X_BC.p) * X_BC.q;
  const Vector3d p_C = (W_B * B_C).inverse() * p_W;
  return p_C.head<2>() / p_C.z();
}

RC_GTEST_PROP(Feature, HasTheJacobiansThatDifferencesGive, ()) {
  const Pose X_WB = *testing::arbitrary_pose();
  const Pose X_BC{*testing::arbitrary_vector(0.5), so3_exp(*testing::arbitrary_rotation_vector())};
  const Vector3d p_C = *testing::arbitrary_vector(1.0) + Vector3d(0, 0, 3.0);
  const Vector3d p_W = X_WB * (X_BC * p_C);
  const auto jacobians = view_jacobians(X_WB, X_BC, p_W);
  RC_ASSERT(jacobians.has_value());
  RC_ASSERT((*project(X_WB, X_BC, p_W) - image_of(X_WB, X_BC, p_W)).norm() < 1e-12);
  const auto by_clone = numeric_jacobian(
      [&](const VectorXd& e) { return VectorXd(image_of(disturbed(X_WB, e), X_BC, p_W)); }, 6);
  const auto by_camera = numeric_jacobian(
      [&](const VectorXd& e) { return VectorXd(image_of(X_WB, disturbed(X_BC, e), p_W)); }, 6);
  const auto by_landmark = numeric_jacobian(
      [&](const VectorXd& e) { return VectorXd(image_of(X_WB, X_BC, p_W + e)); }, 3);
  RC_ASSERT((jacobians->clone - by_clone).cwiseAbs().maxCoeff() < 1e-6);
  RC_ASSERT((jacobians->camera - by_camera).cwiseAbs().maxCoeff() < 1e-6);
  RC_ASSERT((jacobians->landmark - by_landmark).cwiseAbs().maxCoeff() < 1e-6);
}

TEST(Feature, IsNotSeenFromBehind) {
  EXPECT_FALSE(project({}, {}, {0.0, 0.0, -1.0}));
  EXPECT_FALSE(view_jacobians({}, {}, {0.0, 0.0, 0.01}));
}

// A state in motion with five clones, after an update.
struct Window {
  testing::AnalyticDive dive{testing::AnalyticDiveOptions{}, 8};
  FilterState state{testing::filter_options(dive, {})};
  FeatureTrack track;
  Vector3d p_W;

  Window() {
    Random random(4);
    state.begin(ImuState{}, 1e-4 * Matrix15d::Identity());
    p_W = dive.truth(1.0).X_WB * Vector3d(2.5, 0.2, -1.6);
    track.id = 1;
    for (int i = 0; i < 5; ++i) {
      const auto truth = dive.truth(0.5 * i);
      ImuState imu;
      imu.motion = {truth.X_WB.q, truth.X_WB.p, truth.X_WB.q * truth.v_WB_B};
      state.propagate({imu, Matrix15d::Identity(), 1e-5 * Matrix15d::Identity(),
                       Eigen::Matrix<double, 9, 18>::Zero()});
      state.clone(i, i * 50'000, truth.omega_WB_B);
      const FeatureObservation seen{1, image_of(truth.X_WB, state.cameras_B[0], p_W),
                                    image_of(truth.X_WB, state.cameras_B[1], p_W)};
      track.observations.push_back(*observation_of(seen, i, dive.cameras()));
    }
    const std::array<Columns, 1> all{{{0, state.size()}}};
    MatrixXd H = MatrixXd::Zero(3, state.size());
    VectorXd r(3);
    for (int i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < H.cols(); ++j) H(i, j) = random.normal();
      r[i] = 0.02 * random.normal();
    }
    EXPECT_TRUE(state.correct(all, H, r, VectorXd::Constant(3, 1e-4)));
  }
};

// The unobservable directions: a rotation of everything about the vertical, a translation of
// everything; in the columns of calibration and clones, and in the landmark's.
TEST(FeatureTrack, DoesNotObserveATurnAboutTheVerticalOrAShift) {
  const Window window;
  const auto system = track_system(window.state, window.track, window.p_W);
  ASSERT_TRUE(system);
  const auto columns = window.state.view_columns();
  MatrixXd nothing = MatrixXd::Zero(system->H.cols(), 4);
  for (std::size_t i = 0; i < 5; ++i) {
    const Eigen::Index at = columns[0].size + static_cast<Eigen::Index>(6 * i);
    const Pose& X_WB = window.state.clones()[i].X_WB;
    nothing.block<3, 1>(at, 0) = X_WB.q.conjugate() * Vector3d::UnitZ();
    nothing.block<3, 1>(at + 3, 0) = Vector3d::UnitZ().cross(X_WB.p);
    nothing.block<3, 3>(at + 3, 1).setIdentity();
  }
  MatrixXd of_landmark(3, 4);
  of_landmark << Vector3d::UnitZ().cross(window.p_W), Eigen::Matrix3d::Identity();
  EXPECT_LT((system->H * nothing + system->H_f * of_landmark).norm(), 1e-9);
}

// n^T P^-1 n, with n the turn of everything about the vertical at the present estimate.
double information_on_heading(const FilterState& state) {
  VectorXd n = VectorXd::Zero(state.size());
  n.segment<3>(imu_error::kAttitude) = state.imu.motion.q_WB.conjugate() * Vector3d::UnitZ();
  n.segment<3>(imu_error::kPosition) = Vector3d::UnitZ().cross(state.imu.motion.p_WB);
  n.segment<3>(imu_error::kVelocity) = Vector3d::UnitZ().cross(state.imu.motion.v_WB);
  for (std::size_t i = 0; i < state.clones().size(); ++i) {
    const int at = state.clone_columns(i).start;
    n.segment<3>(at) = state.clones()[i].X_WB.q.conjugate() * Vector3d::UnitZ();
    n.segment<3>(at + 3) = Vector3d::UnitZ().cross(state.clones()[i].X_WB.p);
  }
  return n.dot(MatrixXd(state.covariance()).ldlt().solve(n));
}

// The same with n the turn of the axes of B by `axis`: what is expressed in B turns the other way.
double information_on_body(const FilterState& state, const Vector3d& axis) {
  VectorXd n = VectorXd::Zero(state.size());
  n.segment<3>(imu_error::kAttitude) = axis;
  for (std::size_t i = 0; i < state.clones().size(); ++i) {
    n.segment<3>(state.clone_columns(i).start) = axis;
  }
  const int unit = state.imu_intrinsics_columns()->start;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d of_gyro = -skew(axis) * (I + state.imu.intrinsics.gyro);
  const Eigen::Matrix3d of_accel = -skew(axis) * (I + state.imu.intrinsics.accel);
  n.segment<9>(unit) = of_gyro.reshaped();
  n.segment<9>(unit + 9) = of_accel.reshaped();
  for (std::size_t i = 0; i < state.cameras_B.size(); ++i) {
    const int at = state.camera_columns(i)->start;
    n.segment<3>(at) = -(state.cameras_B[i].q.conjugate() * axis);
    n.segment<3>(at + 3) = -axis.cross(state.cameras_B[i].p);
  }
  return n.dot(MatrixXd(state.covariance()).ldlt().solve(n));
}

// Images say nothing about the heading, however far they move the estimate, nor about how the axes
// of B stand in the vehicle.
TEST(FeatureTrack, AddsNoInformationOnTheHeadingNorOnTheAxesOfB) {
  Window window;
  FilterState& state = window.state;
  Random random(6);
  const double before = information_on_heading(state);
  const Vector3d axis(0.6, -0.48, 0.64);
  const double of_body = information_on_body(state, axis);
  for (int update = 0; update < 5; ++update) {
    auto system = track_system(state, window.track, window.p_W);
    ASSERT_TRUE(system);
    separate_landmark(*system);
    const Eigen::Index free = system->r.size() - 3;
    for (double& r : system->r) r = 5.0 * random.normal();
    const Vector3d p_W = state.imu.motion.p_WB;
    ASSERT_TRUE(state.correct(state.view_columns(), system->H.bottomRows(free),
                              system->r.tail(free), VectorXd::Constant(free, 0.25)));
    EXPECT_GT((state.imu.motion.p_WB - p_W).norm(), 1e-5);
    EXPECT_NEAR(information_on_heading(state) / before, 1.0, 1e-5);
    EXPECT_NEAR(information_on_body(state, axis) / of_body, 1.0, 1e-5);
  }
}

// A port, its index, focal lengths and principal points to be estimated, and a rolling shutter.
struct Optics {
  testing::AnalyticDiveOptions of_dive;
  testing::AnalyticDive dive;
  VisualInertialOptions options;
  FilterState state;
  Vector3d p_W;

  Optics()
      : of_dive([] {
          testing::AnalyticDiveOptions result;
          result.refractive_index = 1.33;
          result.refractive_index_sigma = 0.01;
          result.focal_sigma = 0.003;
          result.centre_sigma_px = 2.0;
          result.line_time_s = 5e-5;
          return result;
        }()),
        dive(of_dive, 9),
        options(testing::filter_options(dive, of_dive)),
        state(options) {
    state.begin(ImuState{}, 1e-4 * Matrix15d::Identity());
    p_W = dive.truth(1.0).X_WB * Vector3d(2.5, 0.2, -1.6);
    for (int i = 0; i < 5; ++i) {
      const auto truth = dive.truth(0.5 * i);
      ImuState imu;
      imu.motion = {truth.X_WB.q, truth.X_WB.p, truth.X_WB.q * truth.v_WB_B};
      state.propagate({imu, Matrix15d::Identity(), 1e-5 * Matrix15d::Identity(),
                       Eigen::Matrix<double, 9, 18>::Zero()});
      state.clone(i, i * 50'000, truth.omega_WB_B);
    }
  }

  // The track as cameras with these intrinsics observe it, normalised as configured.
  [[nodiscard]] FeatureTrack track(const std::vector<CameraModel>& cameras) const {
    FeatureTrack track;
    for (int i = 0; i < 5; ++i) {
      std::vector<Vector2d> seen;
      for (std::size_t c = 0; c < 2; ++c) {
        Vector2d pixel(0.0, 0.5 * (cameras[c].height - 1));
        for (int step = 0; step < 6; ++step) {
          const Pose X_WB = dive.truth(0.5 * i + cameras[c].row_time(pixel)).X_WB;
          pixel = cameras[c].distort(image_of(X_WB, options.cameras[c].X_BC, p_W));
        }
        seen.push_back(*options.cameras[c].undistort(pixel));
      }
      const FeatureObservation feature{1, seen[0], seen[1]};
      track.observations.push_back(*observation_of(feature, i, options.cameras));
    }
    return track;
  }
};

// The poses of the rows follow from rate and velocity, to the second order of 12 ms.
TEST(FeatureTrack, HasNoResidualThroughARollingShutter) {
  const Optics optics;
  FeatureTrack track = optics.track(optics.options.cameras);
  const auto rolling = track_system(optics.state, track, optics.p_W);
  ASSERT_TRUE(rolling);
  EXPECT_LT(rolling->r.cwiseAbs().maxCoeff(), 0.01);
  for (TrackObservation& observation : track.observations) observation.row_s = {};
  EXPECT_GT(track_system(optics.state, track, optics.p_W)->r.cwiseAbs().maxCoeff(), 0.1)
      << "or there is nothing to take into account";
}

TEST(FeatureTrack, HasTheJacobianOfTheIntrinsicsThatDifferencesGive) {
  Optics optics;
  const auto residual = [&](const VectorXd& e) {
    std::vector<CameraModel> cameras = optics.options.cameras;
    for (Eigen::Index c = 0; c < 2; ++c) {
      CameraModel& camera = cameras[static_cast<std::size_t>(c)];
      camera.fx += e[4 * c];
      camera.fy += e[4 * c + 1];
      camera.cx += e[4 * c + 2];
      camera.cy += e[4 * c + 3];
      camera.refractive_index += e[8];
    }
    return VectorXd(track_system(optics.state, optics.track(cameras), optics.p_W)->r);
  };
  const MatrixXd expected = numeric_jacobian(residual, 9);
  const auto system = track_system(optics.state, optics.track(optics.options.cameras), optics.p_W);
  const Eigen::Index start = optics.state.view_columns()[0].start;
  const Eigen::Index at = optics.state.camera_intrinsics_columns(0)->start - start;
  const Eigen::Index index = optics.state.refractive_index_columns()->start - start;
  ASSERT_EQ(index, at + 8);
  const MatrixXd H = system->H.middleCols(at, 9);
  EXPECT_LT((H - expected).cwiseAbs().maxCoeff(), 1e-3 * expected.cwiseAbs().maxCoeff());

  // What is estimated is taken off the residuals and off the rays of the triangulation.
  VectorXd e(9);
  e << 0.5, -0.4, 1.0, 0.7, -0.3, 0.6, -0.8, 0.2, 0.004;
  const VectorXd before = residual(e);
  EXPECT_GT(before.cwiseAbs().maxCoeff(), 1.0);
  for (Eigen::Index c = 0; c < 2; ++c) {
    CameraModel& camera = optics.state.models[static_cast<std::size_t>(c)];
    camera.fx += e[4 * c];
    camera.fy += e[4 * c + 1];
    camera.cx += e[4 * c + 2];
    camera.cy += e[4 * c + 3];
    camera.refractive_index += e[8];
  }
  EXPECT_LT(residual(e).cwiseAbs().maxCoeff(), 0.02);
}

TEST(FeatureTrack, KeepsAllThatIsFreeOfTheLandmark) {
  const Window window;
  const auto before = track_system(window.state, window.track, window.p_W);
  auto after = before;
  separate_landmark(*after);
  const Eigen::Index free = after->r.size() - 3;
  EXPECT_EQ(free, 17);
  EXPECT_LT(after->H_f.bottomRows(free).norm(), 1e-12);
  // The information left is that of least squares over the landmark: H^T (I - H_f (H_f^T H_f)^-1
  // H_f^T) H.
  const MatrixXd projector =
      MatrixXd::Identity(20, 20) -
      before->H_f * (before->H_f.transpose() * before->H_f).inverse() * before->H_f.transpose();
  const MatrixXd N = after->H.bottomRows(free);
  const MatrixXd information = before->H.transpose() * projector * before->H;
  EXPECT_LT((N.transpose() * N - information).norm(), 1e-12 * information.norm());
  const VectorXd gradient = before->H.transpose() * projector * before->r;
  EXPECT_LT((N.transpose() * after->r.tail(free) - gradient).norm(), 1e-9 * gradient.norm());
}

TEST(Compression, LosesNothing) {
  Random random(9);
  MatrixXd H(40, 7);
  VectorXd r(40);
  for (double& x : H.reshaped()) x = random.normal();
  for (double& x : r) x = random.normal();
  const MatrixXd information = H.transpose() * H;
  const VectorXd gradient = H.transpose() * r;
  compress(H, r);
  EXPECT_EQ(H.rows(), 7);
  EXPECT_LT((H.transpose() * H - information).norm(), 1e-12 * information.norm());
  EXPECT_LT((H.transpose() * r - gradient).norm(), 1e-12 * gradient.norm());
}

TEST(Gate, IsTheQuantileOfTables) {
  // 95 % is 1.6449 sigma of a normal, 99 % is 2.3263.
  EXPECT_NEAR(chi_square_limit(1.6449, 3), 7.815, 0.05);
  EXPECT_NEAR(chi_square_limit(1.6449, 40), 55.758, 0.02);
  EXPECT_NEAR(chi_square_limit(2.3263, 10), 23.209, 0.06);
}

RC_GTEST_PROP(ImuSystems, HaveTheJacobiansThatDifferencesGive, ()) {
  testing::AnalyticDive dive(testing::AnalyticDiveOptions{}, 8);
  FilterState state(testing::filter_options(dive, {}));
  ImuState imu;
  const Pose pose = *testing::arbitrary_pose();
  imu.motion = {pose.q, pose.p, *testing::arbitrary_vector(1.0)};
  imu.gyro_bias = *testing::arbitrary_vector(0.1);
  state.begin(imu, Matrix15d::Identity());
  const Vector3d sensor = *testing::arbitrary_vector(0.5);
  const auto expected = [&](const VectorXd& e) {
    const Eigen::Quaterniond q = turn_by(imu.motion.q_WB, e.segment<3>(0));
    const Vector3d v = imu.motion.v_WB + e.segment<3>(6);
    VectorXd z(7);
    z << (imu.motion.p_WB + e.segment<3>(3) + q * sensor).z(), q.conjugate() * v,
        imu.gyro_bias + e.segment<3>(9);
    return z;
  };
  const MatrixXd numeric = numeric_jacobian(expected, 15);
  const ImuSystem depth = depth_system(state, 3.0, sensor, 0.1);
  const ImuSystem still = zero_velocity_system(state, Vector3d::Zero(), 0.1, 0.1);
  RC_ASSERT((depth.H - numeric.topRows<1>()).cwiseAbs().maxCoeff() < 1e-6);
  RC_ASSERT((still.H - numeric.bottomRows<6>()).cwiseAbs().maxCoeff() < 1e-6);
  const VectorXd at = expected(VectorXd::Zero(15));
  RC_ASSERT(std::abs(depth.r[0] - (-3.0 - at[0])) < 1e-12);
  RC_ASSERT((still.r + at.tail<6>()).norm() < 1e-12);
}

RC_GTEST_PROP(Triangulation, FindsWhatCamerasSee, ()) {
  const Pose X_WB = *testing::arbitrary_pose();
  const Vector3d p_B = *testing::arbitrary_vector(1.5) + Vector3d(0, 0, 4.0);
  const Vector3d p_W = X_WB * p_B;
  std::vector<View> views;
  for (int i = 0; i < 6; ++i) {
    const Pose X_WC = X_WB * Pose{{0.1 * i, 0.02 * i * i, 0.03 * i}, so3_exp({0, 0.02 * i, 0})};
    views.push_back({X_WC, image_of(X_WC, {}, p_W)});
  }
  const auto found = triangulate(views, 1.0 / 240.0);
  RC_ASSERT(found.has_value());
  RC_ASSERT((found->p_W - p_W).norm() < 1e-6);
  RC_ASSERT(found->cost < 1e-12);
}

TEST(Triangulation, StatesTheErrorItHas) {
  const double sigma = 1.0 / 240.0;
  Random random(2);
  const Vector3d p_W(0.3, -0.4, 4.0);
  double nees = 0.0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<View> views;
    for (int i = 0; i < 8; ++i) {
      const Pose X_WC{{0.15 * i, 0.05 * i, 0.0}, Eigen::Quaterniond::Identity()};
      const double x = sigma * random.normal();
      views.push_back({X_WC, image_of(X_WC, {}, p_W) + Vector2d(x, sigma * random.normal())});
    }
    const auto found = triangulate(views, sigma);
    ASSERT_TRUE(found);
    const Vector3d error = found->p_W - p_W;
    nees += error.dot((sigma * sigma * found->covariance).inverse() * error) / kRuns;
  }
  EXPECT_NEAR(nees, 3.0, 0.2);
}

TEST(Triangulation, ReportsWhyItFindsNothing) {
  const double sigma = 1.0 / 240.0;
  const Pose at;
  const Pose beside{{0.2, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const auto error = [&](std::vector<View> views) {
    const auto found = triangulate(views, sigma);
    return found ? std::optional<TriangulationError>() : found.error();
  };
  EXPECT_EQ(error({{at, {0, 0}}}), TriangulationError::kTooFewViews);
  EXPECT_EQ(error({{at, {0.1, 0}}, {at, {0.1, 0}}}), TriangulationError::kNoParallax);
  EXPECT_EQ(error({{at, {0, 0}}, {beside, {0.1, 0.0}}}), TriangulationError::kBehind);
  EXPECT_EQ(error({{at, {0.002, 0}}, {beside, {0.0, 0.0}}}), TriangulationError::kTooFar);
  EXPECT_EQ(error({{at, {0.01, 0}}, {beside, {0.0, 0.0}}}), TriangulationError::kNoParallax)
      << "20 m away, and a pixel is 8 m";
}

}  // namespace
}  // namespace dive::estimation
