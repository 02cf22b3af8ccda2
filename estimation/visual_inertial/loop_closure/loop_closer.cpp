#include "estimation/visual_inertial/loop_closure/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "common/assert.h"
#include "common/range_check.h"

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

constexpr double kMaxUncertainty = 5.0;  // m: beyond it any place could be any other
constexpr std::size_t kPatience = 3;     // keyframes for which a closure waits for confirmation
constexpr double kTiltSigma = 0.005;     // rad, of the filter's roll and pitch

double heading_of(const Matrix3d& M) { return std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1)); }

// Covariance of (p, rotation on the right), converted from the cameras to the body.
Matrix6d in_body(const Matrix6d& covariance, const Pose& X_C0C1, const Pose& X_BC) {
  const Matrix3d R_BC = X_BC.q.toRotationMatrix();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = R_BC;
  J.topRightCorner<3, 3>() = -R_BC * X_C0C1.q.toRotationMatrix() * skew(X_BC.inverse().p);
  J.bottomRightCorner<3, 3>() = R_BC;
  return J * covariance * J.transpose();
}

PlanarTransform planar(const Pose& about_vertical) {
  return {to_rpy(about_vertical.q).z(), about_vertical.p.head<2>()};
}

double mahalanobis(const Vector4d& r, const Matrix4d& S) { return r.dot(S.llt().solve(r)); }

}  // namespace

