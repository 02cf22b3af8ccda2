#include "estimation/visual_inertial/loop_closure/pose_graph.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"
#include "estimation/visual_inertial/loop_closure/loop_correction.h"
#include "test/estimation/visual_inertial/filter/numeric_jacobian.h"

namespace dive::estimation {
namespace {

using dive::testing::numeric_jacobian;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGate = 16.25;
constexpr Utime kSecond = 1'000'000;

Vector3d normal3(Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  return {x, y, random.normal()};
}

Eigen::Quaterniond turned(double heading) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(heading, Vector3d::UnitZ()));
}

GraphNode random_node(Random& random) {
  GraphNode node;
  node.filter = {5.0 * normal3(random), so3_exp(normal3(random))};
  node.p = 5.0 * normal3(random);
  node.turn = random.uniform(-3.0, 3.0);
  return node;
}

void move(GraphNode& node, const VectorXd& by) {
  node.p += by.head<3>();
  node.turn += by[3];
}

TEST(PoseGraph, JacobianAgreesWithDifferences) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const GraphNode from = random_node(random);
    const GraphNode to = random_node(random);
    GraphEdge edge;
    edge.d = normal3(random);
    edge.turn = wrap_angle(to.turn - from.turn - random.uniform(-0.5, 0.5));
    const MatrixXd numeric = numeric_jacobian(
        [&](const VectorXd& by) {
          GraphNode a = from;
          GraphNode b = to;
          move(a, by.head<4>());
          move(b, by.tail<4>());
          return VectorXd(edge_residual(a, b, edge));
        },
        8);
    EXPECT_LT((edge_jacobian(from, to) - numeric).cwiseAbs().maxCoeff(), 1e-6);
  }
}

// The residual is zero if the relative pose equals the edge, compared as poses and not as numbers.
TEST(PoseGraph, ResidualIsThatOfPoses) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const GraphNode from = random_node(random);
    const GraphNode to = random_node(random);
    const Pose between = from.X_WB().inverse() * to.X_WB();
    GraphEdge edge;
    edge.d = from.filter.q * between.p;
    const Eigen::Matrix3d M =
        (from.filter.q * between.q * to.filter.q.conjugate()).toRotationMatrix();
    EXPECT_NEAR(M(2, 2), 1.0, 1e-9);  // roll and pitch are the filters'
    edge.turn = std::atan2(M(1, 0), M(0, 0));
    EXPECT_LT(edge_residual(from, to, edge).norm(), 1e-9);
    const Pose moved = from.correction() * from.filter;
    EXPECT_LT((moved.p - from.p).norm(), 1e-9);
    EXPECT_LT(angle_between(moved.q, from.X_WB().q), 1e-9);
  }
}

// Walks with noise in every step, and a filter's poses and covariances.
struct Walk {
  std::vector<Pose> truth;
  std::vector<Pose> filter;
  std::vector<Matrix4d> covariance;
};

// Around a square of 12 m by steps of 1 m, `laps` times.
Walk walk(Random& random, int laps, double step_sigma, double turn_sigma) {
  Walk result;
  Matrix4d P = Matrix4d::Identity() * 1e-6;
  Pose truth;
  Pose filter;
  const auto keep = [&] {
    result.truth.push_back(truth);
    result.filter.push_back(filter);
    result.covariance.push_back(P);
  };
  keep();
  for (int i = 0; i < 48 * laps; ++i) {
    const double turn = i % 12 == 11 ? M_PI / 2 : 0.0;
    truth = truth * Pose{{1, 0, 0}, turned(turn)};
    const Pose step{Vector3d(1, 0, 0) + step_sigma * normal3(random),
                    turned(turn + turn_sigma * random.normal())};
    const Vector3d d = filter.q * step.p;
    filter = filter * step;
    P = carried(d) * P * carried(d).transpose();
    P.diagonal().head<3>().array() += step_sigma * step_sigma;
    P(3, 3) += turn_sigma * turn_sigma;
    keep();
  }
  return result;
}

