#include "estimation/visual_inertial/tags/tag_fix.h"

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "common/random.h"
#include "test/estimation/visual_inertial/filter/numeric_jacobian.h"
#include "test/estimation/visual_inertial/tags/tag_print.h"

namespace dive::estimation {
namespace {

using dive::testing::numeric_jacobian;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3d turned_by(const Vector3d& w) {
  const double angle = w.norm();
  if (angle == 0.0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

// Corners of a tag by hand, in pixels of unit focal length.
VectorXd look(const Pose& X_WB, const Pose& X_WT, double size, const Pose& X_BC) {
  VectorXd z(8);
  const double h = size / 2.0;
  const double xs[] = {-h, h, h, -h};
  const double ys[] = {-h, -h, h, h};
  for (int k = 0; k < 4; ++k) {
    const Vector3d p_W = X_WT.q.toRotationMatrix() * Vector3d(xs[k], ys[k], 0) + X_WT.p;
    const Vector3d p_B = X_WB.q.toRotationMatrix().transpose() * (p_W - X_WB.p);
    const Vector3d p_C = X_BC.q.toRotationMatrix().transpose() * (p_B - X_BC.p);
    z[2 * k] = p_C.x() / p_C.z();
    z[2 * k + 1] = p_C.y() / p_C.z();
  }
  return z;
}

Pose disturbed(const Pose& pose, const Vector3d& p, const Vector3d& turn_W) {
  return {pose.p + p, Eigen::Quaterniond(turned_by(turn_W) * pose.q.toRotationMatrix())};
}

// On a wall two metres ahead of the origin, facing the vehicle.
Tag tag_ahead(int id = 3, double y = 0.0) {
  Tag tag;
  tag.id = id;
  tag.size_m = 0.4;
  tag.X_WT = {{2.0, y, -3.0}, tag_attitude(std::acos(-1.0), 0.0, 0.0)};
  return tag;
}

StateEstimate estimate_at(Utime utime, const Pose& X_WB, double sigma_m, double sigma_heading) {
  StateEstimate estimate;
  estimate.utime = utime;
  estimate.valid = true;
  estimate.X_WB = X_WB;
  const Matrix3d R = X_WB.q.toRotationMatrix();
  estimate.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 0.03 * 0.03, 0, 0, 0;
  estimate.covariance.bottomRightCorner<3, 3>() =
      R.transpose() * Vector3d(1e-5, 1e-5, sigma_heading * sigma_heading).asDiagonal() * R;
  return estimate;
}

std::vector<DetectedTag> detected_from(const Pose& X_WB, const Tag& tag, Random& random,
                                       double px = 0.3) {
  const VectorXd z = look(X_WB, tag.X_WT, tag.size_m, testing::tag_camera().X_BC);
  DetectedTag detected;
  detected.id = tag.id;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto i = static_cast<Eigen::Index>(2 * k);
    detected.corners[k] = {z[i] + px / 240.0 * random.normal(),
                           z[i + 1] + px / 240.0 * random.normal()};
  }
  return {detected};
}

double heading_error(const Pose& truth, const Pose& estimate) {
  return to_rpy(truth.q * estimate.q.conjugate()).z();
}

const Pose kTruth{{0.1, 0.2, -3.1}, from_rpy(0.02, -0.03, 0.1)};

TEST(TagAttitude, DetectsATagWhereTheMissionHasIt) {
  const double quarter = std::acos(0.0);
  const Eigen::Matrix3d upright = tag_attitude(0.3, 0.0, 0.0).toRotationMatrix();
  EXPECT_LT((upright.col(2) + Vector3d(std::cos(0.3), std::sin(0.3), 0)).norm(), 1e-12);
  EXPECT_LT((upright.col(1) + Vector3d::UnitZ()).norm(), 1e-12) << "down";
  const Eigen::Matrix3d lying = tag_attitude(0.0, quarter, 0.0).toRotationMatrix();
  EXPECT_LT((lying.col(2) + Vector3d::UnitZ()).norm(), 1e-12) << "face up";
  EXPECT_LT((lying.col(1) - Vector3d::UnitX()).norm(), 1e-12) << "its top points backwards";
  const Eigen::Matrix3d turned = tag_attitude(0.0, 0.0, quarter).toRotationMatrix();
  EXPECT_LT((turned.col(0) + Vector3d::UnitZ()).norm(), 1e-12) << "clockwise: its right is below";
}

TEST(TagView, JacobiansAreThoseOfDifferences) {
  Random random(3);
  const Pose X_BC = testing::tag_camera().X_BC;
  for (int i = 0; i < 50; ++i) {
    const auto any = [&](double most) {
      return Vector3d(random.uniform(-most, most), random.uniform(-most, most),
                      random.uniform(-most, most));
    };
    const Pose X_WB = disturbed(kTruth, any(0.3), any(0.4));
    const Pose X_WT = disturbed(tag_ahead().X_WT, any(0.3), any(0.5));
    const auto view = view_tag(X_WB, X_WT, 0.4, X_BC);
    ASSERT_TRUE(view);
    EXPECT_LT((view->z - look(X_WB, X_WT, 0.4, X_BC)).norm(), 1e-12);
    const auto by_vehicle = numeric_jacobian(
        [&](const VectorXd& e) {
          return look(disturbed(X_WB, e.head<3>(), {0, 0, e[3]}), X_WT, 0.4, X_BC);
        },
        4);
    const auto by_tilt = numeric_jacobian(
        [&](const VectorXd& e) {
          return look(disturbed(X_WB, Vector3d::Zero(), {e[0], e[1], 0}), X_WT, 0.4, X_BC);
        },
        2);
    const auto by_tag = numeric_jacobian(
        [&](const VectorXd& e) {
          return look(X_WB, disturbed(X_WT, e.head<3>(), e.tail<3>()), 0.4, X_BC);
        },
        6);
    EXPECT_LT((view->by_vehicle - by_vehicle).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((view->by_tilt - by_tilt).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((view->by_tag - by_tag).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(TagFix, WithoutAnObservationNothingChanges) {
  TagFix fix({tag_ahead()}, testing::tag_camera(), {});
  const StateEstimate filter = estimate_at(1'000'000, kTruth, 0.3, 0.02);
  EXPECT_EQ(fix.add(filter, {}).result, TagResult::kNone);
  EXPECT_EQ(fix.apply(filter).X_WB.p, filter.X_WB.p);
  EXPECT_EQ(fix.apply(filter).covariance, filter.covariance);
}

TEST(TagFix, AFilterThatHasDriftedIsPutRight) {
  Random random(5);
  TagFix fix({tag_ahead()}, testing::tag_camera(), {});
  const Pose off = disturbed(kTruth, {0.5, -0.4, 0.0}, {0, 0, 0.05});
  const StateEstimate filter = estimate_at(1'000'000, off, 0.4, 0.04);
  const TagObservation observation = fix.add(filter, detected_from(kTruth, tag_ahead(), random));
  EXPECT_EQ(observation.result, TagResult::kUsed) << to_sentence(observation);
  EXPECT_NEAR(observation.correction_m, std::hypot(0.5, 0.4), 0.1);
  const StateEstimate put_right = fix.apply(filter);
  EXPECT_LT((put_right.X_WB.p - kTruth.p).head<2>().norm(), 0.1);
  EXPECT_LT(horizontal_sigma(put_right), 0.1);
  // The correction applies to later estimates: a metre on, turned.
  const Pose way{{1.0, 0.2, 0.0}, from_rpy(0, 0, 0.3)};
  StateEstimate later = estimate_at(4'000'000, off * way, 0.4, 0.04);
  EXPECT_LT((fix.apply(later).X_WB.p - (kTruth * way).p).head<2>().norm(), 0.15);
  EXPECT_EQ(fix.add(later, {}).result, TagResult::kNone);
  fix.restart();
  EXPECT_EQ(fix.apply(later).X_WB.p, later.X_WB.p)
      << "one that was initialised again began where it was put";
}

// Tags near their surveyed poses, a drifting filter, and observations on the path.
TEST(TagFix, ItsErrorIsAsLargeAsItsCovariance) {
  Random random(11);
  double nees = 0.0;
  double nees_heading = 0.0;
  int used = 0;
  int others = 0;
  constexpr int kRuns = 300;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Tag> known = {tag_ahead(3), tag_ahead(4, 0.8)};
    std::vector<Tag> real = known;
    const auto any = [&](double sigma) {
      return Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
    };
    for (Tag& tag : real) tag.X_WT = disturbed(tag.X_WT, any(tag.sigma_m), any(deg_to_rad(2.0)));
    TagFix fix(known, testing::tag_camera(), {});
    // The first error sets the filter's own frame in W; then the filter drifts.
    double sigma = 0.3;
    double sigma_heading = 0.03;
    Vector3d p_error(sigma * random.normal(), sigma * random.normal(), 0.03 * random.normal());
    double heading_off = sigma_heading * random.normal();
    Pose truth = kTruth;
    StateEstimate filter;
    for (int i = 0; i < 12; ++i) {
      const Utime utime = (i + 1) * 1'000'000;
      const Pose before = truth;
      truth = disturbed(truth, {0.03 * std::cos(i), 0.05, 0.0}, {0, 0, 0.01 * random.normal()});
      const Vector3d d = truth.p - before.p;
      p_error += Vector3d(-d.y(), d.x(), 0.0) * heading_off;
      p_error.head<2>() += Eigen::Vector2d(0.01 * random.normal(), 0.01 * random.normal());
      Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
      P.diagonal() << sigma * sigma, sigma * sigma, 9e-4, sigma_heading * sigma_heading;
      // The covariance of such an initialisation and such a drift.
      const Vector3d D = truth.p - kTruth.p;
      Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
      F(0, 3) = -D.y();
      F(1, 3) = D.x();
      P = F * P * F.transpose();
      P(0, 0) += 1e-4 * (i + 1);
      P(1, 1) += 1e-4 * (i + 1);
      const Vector3d tilt(0.003 * random.normal(), 0.003 * random.normal(), 0);
      const Pose pose = disturbed(truth, -p_error, -Vector3d(tilt.x(), tilt.y(), heading_off));
      filter = estimate_at(utime, pose, sigma, sigma_heading);
      const Matrix3d R_BW = pose.q.toRotationMatrix().transpose();
      filter.covariance.topLeftCorner<3, 3>() = P.topLeftCorner<3, 3>();
      filter.covariance.bottomRightCorner<3, 3>() =
          R_BW * Vector3d(9e-6, 9e-6, P(3, 3)).asDiagonal() * R_BW.transpose();
      filter.covariance.block<3, 3>(0, 3) = P.block<3, 1>(0, 3) * R_BW.col(2).transpose();
      filter.covariance.block<3, 3>(3, 0) = filter.covariance.block<3, 3>(0, 3).transpose();
      const Tag& tag = real[static_cast<std::size_t>(i % 2)];
      const TagObservation observation = fix.add(filter, detected_from(truth, tag, random));
      ++(observation.result == TagResult::kUsed ? used : others);
    }
    const StateEstimate last = fix.apply(filter);
    const Eigen::Vector2d error = (truth.p - last.X_WB.p).head<2>();
    nees += error.dot(last.covariance.topLeftCorner<2, 2>().inverse() * error) / kRuns;
    const Vector3d up_B = last.X_WB.q.conjugate() * Vector3d::UnitZ();
    const double variance = up_B.dot(last.covariance.bottomRightCorner<3, 3>() * up_B);
    nees_heading += std::pow(heading_error(truth, last.X_WB), 2) / variance / kRuns;
  }
  EXPECT_GT(used, 0.97 * (used + others)) << others;
  // Chi-square of two and of one. The assumed corner noise is larger than the actual one.
  EXPECT_LT(nees, 2.4);
  EXPECT_GT(nees, 1.0);
  EXPECT_LT(nees_heading, 1.25);
  EXPECT_GT(nees_heading, 0.4);
}

TEST(TagFix, ATagThatIsNotWhereTheMissionHasItIsRefused) {
  Random random(5);
  const StateEstimate filter = estimate_at(1'000'000, kTruth, 0.3, 0.03);
  const Vector3d typos[] = {{5, 0, 0}, {0, 5, 0}, {0, 0, 5}, {0, 0, -0.5}};
  for (const Vector3d& typo : typos) {
    Tag wrong = tag_ahead();
    wrong.X_WT.p += typo;
    TagFix fix({wrong}, testing::tag_camera(), {});
    for (int i = 0; i < 20; ++i) {
      StateEstimate now = filter;
      now.utime += i * 1'000'000;
      const TagObservation observation = fix.add(now, detected_from(kTruth, tag_ahead(), random));
      EXPECT_EQ(observation.result, TagResult::kRefused) << typo.transpose();
      EXPECT_NEAR(observation.correction_m, typo.head<2>().norm(), 0.5);
      EXPECT_EQ(fix.apply(now).X_WB.p, now.X_WB.p);
    }
  }
  Tag turned = tag_ahead();
  turned.X_WT.q = tag_attitude(0.5 * std::acos(-1.0), 0.0, 0.0);
  TagFix fix({turned}, testing::tag_camera(), {});
  EXPECT_EQ(fix.add(filter, detected_from(kTruth, tag_ahead(), random)).result,
            TagResult::kRefused);
}

TEST(TagFix, ReportsOfEachTagWhyItIsNotUsed) {
  Random random(5);
  const StateEstimate filter = estimate_at(1'000'000, kTruth, 0.3, 0.03);
  TagFix fix({tag_ahead(3)}, testing::tag_camera(), {});
  const auto result = [&](const std::vector<DetectedTag>& detected) {
    return fix.add(filter, detected).result;
  };

  EXPECT_EQ(result(detected_from(kTruth, tag_ahead(9), random)), TagResult::kUnknown);
  std::vector<DetectedTag> twice = detected_from(kTruth, tag_ahead(3), random);
  twice.push_back(detected_from(kTruth, tag_ahead(3, 0.8), random)[0]);
  EXPECT_EQ(result(twice), TagResult::kTwice);
  std::vector<DetectedTag> bent = detected_from(kTruth, tag_ahead(3), random);
  bent[0].corners[1] += Eigen::Vector2d(14.0, 9.0) / 240.0;
  EXPECT_EQ(result(bent), TagResult::kMisshapen);
  EXPECT_EQ(fix.apply(filter).X_WB.p, filter.X_WB.p);
  std::vector<DetectedTag> both = detected_from(kTruth, tag_ahead(9), random);
  both.push_back(detected_from(kTruth, tag_ahead(3), random)[0]);
  EXPECT_EQ(result(both), TagResult::kUnknown) << "the one that matters most";
  EXPECT_LT(horizontal_sigma(fix.apply(filter)), 0.1) << "and yet the other is used";
}

// From afar a vehicle with an unknown heading cannot resolve the tilt of a square: fixes that are
// used must still be right.
TEST(TagFix, RejectsASquareWithTwoPossiblePoses) {
  Random random(17);
  int used = 0;
  for (int i = 0; i < 200; ++i) {
    Tag tag = tag_ahead();
    tag.size_m = 0.25;
    tag.sigma_deg = 0.5;
    const double bearing = random.uniform(-0.5, 0.5);
    Pose truth;
    truth.q = from_rpy(0, 0, bearing);
    truth.p = tag.X_WT.p - truth.q * Vector3d(2.0, random.uniform(-0.3, 0.3), 0.0);
    TagFix fix({tag}, testing::tag_camera(), {});
    const Pose off = disturbed(truth, {1.0 * random.normal(), 1.0 * random.normal(), 0.0},
                               {0, 0, 0.5 * random.normal()});
    const StateEstimate filter = estimate_at(1'000'000, off, 1.0, 0.5);
    const TagObservation observation = fix.add(filter, detected_from(truth, tag, random));
    if (observation.result != TagResult::kUsed) continue;
    ++used;
    const StateEstimate after = fix.apply(filter);
    const Eigen::Vector2d error = (truth.p - after.X_WB.p).head<2>();
    const double distance = error.dot(after.covariance.topLeftCorner<2, 2>().inverse() * error);
    EXPECT_LT(distance, 20.0) << i;
  }
  EXPECT_GT(used, 10);
}

}  // namespace
}  // namespace dive::estimation
