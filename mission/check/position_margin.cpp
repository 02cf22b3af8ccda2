#include "mission/check/position_margin.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "common/assert.h"
#include "estimation/map_fix_filter.h"
#include "estimation/primitive.h"
#include "mission/check/route_times.h"
#include "mission/executive/position_priors.h"
#include "planning/certify/position_margin.h"
#include "planning/map_matching/expected_view.h"
#include "planning/world/overhead.h"
#include "planning/world/scene.h"

namespace dive::mission {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFixPeriod = 0.5;    // s between two fixes
constexpr double kViewMoved = 0.4;    // m after which the view is another
constexpr double kViewTurned = 0.25;  // rad

// What scans of the known map will say of the position along the route.
class RouteViews {
 public:
  explicit RouteViews(const planning::World& map) : view_(map) {}

  [[nodiscard]] const Matrix3d& information_at(const Pose& X_WB) {
    const bool is_new = !seen_from_ || (seen_from_->p - X_WB.p).norm() > kViewMoved ||
                        seen_from_->q.angularDistance(X_WB.q) > kViewTurned;
    if (is_new) {
      seen_from_ = X_WB;
      information_ = view_.information(X_WB);
    }
    return information_;
  }

 private:
  planning::ExpectedView view_;
  std::optional<Pose> seen_from_;
  Matrix3d information_ = Matrix3d::Zero();
};

// The position's covariance along the route: that of the filter of the fixes, or of dead reckoning
// from the start (estimation/primitive.h).
class Predicted {
 public:
  Predicted(const Mission& mission, const planning::World& map, const MotionModel& motion,
            const Vector3d& start_W)
      : mission_(mission) {
    const double start = std::hypot(mission.priors.start_m, mission.priors.map_m);
    reckoned_ = start * start * Matrix2d::Identity();
    if (!uses_map_fixes(mission)) return;
    filter_.emplace(map_fix_options(mission, motion));
    filter_->begin(start_W.head<2>(), start * start);
    views_.emplace(map);
  }

  // `moved` (m) over ground in `dt` (s), in water that flows with `current_W` (m/s).
  void advance(const Pose& to, const Vector2d& moved, double dt, const Vector2d& current_W) {
    displacement_ += moved - current_W * dt;
    elapsed_s_ += dt;
    if (!filter_) return;
    filter_->set_current(current_W);
    filter_->advance(moved, Vector2d::Zero(), dt, 0.0);
    MapFix fix;
    fix.position_W = filter_->position_W();
    fix.information = views_->information_at(to);
    static_cast<void>(filter_->apply(fix, Vector2d::Zero(), Vector2d::Zero()));
  }

  [[nodiscard]] Matrix2d covariance() const {
    if (filter_) return filter_->covariance_among_obstacles();
    const estimation::PrimitiveOptions options = odometry_options(mission_, {});
    const Vector2d along = options.speed_scale_sigma * displacement_;
    const Vector2d across = deg_to_rad(options.heading_bias_sigma_deg) *
                            Vector2d(-displacement_.y(), displacement_.x());
    const double walk = options.drift_m_per_sqrt_s * options.drift_m_per_sqrt_s * elapsed_s_ +
                        std::pow(options.current_sigma * elapsed_s_, 2);
    return reckoned_ + along * along.transpose() + across * across.transpose() +
           walk * Matrix2d::Identity();
  }

 private:
  const Mission& mission_;
  std::optional<estimation::MapFixFilter> filter_;
  std::optional<RouteViews> views_;
  Matrix2d reckoned_;
  Vector2d displacement_ = Vector2d::Zero();
  double elapsed_s_ = 0.0;
};

std::string remedy(const Mission& mission) {
  const std::string other = "add a goal or raise the clearance, so that the path leads elsewhere";
  if (uses_map_fixes(mission)) {
    return other + ", or lead it past surfaces on two sides that the range camera can observe";
  }
  return other +
         ", or let fixes correct the position: a range camera (fixes=\"on\"), or tags and "
         "cameras (estimator=\"visual_inertial\")";
}

}  // namespace

bool has_position_margins(const Mission& mission) {
  return !mission.unknown && (uses_map_fixes(mission) || !uses_visual_inertial(mission));
}