PoseGraph graph_of(const Walk& walk, bool has_depth = false) {
  PoseGraph graph(has_depth);
  for (std::size_t i = 0; i < walk.filter.size(); ++i) {
    graph.add(static_cast<Utime>(i) * kSecond, walk.filter[i], walk.covariance[i]);
  }
  return graph;
}

GraphEdge true_loop(const Walk& walk, std::size_t from, std::size_t to, double sigma,
                    Random& random) {
  GraphEdge loop;
  loop.from = from;
  loop.to = to;
  const Pose between = walk.truth[from].inverse() * walk.truth[to];
  loop.d = walk.filter[from].q * (between.p + sigma * normal3(random));
  loop.turn = to_rpy(walk.filter[from].q * between.q * walk.filter[to].q.conjugate()).z() +
              0.3 * sigma * random.normal();
  loop.covariance.diagonal() << sigma * sigma, sigma * sigma, sigma * sigma, 0.09 * sigma * sigma;
  return loop;
}

TEST(PoseGraph, WithoutLoopsItEqualsTheFilter) {
  Random random(3);
  const Walk way = walk(random, 1, 0.01, 0.003);
  PoseGraph graph = graph_of(way);
  ASSERT_TRUE(graph.optimise(kGate));
  for (const std::size_t i : {0U, 10U, 48U}) {
    EXPECT_LT((graph.nodes()[i].p - way.filter[i].p).norm(), 1e-6);
    const Matrix4d P = graph.joint_covariance(0, i)->bottomRightCorner<4, 4>();
    EXPECT_LT((P - way.covariance[i]).norm(), 1e-6 * (1.0 + way.covariance[i].norm()));
  }
}

// Over many walks: a smaller error at the end of the second lap, and one consistent with its
// covariance.
TEST(PoseGraph, ALoopRemovesDriftAndItsCovarianceIsConsistent) {
  Random random(4);
  double nees = 0.0;
  double before = 0.0;
  double after = 0.0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    const Walk way = walk(random, 2, 0.01, 0.004);
    PoseGraph graph = graph_of(way);
    const std::size_t last = way.truth.size() - 1;
    for (std::size_t i = 60; i < last; i += 6) {
      graph.add_loop(true_loop(way, i - 48, i, 0.02, random));
    }
    ASSERT_TRUE(graph.optimise(kGate));
    const GraphNode& end = graph.nodes()[last];
    const Matrix4d P = graph.joint_covariance(0, last)->bottomRightCorner<4, 4>();
    Vector4d error;
    error << way.truth[last].p - end.p,
        wrap_angle(to_rpy(way.truth[last].q).z() - to_rpy(end.X_WB().q).z());
    nees += error.dot(P.llt().solve(error)) / kRuns;
    before += (way.truth[last].p - way.filter[last].p).norm() / kRuns;
    after += error.head<3>().norm() / kRuns;
  }
  EXPECT_LT(after, 0.6 * before);
  EXPECT_GT(nees, 3.0);  // expected 4; the mean over 60 runs is within 0.72 in 95 of 100 cases
  EXPECT_LT(nees, 5.0);
}

// At the optimum no step of any node reduces the sum of squares, which is computed independently.
TEST(PoseGraph, EndsWhereTheSumOfSquaresIsLeast) {
  Random random(5);
  const Walk way = walk(random, 1, 0.02, 0.01);
  PoseGraph graph = graph_of(way, true);
  graph.add_loop(true_loop(way, 0, 47, 0.02, random));
  ASSERT_TRUE(graph.optimise(1e6));
  std::vector<GraphNode> nodes = graph.nodes();
  const auto cost = [&] {
    const GraphEdge& loop = graph.loops()[0];
    const Vector4d r = edge_residual(nodes[loop.from], nodes[loop.to], loop);
    double sum = r.dot(loop.covariance.inverse() * r);
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
      GraphEdge step;
      step.d = way.filter[i + 1].p - way.filter[i].p;
      Matrix4d Q =
          way.covariance[i + 1] - carried(step.d) * way.covariance[i] * carried(step.d).transpose();
      Q(2, 2) = 4e-6;
      const Vector4d e = edge_residual(nodes[i], nodes[i + 1], step);
      sum += e.dot(Q.inverse() * e);
      const double height = nodes[i + 1].p.z() - way.filter[i + 1].p.z();
      sum += height * height / std::max(way.covariance[i + 1](2, 2), 4e-6);
    }
    const GraphNode& first = nodes[0];
    Vector4d off;
    off << first.p - way.filter[0].p, first.turn;
    return sum + off.dot(way.covariance[0].inverse() * off);
  };
  const double least = cost();
  for (const std::size_t i : {1U, 20U, 47U, 48U}) {
    for (int k = 0; k < 4; ++k) {
      for (const double step : {-1e-3, 1e-3}) {
        const GraphNode kept = nodes[i];
        VectorXd by = VectorXd::Zero(4);
        by[k] = step;
        move(nodes[i], by);
        EXPECT_GT(cost(), least) << "node " << i << ", " << k;
        nodes[i] = kept;
      }
    }
  }
}

