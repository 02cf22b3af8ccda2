#include "estimation/visual_inertial/loop_closure/pose_graph.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "common/assert.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

// Lower bounds of the uncertainty of the motion between keyframes.
constexpr double kMinPositionSigma = 5e-4;  // m
constexpr double kMinHeadingSigma = 3e-5;   // rad
constexpr double kMinHeightSigma = 2e-3;    // m
constexpr int kMaxIterations = 20;
constexpr double kConverged = 1e-7;     // m and rad, the largest step
constexpr double kMaxCoordinate = 1e4;  // m

Matrix3d about_z(double turn) {
  return Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
}

Vector3d across(const Vector3d& d) { return {-d.y(), d.x(), 0.0}; }  // e_z x d

// The nearest covariance with no variance below the minimum, in units of the minimum.
Matrix4d at_least_least(const Matrix4d& growth) {
  const Vector4d least(kMinPositionSigma, kMinPositionSigma, kMinPositionSigma, kMinHeadingSigma);
  const Matrix4d scaled =
      least.cwiseInverse().asDiagonal() * growth * least.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix4d> eigen(0.5 * (scaled + scaled.transpose()));
  const Matrix4d& V = eigen.eigenvectors();
  const Matrix4d bounded = V * eigen.eigenvalues().cwiseMax(1.0).asDiagonal() * V.transpose();
  return least.asDiagonal() * bounded * least.asDiagonal();
}

}  // namespace

Matrix4d position_and_heading(const Matrix6d& covariance, const Eigen::Quaterniond& q_WB) {
  Eigen::Matrix<double, 4, 6> by_error = Eigen::Matrix<double, 4, 6>::Zero();
  by_error.topLeftCorner<3, 3>().setIdentity();
  by_error.block<1, 3>(3, 3) = q_WB.toRotationMatrix().row(2);
  return by_error * covariance * by_error.transpose();
}

Matrix4d carried(const Vector3d& d) {
  Matrix4d F = Matrix4d::Identity();
  F.topRightCorner<3, 1>() = across(d);
  return F;
}

Pose GraphNode::X_WB() const { return {p, Eigen::Quaterniond(about_z(turn)) * filter.q}; }

Pose GraphNode::correction() const {
  const Eigen::Quaterniond q(about_z(turn));
  return {p - q * filter.p, q};
}

Vector4d edge_residual(const GraphNode& from, const GraphNode& to, const GraphEdge& edge) {
  Vector4d r;
  r.head<3>() = about_z(from.turn).transpose() * (to.p - from.p) - edge.d;
  r[3] = wrap_angle(to.turn - from.turn - edge.turn);
  return r;
}

Matrix48d edge_jacobian(const GraphNode& from, const GraphNode& to) {
  const Matrix3d R = about_z(from.turn).transpose();
  Matrix48d J = Matrix48d::Zero();
  J.topLeftCorner<3, 3>() = -R;
  J.block<3, 1>(0, 3) = -R * across(to.p - from.p);
  J.block<3, 3>(0, 4) = R;
  J(3, 3) = -1.0;
  J(3, 7) = 1.0;
  return J;
}

/// H x = b for the steps of all nodes; the upper triangle of H, block by block.
struct PoseGraph::System {
  explicit System(std::size_t nodes) : b(Eigen::VectorXd::Zero(static_cast<int>(4 * nodes))) {}

  void add(std::size_t i, std::size_t j, const Matrix4d& block) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) {
        const int row = static_cast<int>(4 * i) + r;
        const int column = static_cast<int>(4 * j) + c;
        if (row <= column) entries.emplace_back(row, column, block(r, c));
      }
    }
  }
  [[nodiscard]] Eigen::SparseMatrix<double> matrix() const {
    Eigen::SparseMatrix<double> H(b.size(), b.size());
    H.setFromTriplets(entries.begin(), entries.end());
    return H;
  }

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b;
};

void PoseGraph::add(Utime utime, const Pose& filter, const Matrix4d& covariance) {
  DIVE_DEMAND(filter.is_finite() && covariance.allFinite());
  GraphNode node{utime, filter, covariance, filter.p, 0.0};
  if (!nodes_.empty()) {
    const GraphNode& last = nodes_.back();
    DIVE_DEMAND(utime > last.utime);
    GraphEdge edge;
    edge.from = nodes_.size() - 1;
    edge.to = nodes_.size();
    edge.d = filter.p - last.filter.p;
    const Matrix4d F = carried(edge.d);
    Matrix4d growth = covariance - F * last.covariance * F.transpose();
    if (has_depth_) {
      growth.row(2).setZero();
      growth.col(2).setZero();
      growth(2, 2) = kMinHeightSigma * kMinHeightSigma;
    }
    edge.covariance = at_least_least(growth);
    odometry_edges_.push_back(edge);
    const Pose X_WB = last.correction() * filter;
    node.p = X_WB.p;
    node.turn = last.turn;
  }
  nodes_.push_back(node);
}

