#include "mission/executive/changed_map.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "planning/world/sounding.h"

namespace dive::mission {
namespace {

// Each stretch of so many poses has a budget of its own: a long way through narrow places must not
// pass for a blocked one because it was not judged to its end.
constexpr std::size_t kStretch = 6;
constexpr int kMaxEvaluations = 4000;  // of FCL, on the control thread
constexpr double kLeastCutoff = 0.01;  // m

}  // namespace

std::vector<planning::Obstacle> as_obstacles(std::span<const SeenObstacle> seen,
                                             std::size_t before) {
  std::vector<planning::Obstacle> obstacles;
  for (const SeenObstacle& one : seen) {
    obstacles.push_back({fmt::format("seen {}", ++before), planning::Box{one.size}, one.X_WO});
  }
  return obstacles;
}

ChangedMap::ChangedMap(const planning::World& world, const planning::RobotHull& hull,
                       double judged_m)
    : hull_(hull),
      hull_radius_(hull.radius()),
      judged_m_(judged_m),
      scene_(world),
      ceiling_(world),
      to_pieces_({}, hull) {}

void ChangedMap::add(std::span<const SeenObstacle> seen) {
  for (planning::Obstacle& obstacle : as_obstacles(seen, added_.obstacles.size())) {
    added_.obstacles.push_back(std::move(obstacle));
  }
  certifier_ = std::make_unique<planning::Certifier>(added_, hull_);
  added_scene_ = std::make_unique<planning::Scene>(added_);
  added_ceiling_.emplace(added_);
  changed_ = changed_ || !seen.empty();
}

bool ChangedMap::apply(const planning::MapUpdate& update) {
  if (!pieces_.apply(update)) return false;
  changed_ = changed_ || !update.cells.empty();
  return true;
}

bool ChangedMap::overhead(const Eigen::Vector3d& p_W, double margin) {
  const double radius = hull_radius_ + margin;
  return ceiling_.is_above(p_W, radius) ||
         (added_ceiling_ && added_ceiling_->is_above(p_W, radius)) || pieces_.is_above(p_W, radius);
}

std::optional<double> ChangedMap::ground_below(const Eigen::Vector3d& p_W) const {
  std::optional<double> ground = planning::ground_below(scene_, p_W);
  const auto take = [&ground](const std::optional<double>& other) {
    if (other && (!ground || *other > *ground)) ground = other;
  };
  if (added_scene_) take(planning::ground_below(*added_scene_, p_W));
  take(pieces_.ground_below(p_W));
  return ground;
}

double ChangedMap::clearance(std::span<const Pose> waypoints) {
  double clearance = std::numeric_limits<double>::infinity();
  if (waypoints.empty()) return clearance;
  if (certifier_) clearance = certifier_->certify(waypoints).clearance_m;
  if (pieces_.size() > 0) clearance = std::min(clearance, clearance_to_pieces(waypoints));
  return clearance;
}

double ChangedMap::clearance_to_pieces(std::span<const Pose> waypoints) {
  double clearance = judged_m_;
  for (std::size_t begin = 0;; begin += kStretch - 1) {
    const std::size_t size = std::min(kStretch, waypoints.size() - begin);
    clearance = std::min(clearance, clearance_of_stretch(waypoints.subspan(begin, size),
                                                         std::max(clearance, kLeastCutoff)));
    if (clearance <= 0.0 || begin + size == waypoints.size()) return clearance;
  }
}

// Up to `cutoff`, m: what is farther away than the worst so far does not count.
double ChangedMap::clearance_of_stretch(std::span<const Pose> waypoints, double cutoff) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(hull_radius_ + cutoff);
  planning::World near;
  pieces_.begin_collection();
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    Eigen::AlignedBox3d motion(waypoints[i].p);
    if (i > 0) motion.extend(waypoints[i - 1].p);
    pieces_.collect({motion.min() - reach, motion.max() + reach}, near.obstacles);
  }
  if (near.obstacles.empty()) return cutoff;
  planning::CertifyOptions options;
  options.cutoff = cutoff;
  options.max_evaluations = kMaxEvaluations;
  to_pieces_.reset(near, options);
  return to_pieces_.certify(waypoints).clearance_m;
}

}  // namespace dive::mission
