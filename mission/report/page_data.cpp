#include "mission/report/page_data.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include "mission/drawing/drawn_mesh.h"
#include "mission/report/packed.h"
#include "vehicle/convex_hull.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxTriangles = 120'000;
constexpr double kOutlineTolerance = 0.01;  // m
constexpr double kUnitScale = 32767.0;      // of quaternions as 16-bit integers

Json to_json(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Json to_json(const Pose& pose) {
  return {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()};
}

Json pack_points(const std::vector<Eigen::Vector3d>& points) {
  std::vector<float> values;
  for (const Eigen::Vector3d& p : points) {
    for (const double x : p) values.push_back(static_cast<float>(x));
  }
  return packed(values);
}

Json pack_poses(const std::vector<Pose>& poses) {
  std::vector<float> values;
  for (const Pose& pose : poses) {
    for (const double x : pose.p) values.push_back(static_cast<float>(x));
    for (const double x : pose.q.coeffs()) values.push_back(static_cast<float>(x));
  }
  return packed(values);
}

Json to_json(const DrawnMesh& mesh) {
  std::vector<float> vertices;
  for (const Eigen::Vector3f& p : mesh.vertices)
    vertices.insert(vertices.end(), p.begin(), p.end());
  std::vector<std::uint32_t> triangles;
  for (const auto& corners : mesh.triangles) {
    triangles.insert(triangles.end(), corners.begin(), corners.end());
  }
  Json parts = Json::array();
  for (const DrawnMesh::Part& part : mesh.parts) {
    parts.push_back({{"name", part.name}, {"triangles", part.triangles}});
  }
  return {{"vertices", packed(vertices)},
          {"triangles", packed(triangles)},
          {"parts", std::move(parts)}};
}

/// Null for a polytope, which is a part of the map's mesh.
struct ShapeToJson {
  Json operator()(const planning::Box& box) const {
    return {{"type", "box"}, {"size", to_json(box.size)}};
  }
  Json operator()(const planning::Cylinder& cylinder) const {
    return {{"type", "cylinder"}, {"radius", cylinder.radius}, {"length", cylinder.length}};
  }
  Json operator()(const planning::Sphere& sphere) const {
    return {{"type", "sphere"}, {"radius", sphere.radius}};
  }
  Json operator()(const planning::Capsule& capsule) const {
    return {{"type", "capsule"}, {"radius", capsule.radius}, {"length", capsule.length}};
  }
  Json operator()(const planning::Ellipsoid& ellipsoid) const {
    return {{"type", "ellipsoid"}, {"radii", to_json(ellipsoid.radii)}};
  }
  Json operator()(const planning::HalfSpace& half_space) const {
    return {{"type", "half_space"}, {"normal", to_json(half_space.normal)}};
  }
  Json operator()(const planning::Polytope&) const { return nullptr; }
};

Json map_json(const planning::World& world) {
  Json shapes = Json::array();
  for (const planning::Obstacle& obstacle : world.obstacles) {
    Json shape = std::visit(ShapeToJson{}, obstacle.shape);
    if (shape.is_null()) continue;
    shape["name"] = obstacle.name;
    shape["pose"] = to_json(obstacle.X_WO);
    shapes.push_back(std::move(shape));
  }
  return {{"shapes", std::move(shapes)}, {"mesh", to_json(drawn_meshes(world, kMaxTriangles))}};
}

Json hull_json(const planning::RobotHull& hull) {
  DrawnMesh parts;
  for (const planning::ConvexSolid& part : hull.parts)
    parts.append(part.name, planning::Polytope{part.vertices});
  return {{"mesh", to_json(parts)}, {"outline", pack_points(hull.outline(kOutlineTolerance))}};
}

Json path_json(const ReportPath& path) {
  const planning::PlanResult& plan = path.plan;
  Json narrow = nullptr;
  if (plan.reduced) {
    narrow = {{"length_m", plan.reduced->length_m},
              {"position", to_json(plan.reduced->place_W)},
              {"obstacle", plan.reduced->obstacle}};
  }
  const bool is_answered = !std::isnan(path.answered_s);
  return {{"id", path.id},
          {"state", path.state},
          {"goal", path.goal},
          {"cause", path.cause},
          {"asked_s", path.asked_s},
          {"answered_s", path.answered_s},
          {"time_ms", path.time_ms},
          {"is_replan", path.is_replan},
          {"status", is_answered ? planning::to_string(plan.status) : "not answered"},
          {"accepted", plan.accepted},
          {"reason", plan.reason},
          {"clearance_m", plan.clearance_m},
          {"length_m", plan.length_m},
          {"warm_starts", plan.warm_starts},
          {"narrow", std::move(narrow)},
          {"waypoints", pack_poses(plan.waypoints)}};
}

Json collision_json(const Collision& collision) {
  Json estimate = nullptr;
  if (collision.estimate) {
    estimate = {{"position", to_json(collision.estimate->p_W)},
                {"error_m", collision.estimate->error_m},
                {"sigma_m", collision.estimate->sigma_m}};
  }
  return {{"t", collision.t_s},
          {"position", to_json(collision.p_W)},
          {"obstacle", collision.obstacle},
          {"estimate", std::move(estimate)}};
}

Json verdict_json(const DiveVerdict& verdict) {
  Json nearest = nullptr;
  if (!verdict.nearest.obstacle.empty()) {
    nearest = {{"t", verdict.nearest.t_s},
               {"position", to_json(verdict.nearest.p_W)},
               {"clearance_m", verdict.nearest.clearance_m},
               {"obstacle", verdict.nearest.obstacle}};
  }
  Json collisions = Json::array();
  for (const Collision& collision : verdict.collisions) {
    collisions.push_back(collision_json(collision));
  }
  return {{"outcome", verdict.outcome},
          {"final_state", verdict.final_state},
          {"cause", verdict.cause},
          {"duration_s", verdict.duration_s},
          {"distance_m", verdict.distance_m},
          {"has_truth", verdict.has_truth},
          {"nearest", std::move(nearest)},
          {"collisions", std::move(collisions)},
          {"final_error_m", verdict.final_error_m},
          {"final_sigma_m", verdict.final_sigma_m},
          {"plans", verdict.plans},
          {"replans", verdict.replans}};
}

/// One column of the samples.
template <typename Value>
Json column(const std::vector<DiveSample>& samples, Value value) {
  std::vector<float> values;
  values.reserve(samples.size());
  for (const DiveSample& sample : samples) values.push_back(static_cast<float>(value(sample)));
  return packed(values);
}

template <typename Value>
Json index_column(const std::vector<DiveSample>& samples, Value value) {
  std::vector<std::int16_t> values;
  values.reserve(samples.size());
  for (const DiveSample& sample : samples) {
    values.push_back(
        static_cast<std::int16_t>(std::clamp(static_cast<int>(value(sample)), -1, 32767)));
  }
  return packed(values);
}

/// NaN where there is no pose.
Json positions(const std::vector<DiveSample>& samples, std::optional<Pose> DiveSample::*pose) {
  std::vector<float> values;
  values.reserve(3 * samples.size());
  for (const DiveSample& sample : samples) {
    const Eigen::Vector3d p =
        (sample.*pose) ? (sample.*pose)->p : Eigen::Vector3d::Constant(kUnknownValue);
    for (const double x : p) values.push_back(static_cast<float>(x));
  }
  return packed(values);
}

Json attitudes(const std::vector<DiveSample>& samples, std::optional<Pose> DiveSample::*pose) {
  std::vector<std::int16_t> values;
  values.reserve(4 * samples.size());
  for (const DiveSample& sample : samples) {
    const Eigen::Quaterniond q =
        (sample.*pose) ? (sample.*pose)->q : Eigen::Quaterniond::Identity();
    for (const double x : q.coeffs()) {
      values.push_back(static_cast<std::int16_t>(std::lround(kUnitScale * std::clamp(x, -1., 1.))));
    }
  }
  return packed(values);
}

/// The lower triangle of the Cholesky factor of each covariance, row by row: it maps the unit
/// sphere to the ellipsoid of one sigma.
Json ellipsoids(const std::vector<DiveSample>& samples) {
  std::vector<float> values;
  values.reserve(6 * samples.size());
  for (const DiveSample& sample : samples) {
    const Eigen::LLT<Eigen::Matrix3d> factor(sample.covariance);
    const bool is_usable = sample.estimate && factor.info() == Eigen::Success;
    const Eigen::Matrix3d L =
        is_usable ? Eigen::Matrix3d(factor.matrixL()) : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col <= row; ++col) values.push_back(static_cast<float>(L(row, col)));
    }
  }
  return packed(values);
}

