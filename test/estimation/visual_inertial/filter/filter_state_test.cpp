// State and covariance: updates, clones, landmarks.

#include "estimation/visual_inertial/filter/filter_state.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "test/common/arbitrary.h"
#include "test/estimation/visual_inertial/filter/covariance_law.h"

namespace dive::estimation {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

VisualInertialOptions options() {
  VisualInertialOptions result;
  result.cameras.resize(2);
  return result;
}

MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  MatrixXd result(rows, columns);
  for (double& x : result.reshaped()) x = random.normal();
  return result;
}

// Two clones and correlations among everything.
FilterState correlated(Random& random) {
  FilterState state(options());
  ImuState imu;
  imu.motion.v_WB = {0.4, -0.1, 0.05};
  const MatrixXd A = random_matrix(random, 15, 15);
  state.begin(imu, 1e-3 * A * A.transpose());
  state.clone(1, 1, {0.1, 0.2, 0.3});
  const std::array<Columns, 1> all{{{0, state.size()}}};
  EXPECT_TRUE(state.correct(all, random_matrix(random, 5, state.size()), VectorXd::Zero(5),
                            VectorXd::Constant(5, 1e-4)));
  state.propagate({state.imu, Matrix15d::Identity(), 1e-5 * Matrix15d::Identity(),
                   random_matrix(random, 9, 18)});
  state.clone(2, 2, {-0.1, 0.4, 0.2});
  return state;
}

RC_GTEST_PROP(Covariance, StaysSymmetricAndPositive, (std::uint64_t seed)) {
  RC_ASSERT(testing::break_covariance(seed, 500) == "");
}

RC_GTEST_PROP(Covariance, IsPropagatedWithTheIntrinsics, (std::uint64_t seed)) {
  Random random(seed);
  FilterState state = correlated(random);
  const MatrixXd P = state.covariance();
  const Columns intrinsics = *state.imu_intrinsics_columns();
  const MatrixXd G = random_matrix(random, 15, 5);
  const ImuStep step{state.imu, Matrix15d(random_matrix(random, 15, 15)), G * G.transpose(),
                     random_matrix(random, 9, 18)};
  MatrixXd F = MatrixXd::Identity(P.rows(), P.rows());
  F.topLeftCorner<15, 15>() = step.transition;
  F.block<9, 18>(0, intrinsics.start) += step.by_intrinsics;
  MatrixXd expected = F * P * F.transpose();
  expected.topLeftCorner<15, 15>() += step.noise;
  state.propagate(step);
  RC_ASSERT((state.covariance() - expected).norm() < 1e-12 * expected.norm());
}

// The bias that was found where the rate is w and the specific force f is b - T w, b - T f.
RC_GTEST_PROP(Covariance, OfBiasesFoundSomewhereIsThatOfTheirSumThere, (std::uint64_t seed)) {
  Random random(seed);
  FilterState state(options());
  const MatrixXd A = random_matrix(random, 15, 15);
  const Matrix15d P = 1e-3 * A * A.transpose();
  state.begin({}, P);
  const ImuReading at{random_matrix(random, 3, 1), random_matrix(random, 3, 1)};
  state.correlate_biases(at);
  const Columns intrinsics = *state.imu_intrinsics_columns();
  MatrixXd J = MatrixXd::Zero(15, state.size());
  J.leftCols<15>().setIdentity();
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) {
      J(9 + row, intrinsics.start + 3 * column + row) = -at.gyro_B[column];
      J(12 + row, intrinsics.start + 9 + 3 * column + row) = -at.accel_B[column];
    }
  }
  RC_ASSERT((J * state.covariance() * J.transpose() - P).norm() < 1e-12);
  // and it says nothing about the intrinsics
  MatrixXd own = MatrixXd::Zero(18, state.size());
  own.middleCols<18>(intrinsics.start).setIdentity();
  RC_ASSERT((own * state.covariance() * J.transpose()).norm() < 1e-12);
}