std::string LoopCloserOptions::validate() const {
  RangeCheck check;
  check("keyframe_m", keyframe_m, 0.01, 100);
  check("keyframe_deg", keyframe_deg, 1, 180);
  check("max_keyframes", max_keyframes, 3, kMaxMapCorrectionNodes);
  check("min_gap_s", min_gap_s, 0, 1e6);
  check("view_m", view_m, 0, 100);
  check("view_deg", view_deg, 0, 180);
  check("likeness_points", likeness_points, 1, 10'000);
  check("min_matches", min_matches, 0, likeness_points);
  check("max_bits", max_bits, 0, 256);
  check("max_candidates", max_candidates, 1, 1000);
  check("min_points", min_points, 6, 10'000);
  check("min_share", min_share, 0, 1);
  check("min_cells", min_cells, 1, 12);
  check("pixels_then", pixels_then, 0.01, 20);
  check("pixels_now", pixels_now, 0.01, 20);
  check("optimism", optimism, 0.1, 100);
  check("min_sigma_m", min_sigma_m, 1e-4, 10);
  check("min_sigma_deg", min_sigma_deg, 1e-3, 45);
  check("tilt_deg", tilt_deg, 0.01, 90);
  check("gate", gate, 0.1, 1000);
  check("min_move_m", min_move_m, 0, 100);
  return check.problem();
}

bool LoopCloserOptions::is_far(const Pose& last, const Pose& now) const {
  return (now.p - last.p).norm() >= keyframe_m ||
         rad_to_deg(angle_between(now.q, last.q)) >= keyframe_deg;
}

LoopCloser::LoopCloser(LoopCloserOptions options, const CameraModel& left, const CameraModel& right)
    : options_(options),
      X_BC_(left.X_BC),
      X_RL_(right.X_BC.inverse() * left.X_BC),
      graph_(options.has_depth) {
  DIVE_DEMAND(options.validate().empty() && left.validate().empty() && right.validate().empty());
  relative_.cameras = {left, right};
  relative_.pixels_then = options.pixels_then;
  relative_.pixels_now = options.pixels_now;
  relative_.min_points = options.min_points;
  relative_.min_share = options.min_share;
  relative_.min_cells = options.min_cells;
}

bool LoopCloser::is_due(const StateEstimate& filter) const {
  if (!filter.valid || !filter.X_WB.is_finite() || !filter.covariance.allFinite()) return false;
  if (graph_.nodes().empty()) return true;
  const GraphNode& last = graph_.nodes().back();
  if (filter.utime <= last.utime) return false;
  return options_.is_far(last.filter, filter.X_WB);
}

void LoopCloser::calibrate(const Pose& X_BL, const Pose& X_BR) {
  DIVE_DEMAND(X_BL.is_finite() && X_BR.is_finite());
  X_BC_ = X_BL;
  X_RL_ = X_BR.inverse() * X_BL;
}

void LoopCloser::restart() {
  graph_ = PoseGraph(options_.has_depth);
  views_.clear();
  applied_.clear();
  pending_.reset();
  report_ = {};
}

std::optional<LoopCorrection> LoopCloser::add(KeyframeView view, const StateEstimate& filter) {
  if (!is_due(filter)) return std::nullopt;
  graph_.add(filter.utime, filter.X_WB, position_and_heading(filter.covariance, filter.X_WB.q));
  views_.push_back(std::move(view));
  applied_.push_back(applied_.empty() ? Pose{} : applied_.back());
  drop_one();
  report_ = {};
  report_.keyframes = static_cast<int>(views_.size());
  const std::optional<Closing> found = recognise();
  if (!found) return std::nullopt;
  return close(*found);
}

// Nodes near and similarly oriented, by the graph; of them, the similar ones, the most similar
// first.
std::vector<std::size_t> LoopCloser::candidates() const {
  const auto& nodes = graph_.nodes();
  const GraphNode& now = nodes.back();
  const auto joint = graph_.joint_covariance(0, nodes.size() - 1);
  if (!joint) return {};
  const Matrix4d own = joint->bottomRightCorner<4, 4>();
  const double sigma = std::sqrt(std::max(own(0, 0) + own(1, 1), 0.0));
  const double far = options_.view_m + 2.0 * std::min(sigma, kMaxUncertainty);
  const double turned = deg_to_rad(options_.view_deg) + 2.0 * std::sqrt(std::max(own(3, 3), 0.0));
  const Utime latest = now.utime - from_seconds(options_.min_gap_s);
  std::vector<std::pair<int, std::size_t>> alike;
  for (std::size_t i = 0; i < nodes.size() && nodes[i].utime <= latest; ++i) {
    if ((nodes[i].p - now.p).norm() > far) continue;
    if (angle_between(nodes[i].X_WB().q, now.X_WB().q) > turned) continue;
    const int count =
        likeness(views_.back(), views_[i], static_cast<std::size_t>(options_.likeness_points),
                 options_.max_bits);
    if (count >= options_.min_matches) alike.emplace_back(-count, i);
  }
  std::sort(alike.begin(), alike.end());
  if (alike.size() > static_cast<std::size_t>(options_.max_candidates)) {
    alike.resize(static_cast<std::size_t>(options_.max_candidates));
  }
  std::vector<std::size_t> result;
  result.reserve(alike.size());
  for (const auto& [count, i] : alike) result.push_back(i);
  return result;
}

LoopCloser::Closing LoopCloser::closing(std::size_t old, const RelativePose& relative) const {
  const GraphNode& then = graph_.nodes()[old];
  const GraphNode& now = graph_.nodes().back();
  Closing result;
  LoopClosure& closure = result.closure;
  closure.utime_old = then.utime;
  closure.utime_new = now.utime;
  closure.X_B0B1 = X_BC_ * relative.X_C0C1 * X_BC_.inverse();
  closure.covariance =
      options_.optimism * options_.optimism * in_body(relative.covariance, relative.X_C0C1, X_BC_);
  const double least_turn = deg_to_rad(options_.min_sigma_deg);
  closure.covariance.diagonal().head<3>().array() += std::pow(options_.min_sigma_m, 2);
  closure.covariance.diagonal().tail<3>().array() += least_turn * least_turn;
  closure.points = relative.points;

  const Matrix3d R_0 = then.filter.q.toRotationMatrix();
  const Matrix3d R_1 = now.filter.q.toRotationMatrix();
  GraphEdge& edge = result.edge;
  edge.from = old;
  edge.to = graph_.nodes().size() - 1;
  edge.d = R_0 * closure.X_B0B1.p;
  edge.turn = heading_of(R_0 * closure.X_B0B1.q.toRotationMatrix() * R_1.transpose());
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<3, 3>() = R_0;
  J.bottomRightCorner<1, 3>() = R_1.row(2);
  edge.covariance = J * closure.covariance * J.transpose();
  // The filter's roll and pitch then rotate d.
  edge.covariance.topLeftCorner<3, 3>().diagonal().array() +=
      std::pow(kTiltSigma, 2) * edge.d.squaredNorm();
  return result;
}

bool LoopCloser::has_right_tilt(const Closing& found) const {
  const Eigen::Quaterniond& q_0 = graph_.nodes()[found.edge.from].filter.q;
  const Eigen::Quaterniond& q_1 = graph_.nodes()[found.edge.to].filter.q;
  const Vector3d up = q_0 * (found.closure.X_B0B1.q * (q_1.conjugate() * Vector3d::UnitZ()));
  return up.z() > std::cos(deg_to_rad(options_.tilt_deg));
}

bool LoopCloser::passes_gate(const Closing& found) const {
  const GraphEdge& edge = found.edge;
  const auto joint = graph_.joint_covariance(edge.from, edge.to);
  if (!joint) return false;
  const GraphNode& from = graph_.nodes()[edge.from];
  const GraphNode& to = graph_.nodes()[edge.to];
  const Matrix48d J = edge_jacobian(from, to);
  const Matrix4d S = J * *joint * J.transpose() + edge.covariance;
  return mahalanobis(edge_residual(from, to, edge), S) <= options_.gate;
}

std::optional<LoopCloser::Closing> LoopCloser::verify(std::size_t old) {
  const auto matches = match(views_[old], views_.back(), options_.max_bits);
  const auto relative = relative_pose(views_[old], views_.back(), matches, X_RL_, relative_);
  if (!relative) return std::nullopt;
  ++report_.verified;
  Closing found = closing(old, *relative);
  if (has_right_tilt(found) && passes_gate(found)) return found;
  ++report_.refused;
  return std::nullopt;
}

// True if b agrees with a, propagated by the filter's motion. Compared as the correction of the
// filter's pose at the later of the two.
bool LoopCloser::agree(const Closing& a, const Closing& b) const {
  const auto& nodes = graph_.nodes();
  const auto where = [&](const Closing& c) {
    const GraphNode& from = nodes[c.edge.from];
    const GraphNode& to = nodes[c.edge.to];
    GraphNode implied = to;
    implied.turn = wrap_angle(from.turn + c.edge.turn);
    implied.p = from.p + Eigen::AngleAxisd(from.turn, Vector3d::UnitZ()) * c.edge.d;
    const Pose there = implied.correction() * nodes.back().filter;
    Vector4d at;
    at << there.p, implied.turn;
    return at;
  };
  Vector4d off = where(a) - where(b);
  off[3] = wrap_angle(off[3]);
  const Vector3d moved = nodes.back().filter.p - nodes[a.edge.to].filter.p;
  const Matrix4d F = carried(moved);
  Matrix4d S = F * a.edge.covariance * F.transpose() + b.edge.covariance;
  // Their two old places are some distance apart, and so are the two keyframes.
  for (const auto& [i, j] :
       {std::pair(a.edge.from, b.edge.from), std::pair(a.edge.to, b.edge.to)}) {
    if (i == j) continue;
    const auto joint = graph_.joint_covariance(i, j);
    if (!joint) return false;
    const Matrix48d J = edge_jacobian(nodes[i], nodes[j]);
    S += J * *joint * J.transpose();
  }
  return mahalanobis(off, S) <= options_.gate;
}

std::optional<LoopCloser::Closing> LoopCloser::recognise() {
  std::vector<Closing> found;
  const std::vector<std::size_t> places = candidates();
  report_.candidates = static_cast<int>(places.size());
  for (const std::size_t place : places) {
    if (auto one = verify(place)) found.push_back(std::move(*one));
  }
  if (found.empty()) return std::nullopt;
  const auto best = std::max_element(
      found.begin(), found.end(),
      [](const Closing& a, const Closing& b) { return a.closure.points < b.closure.points; });
  report_.is_ambiguous = std::any_of(found.begin(), found.end(), [&](const Closing& other) {
    return &other != &*best && !agree(other, *best);
  });
  if (report_.is_ambiguous) return std::nullopt;
  return *best;
}

std::optional<LoopCorrection> LoopCloser::close(const Closing& found) {
  const bool is_said_before =
      pending_ && found.edge.to - pending_->edge.to <= kPatience && agree(*pending_, found);
  const std::optional<Closing> before = std::exchange(pending_, found);
  if (!is_said_before) {
    report_.is_waiting = true;
    return std::nullopt;
  }
  const auto& loops = graph_.loops();
  const bool is_in = std::any_of(loops.begin(), loops.end(),
                                 [&](const GraphEdge& loop) { return loop.to == before->edge.to; });
  const PoseGraph untouched = graph_;
  if (!is_in) graph_.add_loop(before->edge);
  graph_.add_loop(found.edge);
  const auto joint = graph_.optimise(options_.gate)
                         ? graph_.joint_covariance(0, graph_.nodes().size() - 1)
                         : std::nullopt;
  const MapCorrection moved = map_correction();
  if (!joint || !is_well_formed(moved)) {
    graph_ = untouched;
    pending_.reset();
    return std::nullopt;
  }
  LoopCorrection result;
  const GraphNode& now = graph_.nodes().back();
  result.closure = found.closure;
  result.closures = static_cast<int>(graph_.loops().size());
  result.utime = now.utime;
  if (largest_move() >= options_.min_move_m) {
    result.map_correction = moved;
    std::ranges::transform(graph_.nodes(), applied_.begin(), &GraphNode::correction);
  }
  result.correction = applied_.back();
  result.filter = now.filter;
  result.filter_covariance = now.covariance;
  result.covariance = joint->bottomRightCorner<4, 4>();
  const double not_applied = (result.correction * now.filter.p - now.p).head<2>().norm();
  result.covariance.diagonal().head<2>().array() += not_applied * not_applied;
  result.has_depth = options_.has_depth;
  return result;
}

// From where the keyframes were placed to where the graph has them.
MapCorrection LoopCloser::map_correction() const {
  MapCorrection moved;
  for (std::size_t i = 0; i < applied_.size(); ++i) {
    const GraphNode& node = graph_.nodes()[i];
    moved.nodes.push_back({node.utime, planar(node.correction() * applied_[i].inverse())});
  }
  return moved;
}

// m, horizontally, of a keyframe from where it was placed.
double LoopCloser::largest_move() const {
  double largest = 0.0;
  for (std::size_t i = 0; i < applied_.size(); ++i) {
    const GraphNode& node = graph_.nodes()[i];
    largest = std::max(largest, (node.p - applied_[i] * node.filter.p).head<2>().norm());
  }
  return largest;
}

// Drops the keyframe whose neighbours are nearest to each other; not one of a loop, if there is
// another, and not one of the last few.
void LoopCloser::drop_one() {
  if (views_.size() <= static_cast<std::size_t>(options_.max_keyframes)) return;
  const auto& nodes = graph_.nodes();
  std::size_t which = 1;
  std::pair<bool, double> least(true, 1e9);
  const std::size_t end = nodes.size() > kPatience + 3 ? nodes.size() - kPatience - 1 : 2;
  for (std::size_t i = 1; i < end; ++i) {
    const bool has_loop =
        std::any_of(graph_.loops().begin(), graph_.loops().end(),
                    [&](const GraphEdge& loop) { return loop.from == i || loop.to == i; });
    const std::pair<bool, double> worth(has_loop, (nodes[i + 1].p - nodes[i - 1].p).norm());
    if (worth >= least) continue;
    least = worth;
    which = i;
  }
  graph_.remove(which);
  views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(which));
  applied_.erase(applied_.begin() + static_cast<std::ptrdiff_t>(which));
  if (!pending_) return;
  for (std::size_t* end_of : {&pending_->edge.from, &pending_->edge.to}) {
    if (*end_of == which) {
      pending_.reset();
      return;
    }
    *end_of -= *end_of > which ? 1 : 0;
  }
}

}  // namespace dive::estimation
