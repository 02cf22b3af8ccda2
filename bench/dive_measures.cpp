#include "bench/dive_measures.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

#include "planning/world/primitives.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/drawn_world.h"

namespace dive::bench {
namespace {

planning::World diver_alone() {
  planning::World world;
  world.obstacles.push_back(vehicle::Diver::shape());
  return world;
}

}  // namespace

Distances::Distances(const RoutedSetup& setup, const mission::DiveSettings& settings)
    : to_world_(mission::simulated_world(setup.world, settings), setup.model.hull),
      to_diver_(diver_alone(), setup.model.hull) {}

void Distances::observe(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD) {
  to_world_.observe(truth.X_WB);
  if (X_WD) to_diver_.observe(X_WD->inverse() * truth.X_WB);
  now_ = {truth.X_WB, X_WD};
}

double Distances::to_diver_now_m() const {
  return now_.X_WD ? to_diver_.clearance(now_.X_WD->inverse() * now_.X_WB)
                   : to_diver_.min_clearance_m();
}

PositionErrors::PositionErrors(const mission::DiveSettings& settings)
    : world_from_map_(vehicle::drawn_map_motion(settings.conditions, settings.seed)) {}

void PositionErrors::observe(const estimation::StateEstimate& estimate,
                             const vehicle::GroundTruth& truth) {
  if (!estimate.valid) return;
  const Eigen::Vector2d error = (estimate.X_WB.p - world_from_map_ * truth.X_WB.p).head<2>();
  const Eigen::Matrix2d P = estimate.covariance.topLeftCorner<2, 2>();
  nees_ = error.dot(P.ldlt().solve(error));
  const Eigen::Vector2d in_map = (estimate.X_WB.p - truth.X_WB.p).head<2>();
  nees_in_map_ = in_map.dot(P.ldlt().solve(in_map));
  last_m_ = in_map.norm();
  errors_m_.push_back(last_m_);
}

double PositionErrors::p95_m() const {
  std::vector<double> sorted = errors_m_;
  std::ranges::sort(sorted);
  return sorted.empty() ? 0.0 : sorted[sorted.size() * 95 / 100];
}

NearestPasses::NearestPasses(const RoutedSetup& setup) : as_drawn_(setup.world, setup.model.hull) {}

void NearestPasses::observe(const mission::StepOutputs& out, const vehicle::GroundTruth& truth,
                            double min_to_world_m) {
  if (min_to_world_m >= nearest_.as_stands) return;
  nearest_ = {min_to_world_m,
              as_drawn_.clearance(truth.X_WB),
              as_drawn_.clearance(out.estimate.X_WB),
              out.status.clearance_m,
              out.status.cross_track_m,
              to_seconds(truth.utime)};
}

ObjectsInView::ObjectsInView(const mission::DiveSettings& settings)
    : camera_(settings.range_camera),
      q_CB_(from_rpy(0.0, -deg_to_rad(camera_.tilt_deg), 0.0)),
      seconds_(settings.unmapped.size(), 0.0) {
  for (const planning::Obstacle& object : settings.unmapped) {
    boxes_W_.push_back(planning::bounding_box(object));
    names_.push_back(object.name);
  }
}

void ObjectsInView::observe(const Pose& X_WB) {
  for (std::size_t i = 0; i < boxes_W_.size(); ++i) {
    if (is_in_view(boxes_W_[i], X_WB.inverse())) seconds_[i] += vehicle::Simulator::kTick;
  }
}

bool ObjectsInView::was_hidden(const std::string& name) const {
  const auto found = std::ranges::find(names_, name);
  return found != names_.end() && seconds_[static_cast<std::size_t>(found - names_.begin())] < 1.0;
}

bool ObjectsInView::is_in_view(const Eigen::AlignedBox3d& box_W, const Pose& X_BW) const {
  constexpr double kNear = 3.0;  // m
  const double wide = std::tan(0.5 * deg_to_rad(camera_.horizontal_deg));
  const double high = std::tan(0.5 * deg_to_rad(camera_.vertical_deg));
  const auto contains = [&](const Eigen::Vector3d& p_W) {
    const Eigen::Vector3d p_C = q_CB_ * (X_BW * p_W - camera_.origin_B);
    return p_C.norm() < kNear && std::abs(p_C.y()) < wide * p_C.x() &&
           std::abs(p_C.z()) < high * p_C.x();
  };
  for (int corner = 0; corner < 8; ++corner) {
    if (contains(box_W.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)))) return true;
  }
  return contains(box_W.center());
}

}  // namespace dive::bench