RC_GTEST_PROP(Update, IsThatOfJosephsForm, (std::uint64_t seed)) {
  Random random(seed);
  FilterState state = correlated(random);
  const MatrixXd P = state.covariance();
  const std::array<Columns, 2> columns{{{3, 5}, {30, 7}}};
  const MatrixXd H = random_matrix(random, 6, 12);
  const VectorXd r = 1e-3 * random_matrix(random, 6, 1);
  const VectorXd variances = VectorXd::LinSpaced(6, 1e-4, 1e-3);
  MatrixXd full = MatrixXd::Zero(6, P.rows());
  full.middleCols(3, 5) = H.leftCols(5);
  full.middleCols(30, 7) = H.rightCols(7);
  const MatrixXd R = variances.asDiagonal();
  const MatrixXd S = full * P * full.transpose() + R;
  RC_ASSERT((state.innovation(columns, H) + R - S).norm() < 1e-12 * S.norm());
  const MatrixXd K = P * full.transpose() * S.inverse();
  const MatrixXd left = MatrixXd::Identity(P.rows(), P.rows()) - K * full;
  const MatrixXd joseph = left * P * left.transpose() + K * R * K.transpose();
  FilterState still = state;  // without a residual the covariance does not turn with the estimate
  RC_ASSERT(still.correct(columns, H, VectorXd::Zero(6), variances));
  RC_ASSERT((still.covariance() - joseph).norm() < 1e-9 * P.norm());
  const Vector3d before = state.imu.motion.p_WB;
  RC_ASSERT(state.correct(columns, H, r, variances));
  RC_ASSERT((state.imu.motion.p_WB - before - (K * r).segment<3>(3)).norm() < 1e-9);
}

TEST(Update, RefusesWhatIsNotFinite) {
  Random random(1);
  FilterState state = correlated(random);
  const MatrixXd P = state.covariance();
  const std::array<Columns, 1> columns{{{0, 3}}};
  VectorXd r = VectorXd::Constant(3, std::nan(""));
  EXPECT_FALSE(state.correct(columns, MatrixXd::Identity(3, 3), r, VectorXd::Ones(3)));
  r.setConstant(1e308);
  EXPECT_FALSE(state.correct(columns, 1e200 * MatrixXd::Identity(3, 3), r, VectorXd::Ones(3)));
  EXPECT_EQ(MatrixXd(state.covariance()), P);
  EXPECT_TRUE(state.is_finite());
}

// By its error the offset shifts the time of the clone's pose.
TEST(Clone, ErrsAsThePoseAndWithTheTimeOffset) {
  Random random(2);
  FilterState state = correlated(random);
  const MatrixXd P = state.covariance();
  const Vector3d rate(0.3, -0.2, 0.5);
  state.clone(3, 3, rate);
  const Columns offset = *state.offset_columns();
  MatrixXd J = MatrixXd::Zero(6, P.rows());
  J.leftCols<6>().setIdentity();
  J.col(offset.start) << rate, state.imu.motion.v_WB;
  const Columns clone = state.clone_columns(2);
  ASSERT_EQ(state.size(), P.rows() + 6);
  EXPECT_LT((state.covariance().block(clone.start, 0, 6, P.rows()) - J * P).norm(), 1e-15);
  EXPECT_LT((state.covariance().bottomRightCorner<6, 6>() - J * P * J.transpose()).norm(), 1e-11);

  // The pose a little later, by differences.
  constexpr double kStep = 1e-6;
  const Kinematics& m = state.imu.motion;
  const Vector3d turn = so3_log(m.q_WB.conjugate() * (m.q_WB * so3_exp(kStep * rate))) / kStep;
  EXPECT_LT((turn - J.col(offset.start).head<3>()).norm(), 1e-6);
}