TEST(PoseGraph, DropsALoopThatDisagreesWithTheOthers) {
  Random random(6);
  const Walk way = walk(random, 2, 0.005, 0.001);
  PoseGraph graph = graph_of(way);
  for (std::size_t i = 50; i < 90; i += 5) graph.add_loop(true_loop(way, i - 48, i, 0.02, random));
  GraphEdge wrong = true_loop(way, 30, 78, 0.02, random);
  wrong.d.x() += 1.5;
  graph.add_loop(wrong);
  ASSERT_TRUE(graph.optimise(kGate));
  EXPECT_EQ(graph.loops().size(), 8U);
  for (const GraphEdge& loop : graph.loops()) EXPECT_NE(loop.from, 30U);
  EXPECT_LT((graph.nodes()[90].p - way.truth[90].p).norm(), 0.1);
}

TEST(PoseGraph, ForgettingANodeChangesNothingElse) {
  Random random(7);
  const Walk way = walk(random, 1, 0.01, 0.003);
  PoseGraph whole = graph_of(way);
  PoseGraph thin = whole;
  for (int i = 0; i < 20; ++i) thin.remove(5 + static_cast<std::size_t>(i % 3));
  const GraphEdge loop = true_loop(way, 2, 48, 0.02, random);
  whole.add_loop(loop);
  GraphEdge same = loop;
  same.to = thin.nodes().size() - 1;
  thin.add_loop(same);
  thin.add_loop({4, same.to, Vector3d::Zero(), 0.0, Matrix4d::Identity()});
  thin.remove(4);  // with its loop
  ASSERT_EQ(thin.loops().size(), 1U);
  ASSERT_TRUE(whole.optimise(kGate));
  ASSERT_TRUE(thin.optimise(kGate));
  // Not equal to the last digit: propagation uses the rotation as estimated by the filter.
  EXPECT_LT((whole.nodes().back().p - thin.nodes().back().p).norm(), 2e-3);
  EXPECT_LT((*whole.joint_covariance(0, 48) - *thin.joint_covariance(0, same.to - 1)).norm(),
            0.02 * whole.joint_covariance(0, 48)->norm());
}

TEST(PoseGraph, WithDepthHeightsStay) {
  Random random(8);
  const Walk way = walk(random, 1, 0.01, 0.003);
  PoseGraph graph(true);
  for (std::size_t i = 0; i < way.filter.size(); ++i) {
    Matrix4d P = way.covariance[i];
    P.row(2).setZero();
    P.col(2).setZero();
    P(2, 2) = 1e-4;
    graph.add(static_cast<Utime>(i) * kSecond, way.filter[i], P);
  }
  GraphEdge loop = true_loop(way, 0, 48, 0.02, random);
  loop.d.z() += 0.04;
  graph.add_loop(loop);
  ASSERT_TRUE(graph.optimise(kGate));
  for (std::size_t i = 0; i < way.filter.size(); ++i) {
    EXPECT_NEAR(graph.nodes()[i].p.z(), way.filter[i].p.z(), 0.03);
  }
}