Json samples_json(const std::vector<DiveSample>& s) {
  const auto value = [&](double DiveSample::*member) {
    return column(s, [member](const DiveSample& sample) { return sample.*member; });
  };
  return {{"t", value(&DiveSample::t_s)},
          {"true_position", positions(s, &DiveSample::truth)},
          {"true_attitude", attitudes(s, &DiveSample::truth)},
          {"position", positions(s, &DiveSample::estimate)},
          {"attitude", attitudes(s, &DiveSample::estimate)},
          {"ellipsoid", ellipsoids(s)},
          {"cross_track", value(&DiveSample::cross_track_m)},
          {"true_cross_track", value(&DiveSample::true_cross_track_m)},
          {"clearance", value(&DiveSample::clearance_m)},
          {"certified", value(&DiveSample::certified_m)},
          {"speed", value(&DiveSample::speed_mps)},
          {"true_speed", value(&DiveSample::true_speed_mps)},
          {"command_speed", value(&DiveSample::command_mps)},
          {"command_depth", value(&DiveSample::command_depth_m)},
          {"battery", value(&DiveSample::battery)},
          {"sigma", value(&DiveSample::sigma_m)},
          {"error", value(&DiveSample::error_m)},
          {"features", value(&DiveSample::features)},
          {"visual", index_column(s, [](const auto& sample) { return sample.is_visual; })},
          {"overhead", index_column(s, [](const auto& sample) { return sample.under_overhead; })},
          {"state", index_column(s, [](const auto& sample) { return sample.state; })},
          {"rung", index_column(s, [](const auto& sample) { return sample.rung; })},
          {"path", index_column(s, [](const auto& sample) { return sample.plan; })}};
}

