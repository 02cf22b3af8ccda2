#include "mission/executive/map_view.h"

#include <algorithm>
#include <array>
#include <limits>

#include "planning/world/primitives.h"
#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using planning::ObservedMap;

// Each stretch of so many poses has a budget of its own: a long path through narrow places must not
// pass for a blocked one because it was not evaluated to its end.
constexpr std::size_t kStretch = 6;
constexpr int kMaxEvaluations = 4000;  // of FCL, on the control thread
constexpr double kMinCutoff = 0.01;    // m
constexpr double kTouch = 1e-3;        // m: nearer is touching
constexpr double kRange = 200.0;       // m down to which the ground is searched

planning::CertifyOptions to_known_options(double cutoff) {
  return {.cutoff = cutoff, .max_evaluations = kMaxEvaluations};
}

// Height of one piece below p_W: down from the top of its box, in steps of its distance.
std::optional<double> top_below(const ObservedMap::Piece& piece, const Vector3d& p_W) {
  Vector3d at(p_W.x(), p_W.y(), std::min(p_W.z(), piece.box.max().z()));
  while (at.z() >= piece.box.min().z()) {
    const double distance = planning::signed_distance(piece.obstacle.shape, at);
    if (distance < kTouch) return at.z();
    at.z() -= distance;
  }
  return std::nullopt;
}

}  // namespace

MapView::MapView(const planning::World& world, const planning::RobotHull& hull,
                 double max_clearance_m)
    : known_(world),
      hull_radius_(hull.radius()),
      max_clearance_m_(max_clearance_m),
      scene_(world),
      ceiling_(world),
      to_observed_({}, hull),
      to_known_(world, hull, to_known_options(max_clearance_m)) {
  // The points of which a footprint of the largest piece may consist; see overhead.cpp.
  constexpr std::size_t kLines = planning::kMaxPieceVertices * planning::kMaxPieceVertices;
  scratch_.points.reserve(planning::kMaxPieceVertices + kLines + 2);
  scratch_.hull.reserve(planning::kMaxPieceVertices + kLines + 2);
}

bool MapView::update(const ObservedMap& observed) {
  if (observed.revision() == observed_.revision()) return false;
  const planning::AbsentObjects before = observed_.absent();
  observed_ = observed;
  if (before != observed_.absent()) take_absences(before);
  return true;
}

// Rare, and the only place where queries of the known map allocate.
void MapView::take_absences(const planning::AbsentObjects& before) {
  const planning::AbsentObjects& absent = observed_.absent();
  for (std::size_t i = 0; i < known_.obstacles.size(); ++i) {
    const int obstacle = static_cast<int>(i);
    if (before.contains(obstacle) == absent.contains(obstacle)) continue;
    std::erase_if(returned_, [&](const Returned& one) { return one.obstacle == obstacle; });
    if (absent.contains(obstacle)) continue;
    returned_.push_back({obstacle, planning::bounding_box(known_.obstacles[i])});
  }
  present_ = planning::without(known_, absent);
  scene_ = planning::Scene(present_);
  ceiling_ = planning::OverheadIndex(present_);
  to_known_.reset(present_, to_known_options(max_clearance_m_));
}

bool MapView::overhead(const Vector3d& p_W, double margin) {
  const double radius = hull_radius_ + margin;
  if (ceiling_.is_above(p_W, radius)) return true;
  const Vector3d reach(radius, radius, 0.0);
  const Vector3d surface_W(p_W.x(), p_W.y(), std::max(p_W.z(), 0.0));
  bool found = false;
  observed_.visit({p_W - reach, surface_W + reach}, [&](const ObservedMap::Piece& piece) {
    found = planning::is_above(piece.obstacle, p_W, radius, scratch_);
    return !found;
  });
  return found;
}

std::optional<double> MapView::ground_below(const Vector3d& p_W) const {
  std::optional<double> ground = planning::ground_below(scene_, p_W);
  const Vector3d touch(kTouch, kTouch, 0.0);
  const AlignedBox3d column(p_W - touch - Vector3d(0.0, 0.0, kRange), p_W + touch);
  observed_.visit(column, [&](const ObservedMap::Piece& piece) {
    if (ground && piece.box.max().z() <= *ground) return true;
    const std::optional<double> top = top_below(piece, p_W);
    if (top && (!ground || *top > *ground)) ground = top;
    return true;
  });
  return ground;
}

double MapView::clearance(std::span<const Pose> waypoints) {
  if (waypoints.empty() || (observed_.pieces() == 0 && returned_.empty()))
    return std::numeric_limits<double>::infinity();
  double clearance = max_clearance_m_;
  for (std::size_t begin = 0;; begin += kStretch - 1) {
    const std::size_t size = std::min(kStretch, waypoints.size() - begin);
    clearance = std::min(clearance, clearance_of_stretch(waypoints.subspan(begin, size),
                                                         std::max(clearance, kMinCutoff)));
    if (clearance <= 0.0 || begin + size == waypoints.size()) return clearance;
  }
}

double MapView::clearance_to_all(std::span<const Pose> waypoints) {
  const double observed_m = clearance(waypoints);
  return waypoints.empty() ? observed_m
                           : std::min(observed_m, to_known_.certify(waypoints).clearance_m);
}

// Up to `cutoff`, m: what is farther away than the worst so far does not count.
double MapView::clearance_of_stretch(std::span<const Pose> waypoints, double cutoff) {
  const Vector3d reach = Vector3d::Constant(hull_radius_ + cutoff);
  std::array<AlignedBox3d, kStretch> motions;
  AlignedBox3d around;
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    AlignedBox3d motion(waypoints[i].p);
    if (i > 0) motion.extend(waypoints[i - 1].p);
    motions[i] = {motion.min() - reach, motion.max() + reach};
    around.extend(motions[i]);
  }
  planning::World near;
  const auto is_near = [&](const AlignedBox3d& obstacle) {
    return std::ranges::any_of(std::span(motions).first(waypoints.size()),
                               [&](const AlignedBox3d& box) { return box.intersects(obstacle); });
  };
  observed_.visit(around, [&](const ObservedMap::Piece& piece) {
    if (is_near(piece.box)) near.obstacles.push_back(piece.obstacle);
    return true;
  });
  for (const auto& [obstacle, box] : returned_) {
    if (is_near(box)) {
      near.obstacles.push_back(known_.obstacles[static_cast<std::size_t>(obstacle)]);
    }
  }
  if (near.obstacles.empty()) return cutoff;
  planning::CertifyOptions options;
  options.cutoff = cutoff;
  options.max_evaluations = kMaxEvaluations;
  to_observed_.reset(near, options);
  return to_observed_.certify(waypoints).clearance_m;
}

}  // namespace dive::mission