void predict_position_margins(const Route& route, std::vector<PlannedRouteLeg>& legs,
                              const Mission& mission, const planning::World& map,
                              const vehicle::Model& model) {
  DIVE_DEMAND(has_position_margins(mission));
  Predicted predicted(mission, map, model.motion, route.start.p);
  planning::Scene scene(map);
  planning::PositionMarginMeter meter(model.hull);
  const RouteTimes times = route_times(route, legs, mission);
  const double step_m = mission.speed.value * kFixPeriod;
  for (std::size_t l = 0; l < legs.size(); ++l) {
    LegMargin least;
    const std::vector<Pose>& path = legs[l].plan.waypoints;
    const std::vector<double>& waypoint_s = times.legs[l].waypoint_s;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double taken_s = waypoint_s[i] - waypoint_s[i - 1];
      const Vector2d current_W = mission.current.value.at(waypoint_s[i - 1]);
      const double length = (path[i].p - path[i - 1].p).norm();
      const int steps = std::max(1, static_cast<int>(std::ceil(length / step_m)));
      const Vector2d moved = (path[i].p - path[i - 1].p).head<2>() / steps;
      for (int k = 1; k <= steps; ++k) {
        const Pose X_WB = interpolate(path[i - 1], path[i], static_cast<double>(k) / steps);
        predicted.advance(X_WB, moved, taken_s / steps, current_W);
        meter.reduce(scene, X_WB, predicted.covariance(), least);
      }
    }
    const double dwell_s = route.legs[l].goal.dwell_s;
    if (!path.empty() && dwell_s > 0.0) {
      Pose X_WB = path.back();
      X_WB.q = from_rpy(0.0, 0.0, route.legs[l].dwell_yaw.value_or(to_rpy(X_WB.q).z()));
      for (double t = 0.0; t < dwell_s; t += kFixPeriod) {
        predicted.advance(X_WB, Vector2d::Zero(), kFixPeriod, Vector2d::Zero());
      }
      meter.reduce(scene, X_WB, predicted.covariance(), least);
    }
    if (least.obstacle >= 0) {
      least.obstacle_name = map.obstacles[static_cast<std::size_t>(least.obstacle)].name;
    }
    least.end_sigma_m = std::sqrt(
        Eigen::SelfAdjointEigenSolver<Matrix2d>(predicted.covariance()).eigenvalues().maxCoeff());
    legs[l].margin = least;
  }
}

void check_dead_reckoning(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                          const Mission& mission, const planning::World& map,
                          const planning::RobotHull& hull, Diagnostics& diagnostics) {
  const bool is_still = mission.current.value.is_still() && mission.priors.current == 0.0;
  if (!has_position_margins(mission) || uses_map_fixes(mission) || is_still) return;
  planning::OverheadIndex overheads(map);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const std::vector<Pose>& path = legs[i].plan.waypoints;
    const auto covered = std::ranges::find_if(
        path, [&](const Pose& X_WB) { return overheads.is_above(X_WB.p, hull.radius()); });
    if (covered == path.end()) continue;
    diagnostics.error(
        "CHK-NO-FIXES", mission.source, route.legs[i].span,
        fmt::format("the way to '{}' is under an overhead, at ({:.1f}, {:.1f}, {:.1f}), where "
                    "nothing corrects the position and an unknown current of {:g} m/s is expected",
                    legs[i].goal, covered->p.x(), covered->p.y(), covered->p.z(),
                    mission.priors.current),
        "let fixes correct the position: a range camera (fixes=\"on\"), or tags and cameras "
        "(estimator=\"visual_inertial\"); or declare still water: <current sigma=\"0\"/>");
  }
}

void check_position_margins(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                            const Mission& mission, Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const LegMargin& margin = legs[i].margin;
    if (margin.margin_sigma >= kSafeMargin) continue;
    const std::string message = fmt::format(
        "leg '{}': margin {:.1f} sigma, less than {:g}: at ({:.1f}, {:.1f}, {:.1f}) the path "
        "passes {} at {:.2f} m, and one sigma of the position is {:.2f} m",
        legs[i].goal, margin.margin_sigma,
        margin.margin_sigma < kLeastMargin ? kLeastMargin : kSafeMargin, margin.place_W.x(),
        margin.place_W.y(), margin.place_W.z(), margin.obstacle_name, margin.clearance_m,
        margin.sigma_m);
    if (margin.margin_sigma < kLeastMargin) {
      diagnostics.error("CHK-MARGIN", mission.source, route.legs[i].span, message, remedy(mission));
    } else {
      diagnostics.warning("CHK-MARGIN-SMALL", mission.source, route.legs[i].span, message,
                          remedy(mission));
    }
  }
}

}  // namespace dive::mission