Json transitions_json(const std::vector<TimedTransition>& transitions) {
  Json list = Json::array();
  for (const auto& [t_s, record] : transitions) {
    list.push_back({{"t", t_s},
                    {"from", record.from},
                    {"to", record.to},
                    {"event", record.event},
                    {"cause", record.cause}});
  }
  return list;
}

Json events_json(const std::vector<Explained>& events) {
  Json list = Json::array();
  for (const Explained& event : events) {
    list.push_back({{"t", event.t_s},
                    {"kind", to_string(event.kind)},
                    {"state", event.state},
                    {"what", event.what},
                    {"reason", event.reason}});
  }
  return list;
}

Json exits_json(const std::vector<ReportExit>& exits) {
  Json list = Json::array();
  for (const ReportExit& exit : exits) {
    list.push_back(
        {{"t", exit.t_s}, {"open_above", exit.open_above}, {"points", pack_points(exit.points_W)}});
  }
  return list;
}

Json trail_json(const std::vector<ReportBreadcrumb>& trail) {
  std::vector<float> times;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::int16_t> open;
  for (const ReportBreadcrumb& breadcrumb : trail) {
    times.push_back(static_cast<float>(breadcrumb.t_s));
    points.push_back(breadcrumb.p_W);
    open.push_back(breadcrumb.open_above ? 1 : 0);
  }
  return {{"t", packed(times)}, {"points", pack_points(points)}, {"open_above", packed(open)}};
}

Json near_misses_json(const std::vector<NearMiss>& misses) {
  Json list = Json::array();
  for (const NearMiss& miss : misses) {
    list.push_back({{"t", miss.t_s},
                    {"position", to_json(miss.p_W)},
                    {"clearance_m", miss.clearance_m},
                    {"obstacle", miss.obstacle}});
  }
  return list;
}

/// "t": for each triangle since when it is observed, ascending.
Json observed_json(const std::vector<ObservedPiece>& pieces, std::size_t all) {
  DrawnMesh mesh;
  std::vector<float> times;
  for (const ObservedPiece& piece : pieces) {
    const std::size_t before = mesh.triangles.size();
    mesh.append("", piece.polytope);
    times.insert(times.end(), mesh.triangles.size() - before, static_cast<float>(piece.t_s));
  }
  Json json = to_json(mesh);
  json["t"] = packed(times);
  json["pieces"] = pieces.size();
  json["all_pieces"] = all;
  return json;
}

Json local_goals_json(const std::vector<LocalGoal>& goals) {
  std::vector<float> times;
  for (const LocalGoal& goal : goals) times.push_back(static_cast<float>(goal.t_s));
  return packed(times);
}

Json gaps_json(const std::vector<LogGap>& gaps) {
  Json list = Json::array();
  for (const LogGap& gap : gaps) {
    list.push_back({{"from_s", to_seconds(gap.from)},
                    {"to_s", gap.to ? Json(to_seconds(*gap.to)) : Json(nullptr)},
                    {"bytes", gap.bytes}});
  }
  return list;
}

Json dive_json(const DiveReport& dive) {
  return {{"verdict", verdict_json(dive.verdict)},
          {"states", dive.states},
          {"rungs", dive.rungs},
          {"sample_period_s", dive.sample_period_s},
          {"samples", samples_json(dive.samples)},
          {"transitions", transitions_json(dive.transitions)},
          {"events", events_json(dive.events)},
          {"exits", exits_json(dive.exits)},
          {"trail", trail_json(dive.trail)},
          {"local_goals", local_goals_json(dive.local_goals)},
          {"near_misses", near_misses_json(dive.near_misses)},
          {"observed", observed_json(dive.observed, dive.observed_pieces)},
          {"rerun_until_s", dive.rerun_until_s},
          {"rerun_problem", dive.rerun_problem},
          {"torn", dive.torn},
          {"resumed", dive.resumed},
          {"gaps", gaps_json(dive.gaps)}};
}

}  // namespace

nlohmann::ordered_json page_data(const Report& report) {
  Json files = Json::array();
  for (const ReportFile& file : report.files) {
    files.push_back({{"role", file.role}, {"name", file.name}, {"sha256", file.sha256}});
  }
  Json paths = Json::array();
  for (const ReportPath& path : report.paths) paths.push_back(path_json(path));
  return {{"title", report.title},
          {"mission", report.mission},
          {"description", report.description},
          {"made_by", report.made_by},
          {"dived_by", report.dived_by},
          {"seed", report.seed},
          {"map_is_simulated", report.map_is_simulated},
          {"files", std::move(files)},
          {"check", report.check},
          {"clearance_required_m", report.clearance_required_m},
          {"max_depth_m", report.max_depth_m},
          {"speed_mps", report.speed_mps},
          {"hull", hull_json(report.hull)},
          {"map", map_json(report.world)},
          {"paths", std::move(paths)},
          {"dive", report.dive ? dive_json(*report.dive) : Json(nullptr)}};
}

}  // namespace dive::mission
