#include "planning/warm_start/warm_start.h"

#include <algorithm>
#include <utility>

#include "planning/warm_start/bitrrt.h"
#include "planning/warm_start/free_space.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

// Start and goal are given: near them the required clearance is at most this share of theirs, so
// that the search can leave them.
constexpr double kShare = 0.9;

// Distance around start and goal within which the whole map is searched, or their distance if that
// is more: distant geometry is no reason for a coarse search here.
constexpr double kDetour = 200.0;  // m

// Spacing at which shortening tries to cut corners, m.
constexpr double kShortenSpacing = 0.5;

}  // namespace

struct WarmStart::Impl {
  Scene scene;
  Eigen::AlignedBox3d map;
  WarmStartOptions options;

  [[nodiscard]] Eigen::AlignedBox3d region(Eigen::AlignedBox3d around, const Vector3d& start_W,
                                           const Vector3d& goal_W) const;
  [[nodiscard]] Eigen::AlignedBox3d map_about(const Vector3d& start_W,
                                              const Vector3d& goal_W) const;
};

Eigen::AlignedBox3d WarmStart::Impl::map_about(const Vector3d& start_W,
                                               const Vector3d& goal_W) const {
  const Vector3d detour = Vector3d::Constant(std::max(kDetour, (goal_W - start_W).norm()));
  Eigen::AlignedBox3d ends(start_W);
  ends.extend(goal_W);
  const Eigen::AlignedBox3d about(ends.min() - detour, ends.max() + detour);
  return about.intersects(map) ? about.intersection(map) : Eigen::AlignedBox3d();
}

// `around`, enlarged by the margin and cut to the depth limits, but containing start and goal.
Eigen::AlignedBox3d WarmStart::Impl::region(Eigen::AlignedBox3d around, const Vector3d& start_W,
                                            const Vector3d& goal_W) const {
  around.extend(start_W).extend(goal_W);
  const Vector3d margin = Vector3d::Constant(options.margin);
  Vector3d low = around.min() - margin;
  Vector3d high = around.max() + margin;
  const double top = std::min(options.limits.max_z, -options.limits.clearance);
  low.z() = std::min({std::max(low.z(), options.limits.min_z), start_W.z(), goal_W.z()});
  high.z() = std::max({std::min(high.z(), top), start_W.z(), goal_W.z()});
  return {low, high};
}

WarmStart::WarmStart(const World& world, WarmStartOptions options)
    : WarmStart(Scene(world), world.bounds(), options) {}
WarmStart::WarmStart(Scene scene, const Eigen::AlignedBox3d& bounds_W, WarmStartOptions options)
    : impl_(new Impl{std::move(scene), bounds_W, options}) {}

void WarmStart::set_options(const WarmStartOptions& options) { impl_->options = options; }

WarmStart::WarmStart(WarmStart&&) noexcept = default;
WarmStart::~WarmStart() = default;

std::optional<std::vector<Vector3d>> WarmStart::plan(
    const Vector3d& start_W, const Vector3d& goal_W,
    const std::vector<VirtualObstacle>& virtual_obstacles, double spacing, std::uint64_t seed) {
  const double clearance =
      std::min(impl_->scene.point_distance(start_W), impl_->scene.point_distance(goal_W));
  if (clearance <= 0.0) return std::nullopt;
  const double radius = std::min(impl_->options.check_radius, kShare * clearance);

  std::vector<VirtualObstacle> balls = virtual_obstacles;
  for (VirtualObstacle& ball : balls) {
    const double nearest =
        std::min((ball.centre_W - start_W).norm(), (ball.centre_W - goal_W).norm());
    ball.radius = std::min(ball.radius, kShare * nearest);
  }
  const FreeSpace space(impl_->scene, radius, std::move(balls));

  BiTrrtQuery query;
  query.start_W = start_W;
  query.goal_W = goal_W;
  query.preferred_slack = std::max(impl_->options.preferred_clearance - radius, 0.0);
  query.max_iterations = impl_->options.max_iterations / 2;
  query.seed = seed;
  query.region = impl_->region({}, start_W, goal_W);
  auto path = bitrrt(space, query);
  if (!path) {
    query.region = impl_->region(impl_->map_about(start_W, goal_W), start_W, goal_W);
    path = bitrrt(space, query);
  }
  if (!path) return std::nullopt;
  return resample(shorten(space, *path, kShortenSpacing), spacing);
}

std::optional<WidestPath> WarmStart::widest(const Vector3d& start_W, const Vector3d& goal_W,
                                            double enough, double spacing) const {
  WidestPathQuery query;
  query.start_W = start_W;
  query.goal_W = goal_W;
  query.region = impl_->region(impl_->map_about(start_W, goal_W), start_W, goal_W);
  query.enough = enough;
  auto path = widest_path(impl_->scene, query);
  if (!path) return std::nullopt;
  const double clearance = std::min(
      {path->radius, impl_->scene.point_distance(start_W), impl_->scene.point_distance(goal_W)});
  const FreeSpace space(impl_->scene, kShare * clearance, {});
  path->positions = resample(shorten(space, path->positions, kShortenSpacing), spacing);
  return path;
}

}  // namespace dive::planning