TEST(Clone, LeavesTheOthersAsTheyWere) {
  Random random(3);
  FilterState state = correlated(random);
  const MatrixXd before = state.covariance();
  state.clone(3, 3, Vector3d::Zero());
  state.drop_clone(2);
  EXPECT_EQ(MatrixXd(state.covariance()), before);
  const Columns gone = state.clone_columns(0);
  state.drop_clone(0);
  EXPECT_EQ(state.clones().front().frame, 2);
  const Eigen::Index n = before.rows();
  EXPECT_EQ(MatrixXd(state.covariance().bottomRightCorner<6, 6>()),
            MatrixXd(before.bottomRightCorner<6, 6>()));
  EXPECT_EQ(MatrixXd(state.covariance().topLeftCorner(gone.start, gone.start)),
            MatrixXd(before.topLeftCorner(gone.start, gone.start)));
  EXPECT_EQ(state.size(), n - 6);
}

// As if the landmark had been in the state, unknown, before its three rows were used.
TEST(Landmark, BeginsAsAnUpdateOfOneThatWasUnknown) {
  Random random(4);
  FilterState state = correlated(random);
  const auto columns = state.view_columns();
  const MatrixXd P = state.covariance();
  const Eigen::Index n = P.rows();
  const MatrixXd H = random_matrix(random, 3, columns[0].size + columns[1].size);
  const Eigen::Matrix3d H_f = random_matrix(random, 3, 3);
  const Vector3d r = 1e-4 * random_matrix(random, 3, 1);
  constexpr double kVariance = 1e-4;
  constexpr double kUnknown = 1e7;

  MatrixXd prior = MatrixXd::Zero(n + 3, n + 3);  // the landmark last
  prior.topLeftCorner(n, n) = P;
  prior.bottomRightCorner<3, 3>() = kUnknown * Eigen::Matrix3d::Identity();
  MatrixXd full = MatrixXd::Zero(3, n + 3);
  full.middleCols(columns[0].start, columns[0].size) = H.leftCols(columns[0].size);
  full.middleCols(columns[1].start, columns[1].size) = H.rightCols(columns[1].size);
  full.rightCols<3>() = H_f;
  const MatrixXd S = full * prior * full.transpose() + kVariance * MatrixXd::Identity(3, 3);
  const MatrixXd K = prior * full.transpose() * S.inverse();
  const MatrixXd posterior = prior - K * S * K.transpose();

  MapLandmark mark;
  mark.id = 7;
  mark.p_W = {1.0, 2.0, 3.0};
  ASSERT_TRUE(state.add_landmark(mark, H, H_f, r, kVariance));
  const Columns at = state.landmark_columns(0);
  EXPECT_LT(
      (state.covariance().block<3, 3>(at.start, at.start) - posterior.bottomRightCorner<3, 3>())
          .norm(),
      1e-4);
  EXPECT_LT(
      (state.covariance().block(at.start, 0, 3, at.start) - posterior.block(n, 0, 3, at.start))
          .norm(),
      1e-4);
  const Eigen::Index clones = state.size() - at.start - 3;
  EXPECT_LT((state.covariance().block(at.start, at.start + 3, 3, clones) -
             posterior.block(n, at.start, 3, clones))
                .norm(),
            1e-4);
  EXPECT_LT((state.landmarks()[0].p_W - mark.p_W - H_f.inverse() * r).norm(), 1e-12);
  state.drop_landmark(0);
  EXPECT_EQ(MatrixXd(state.covariance()), P);
}

TEST(Landmark, IsRefusedWhenItIsNotDetermined) {
  Random random(5);
  FilterState state = correlated(random);
  const auto columns = state.view_columns();
  const MatrixXd P = state.covariance();
  Eigen::Matrix3d H_f = Eigen::Matrix3d::Identity();
  H_f(2, 2) = 0.0;
  EXPECT_FALSE(state.add_landmark({}, MatrixXd::Zero(3, columns[0].size + columns[1].size), H_f,
                                  Vector3d::Zero(), 1e-4));
  EXPECT_EQ(MatrixXd(state.covariance()), P);
}

}  // namespace
}  // namespace dive::estimation