void PoseGraph::add_edge(const GraphEdge& edge, System& system) const {
  const GraphNode& from = nodes_[edge.from];
  const GraphNode& to = nodes_[edge.to];
  const Matrix48d J = edge_jacobian(from, to);
  const Eigen::LLT<Matrix4d> noise(edge.covariance);
  const Matrix48d WJ = noise.solve(J);
  const Matrix8d H = J.transpose() * WJ;
  const Eigen::Matrix<double, 8, 1> b = -WJ.transpose() * edge_residual(from, to, edge);
  system.add(edge.from, edge.from, H.topLeftCorner<4, 4>());
  system.add(edge.to, edge.to, H.bottomRightCorner<4, 4>());
  if (edge.from < edge.to) {
    system.add(edge.from, edge.to, H.topRightCorner<4, 4>());
  } else {
    system.add(edge.to, edge.from, H.bottomLeftCorner<4, 4>());
  }
  system.b.segment<4>(static_cast<int>(4 * edge.from)) += b.head<4>();
  system.b.segment<4>(static_cast<int>(4 * edge.to)) += b.tail<4>();
}

// Anchors the first node at the filter's pose; with a depth sensor all heights at the filter's.
void PoseGraph::add_anchors(System& system) const {
  const GraphNode& first = nodes_.front();
  Vector4d off;
  off << first.p - first.filter.p, wrap_angle(first.turn);
  const Eigen::LLT<Matrix4d> known(at_least_least(first.covariance));
  system.add(0, 0, known.solve(Matrix4d::Identity()));
  system.b.head<4>() -= known.solve(off);
  if (!has_depth_) return;
  for (std::size_t i = 1; i < nodes_.size(); ++i) {
    const double weight =
        1.0 / std::max(nodes_[i].covariance(2, 2), kMinHeightSigma * kMinHeightSigma);
    Matrix4d height = Matrix4d::Zero();
    height(2, 2) = weight;
    system.add(i, i, height);
    system.b[static_cast<int>(4 * i) + 2] -= weight * (nodes_[i].p.z() - nodes_[i].filter.p.z());
  }
}

PoseGraph::System PoseGraph::linearise() const {
  System system(nodes_.size());
  add_anchors(system);
  for (const GraphEdge& edge : odometry_edges_) add_edge(edge, system);
  for (const GraphEdge& loop : loops_) add_edge(loop, system);
  return system;
}

bool PoseGraph::iterate() {
  const std::vector<GraphNode> before = nodes_;
  for (int i = 0; i < kMaxIterations; ++i) {
    const System system = linearise();
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper> llt(system.matrix());
    const Eigen::VectorXd step =
        llt.info() == Eigen::Success ? llt.solve(system.b).eval() : Eigen::VectorXd();
    if (step.size() == 0 || !step.allFinite() || step.cwiseAbs().maxCoeff() > kMaxCoordinate) break;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      nodes_[k].p += step.segment<3>(static_cast<int>(4 * k));
      nodes_[k].turn = wrap_angle(nodes_[k].turn + step[static_cast<int>(4 * k) + 3]);
    }
    if (step.cwiseAbs().maxCoeff() < kConverged) return true;
  }
  nodes_ = before;
  return false;
}

bool PoseGraph::drop_worst(double gate) {
  double worst = gate;
  std::size_t which = loops_.size();
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const GraphEdge& loop = loops_[i];
    const Vector4d r = edge_residual(nodes_[loop.from], nodes_[loop.to], loop);
    const double distance = r.dot(loop.covariance.llt().solve(r));
    if (distance <= worst) continue;
    worst = distance;
    which = i;
  }
  if (which == loops_.size()) return false;
  loops_.erase(loops_.begin() + static_cast<std::ptrdiff_t>(which));
  return true;
}

bool PoseGraph::optimise(double gate) {
  if (nodes_.size() < 2) return true;
  do {
    if (!iterate()) return false;
  } while (drop_worst(gate));
  return true;
}

// Combines the motion to the node and the motion from it; the second includes the heading error of
// the first.
void PoseGraph::remove(std::size_t node) {
  DIVE_DEMAND(node > 0 && node + 1 < nodes_.size());
  GraphEdge& before = odometry_edges_[node - 1];
  const GraphEdge& after = odometry_edges_[node];
  const Matrix4d F = carried(after.d);
  before.covariance = F * before.covariance * F.transpose() + after.covariance;
  before.d += after.d;
  const auto at = static_cast<std::ptrdiff_t>(node);
  odometry_edges_.erase(odometry_edges_.begin() + at);
  nodes_.erase(nodes_.begin() + at);
  for (std::size_t i = 0; i < odometry_edges_.size(); ++i) {
    odometry_edges_[i].from = i;
    odometry_edges_[i].to = i + 1;
  }
  std::erase_if(loops_,
                [&](const GraphEdge& loop) { return loop.from == node || loop.to == node; });
  for (GraphEdge& loop : loops_) {
    loop.from -= loop.from > node ? 1 : 0;
    loop.to -= loop.to > node ? 1 : 0;
  }
}

std::optional<Matrix8d> PoseGraph::joint_covariance(std::size_t i, std::size_t j) const {
  DIVE_DEMAND(i < nodes_.size() && j < nodes_.size());
  const System system = linearise();
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper> llt(system.matrix());
  if (llt.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(system.b.size(), 8);
  wanted.block<4, 4>(static_cast<int>(4 * i), 0).setIdentity();
  wanted.block<4, 4>(static_cast<int>(4 * j), 4).setIdentity();
  const Eigen::MatrixXd columns = llt.solve(wanted);
  if (!columns.allFinite()) return std::nullopt;
  Matrix8d joint;
  joint << columns.middleRows<4>(static_cast<int>(4 * i)),
      columns.middleRows<4>(static_cast<int>(4 * j));
  return 0.5 * (joint + joint.transpose());
}

}  // namespace dive::estimation