LoopCorrection correction_at(const Pose& filter) {
  LoopCorrection correction;
  correction.utime = 10 * kSecond;
  correction.correction = {{1, 2, 0}, turned(0.5)};
  correction.filter = filter;
  correction.filter_covariance.diagonal() << 0.04, 0.04, 1e-4, 1e-3;
  correction.covariance.diagonal() << 0.001, 0.002, 1e-6, 1e-5;
  return correction;
}

StateEstimate estimate_with(const Pose& X_WB, const Matrix4d& P) {
  StateEstimate estimate;
  estimate.utime = 10 * kSecond;
  estimate.valid = true;
  estimate.X_WB = X_WB;
  const Eigen::Matrix3d R = X_WB.q.toRotationMatrix();
  Matrix6d all = Matrix6d::Zero();
  all.topLeftCorner<3, 3>() = P.topLeftCorner<3, 3>();
  all.diagonal().tail<3>() << 1e-5, 1e-5, P(3, 3);
  all.bottomRightCorner<3, 3>() = R.transpose() * all.bottomRightCorner<3, 3>() * R;
  all.topRightCorner<3, 3>() = P.topRightCorner<3, 1>() * Vector3d::UnitZ().transpose() * R;
  all.bottomLeftCorner<3, 3>() = all.topRightCorner<3, 3>().transpose();
  estimate.covariance = all;
  return estimate;
}

TEST(LoopCorrection, MovesThePoseAndTakesTheGraphsCovariance) {
  const Pose X{{3, 4, -5}, from_rpy(0.2, -1.2, 0.7)};
  const LoopCorrection correction = correction_at(X);
  const StateEstimate before = estimate_with(X, correction.filter_covariance);
  const StateEstimate after = correction.apply(before);
  EXPECT_LT((after.X_WB.p - correction.correction * X.p).norm(), 1e-12);
  EXPECT_LT(angle_between(after.X_WB.q, turned(0.5) * X.q), 1e-12);
  EXPECT_EQ(after.v_WB_B, before.v_WB_B);
  const Matrix4d P = position_and_heading(after.covariance, after.X_WB.q);
  EXPECT_NEAR(P(0, 0), 0.001, 1e-9);
  EXPECT_NEAR(P(1, 1), 0.002, 1e-9);
  EXPECT_NEAR(P(2, 2), 1e-4, 1e-9);  // the filter's: depth is measured
  EXPECT_NEAR(P(3, 3), 1e-5, 1e-9);
  EXPECT_EQ(after.covariance, after.covariance.transpose());
  EXPECT_GT(after.covariance.ldlt().vectorD().minCoeff(), 0.0);
}

TEST(LoopCorrection, GrowsAsTheFilterDoes) {
  const Pose X{{3, 4, -5}, from_rpy(0.0, 0.1, 0.7)};
  const LoopCorrection correction = correction_at(X);
  Matrix4d grown =
      carried({10, 0, 0}) * correction.filter_covariance * carried({10, 0, 0}).transpose();
  grown.diagonal() += Vector4d(0.003, 0.004, 0.0, 2e-5);
  const Pose later{X.p + Vector3d(10, 0, 0), X.q};
  const Matrix4d P = position_and_heading(correction.apply(estimate_with(later, grown)).covariance,
                                          turned(0.5) * later.q);
  EXPECT_NEAR(P(3, 3), 1e-5 + 2e-5, 1e-9);
  const Vector3d d = turned(0.5) * Vector3d(10, 0, 0);
  const Matrix4d Z = Vector4d(0.003, 0.004, 0.0, 0.0).asDiagonal();
  const Eigen::Matrix3d R = turned(0.5).toRotationMatrix();
  const Matrix4d carried_on = carried(d) * correction.covariance * carried(d).transpose();
  const Eigen::Matrix3d wanted =
      carried_on.topLeftCorner<3, 3>() + R * Z.topLeftCorner<3, 3>() * R.transpose();
  EXPECT_LT((P.topLeftCorner<2, 2>() - wanted.topLeftCorner<2, 2>()).norm(), 1e-6);
}

}  // namespace
}  // namespace dive::estimation
