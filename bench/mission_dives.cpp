// Runs a mission with a series of seeds; collisions and clearances are those of ground truth:
//     mission_dives missions/window.xml --dives 100 --jobs 2
//     mission_dives missions/wreck.xml --set map_shift_sigma_m=0.3     with other errors
//     mission_dives missions/wreck.xml --world missions/maps/maze.sdf   with a map of another place
//     mission_dives missions/wreck_unknown.xml --diver          a diver swims into the path
//     mission_dives missions/wreck.xml --fault range_silent     at a drawn time, for good
//     mission_dives missions/wreck_unknown.xml --trace 7        one dive, second by second
//     mission_dives bench/manoeuvres/hold.xml --until ascend    errors at the end of a manoeuvre
//     mission_dives --real ../shared/data --dives 8             a hull, a cave and a dock of others

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <ranges>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/real_waters.h"
#include "bench/run_study.h"
#include "bench/study_setup.h"
#include "common/random.h"
#include "mission/check/route.h"
#include "mission/cli/loading.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"
#include "planning/planner.h"
#include "planning/world/primitives.h"
#include "planning/world/sdf.h"
#include "vehicle/simulator/diver.h"
#include "vehicle/simulator/drawn_world.h"
#include "vehicle/simulator/ground_truth/ground_truth.h"

namespace dive::bench {
namespace {

constexpr double kSamePlace = 0.01;  // m between waypoints; a shorter distance has no direction

struct Draw {
  std::vector<std::string> conditions;  ///< NAME=VALUE, applied to those of the mission.
  std::string world;  ///< File of a world that the vehicle has no map of; empty: that of the map.
  bool with_diver = false;
  int unmapped = 0;                         ///< Number of objects on the route that the map lacks.
  std::optional<mission::FaultKind> fault;  ///< At a drawn time on the route, for good.
  std::string until;  ///< State in which errors of the position no longer count; empty: none.
};

struct RoutedSetup : StudySetup {
  vehicle::Conditions conditions;
  std::optional<planning::World> other_world;  ///< If it is not that of the map.
  std::vector<Pose> route;                     ///< Route of a vehicle that knows the whole world.
  std::vector<Eigen::Vector3d> stops;          ///< Start and goals of its legs.
};

RoutedSetup load(const std::string& path, const Draw& draw) {
  RoutedSetup setup{load_setup(path), {}, {}, {}, {}};
  if (!draw.world.empty()) {
    Diagnostics diagnostics;
    setup.other_world = planning::load_sdf(draw.world, diagnostics);
    if (!setup.other_world) throw std::runtime_error(draw.world + " cannot be read");
  }
  const auto conditions =
      mission::parse_conditions(draw.conditions, mission::simulated_conditions(setup.mission));
  if (!conditions) throw std::runtime_error("a condition cannot be set");
  setup.conditions = *conditions;
  const planning::Scene scene(setup.world);
  const mission::Route route = mission::nominal_route(setup.mission, scene);
  SteadyClock clock;
  planning::Planner planner(setup.world, setup.model.hull, {}, clock);
  Pose at = route.start;
  setup.stops.push_back(at.p);
  for (const mission::RouteLeg& leg : route.legs) {
    const planning::PlanRequest request = behaviors::leg_request(route.settings, leg.goal, at);
    const planning::PlanResult plan = planner.plan(request);
    for (const Pose& waypoint : plan.waypoints) {
      const bool is_new =
          setup.route.empty() || (waypoint.p - setup.route.back().p).norm() > kSamePlace;
      if (is_new) setup.route.push_back(waypoint);
    }
    at = request.goal;
    setup.stops.push_back(at.p);
  }
  if (setup.route.size() < 2) throw std::runtime_error(path + ": no leg can be planned");
  return setup;
}

/// A diver who comes from the side to a point of the route, stays a while, and leaves on the other
/// side.
vehicle::DiverTrack diver_for(const RoutedSetup& setup, std::uint64_t seed) {
  Random random(seed, 0xd1fe);
  const auto last = static_cast<double>(setup.route.size()) - 2.0;
  const auto at = static_cast<std::size_t>(random.uniform(0.25, 0.75) * last) + 1;
  const Eigen::Vector3d way = setup.route[at].p - setup.route[at - 1].p;
  const Eigen::Vector3d side =
      Eigen::Vector3d(-way.y(), way.x(), 0.0).normalized() * (random.uniform() < 0.5 ? 1.0 : -1.0);
  double before = 0.0;
  for (std::size_t i = 1; i <= at; ++i) before += (setup.route[i].p - setup.route[i - 1].p).norm();
  vehicle::DiverTrack track;
  track.speed = random.uniform(0.2, 0.5);
  track.start_s = std::max(0.0, before / 0.4 - random.uniform(2.0, 15.0));
  track.waypoints = {{setup.route[at].p + 3.0 * side, 0.0},
                     {setup.route[at].p, random.uniform(3.0, 20.0)},
                     {setup.route[at].p - 3.0 * side, 0.0}};
  return track;
}

/// Boxes, balls and upright bars on the route or beside it, not at its stops.
std::vector<planning::Obstacle> unmapped_for(const RoutedSetup& setup, int count,
                                             std::uint64_t seed) {
  constexpr double kFromStops = 1.5;  // m
  Random random(seed, 0x0bce7);
  const auto last = static_cast<double>(setup.route.size()) - 1.0;
  std::vector<planning::Obstacle> objects;
  for (int tries = 0; static_cast<int>(objects.size()) < count && tries < 1000; ++tries) {
    const auto i = static_cast<std::size_t>(random.uniform(0.0, last));
    const Eigen::Vector3d way = setup.route[i + 1].p - setup.route[i].p;
    const Eigen::Vector3d side = Eigen::Vector3d(-way.y(), way.x(), 0.0).normalized();
    const double along = random.uniform();
    const double aside = random.uniform(-0.4, 0.4);
    const double kind = random.uniform();
    const double size = random.uniform(0.15, 0.5);
    const Eigen::Vector3d at = setup.route[i].p + along * way + aside * side;
    if (std::ranges::any_of(setup.stops, [&](const Eigen::Vector3d& stop) {
          return (stop - at).norm() < kFromStops;
        })) {
      continue;
    }
    const planning::Shape shape =
        kind < 0.4   ? planning::Shape(planning::Box{Eigen::Vector3d::Constant(size)})
        : kind < 0.7 ? planning::Shape(planning::Sphere{0.5 * size})
                     : planning::Shape(planning::Cylinder{0.15 * size + 0.03, 2.0});
    objects.push_back(
        {fmt::format("unmapped_{}", objects.size()), shape, {at, Eigen::Quaterniond::Identity()}});
  }
  return objects;
}

/// Within the time of the route at 0.3 m/s.
mission::Fault fault_for(const RoutedSetup& setup, mission::FaultKind kind, std::uint64_t seed) {
  Random random(seed, 0xfa17);
  double length_m = 0.0;
  for (std::size_t i = 1; i < setup.route.size(); ++i) {
    length_m += (setup.route[i].p - setup.route[i - 1].p).norm();
  }
  mission::Fault fault;
  fault.kind = kind;
  fault.at_s = random.uniform(2.0, length_m / 0.3);
  return fault;
}

mission::DiveSettings settings_for(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings;
  settings.conditions = setup.conditions;
  settings.world = setup.other_world;
  settings.unmapped = unmapped_for(setup, draw.unmapped, seed);
  settings.seed = seed;
  if (draw.with_diver) settings.diver = diver_for(setup, seed);
  if (draw.fault) settings.faults.push_back(fault_for(setup, *draw.fault, seed));
  return settings;
}

/// Distances from the vehicle to the obstacles of the world, and to the diver.
class Apart {
 public:
  Apart(const RoutedSetup& setup, const mission::DiveSettings& settings)
      : to_world_(mission::simulated_world(setup.world, settings), setup.model.hull),
        to_diver_(diver_alone(), setup.model.hull) {}

  void observe(const vehicle::GroundTruth& truth, const std::optional<Pose>& X_WD) {
    to_world_.observe(truth.X_WB);
    if (X_WD) to_diver_.observe(X_WD->inverse() * truth.X_WB);
    now_ = {truth.X_WB, X_WD};
  }
  [[nodiscard]] double from_world_m() const { return to_world_.min_clearance_m(); }
  [[nodiscard]] double from_diver_m() const { return to_diver_.min_clearance_m(); }
  [[nodiscard]] double from_world_now_m() const { return to_world_.clearance(now_.X_WB); }
  /// Infinite without a diver.
  [[nodiscard]] double from_diver_now_m() const {
    return now_.X_WD ? to_diver_.clearance(now_.X_WD->inverse() * now_.X_WB)
                     : to_diver_.min_clearance_m();
  }

 private:
  static planning::World diver_alone() {
    planning::World world;
    world.obstacles.push_back(vehicle::Diver::shape());
    return world;
  }

  struct Now {
    Pose X_WB;
    std::optional<Pose> X_WD;
  };
  vehicle::ClearanceMeter to_world_;
  vehicle::ClearanceMeter to_diver_;
  Now now_;
};

// Errors of the published position, horizontally: relative to the map, in which the obstacles are,
// and in the world, of which its covariance is.
class PositionErrors {
 public:
  explicit PositionErrors(const mission::DiveSettings& settings)
      : map_from_world_(vehicle::drawn_map_motion(settings.conditions, settings.seed).inverse()) {}

  void observe(const estimation::StateEstimate& estimate, const vehicle::GroundTruth& truth) {
    if (!estimate.valid) return;
    const Eigen::Vector2d off = (estimate.X_WB.p - truth.X_WB.p).head<2>();
    const Eigen::Matrix2d P = estimate.covariance.topLeftCorner<2, 2>();
    nees_ = off.dot(P.ldlt().solve(off));
    const Eigen::Vector2d in_map = (estimate.X_WB.p - map_from_world_ * truth.X_WB.p).head<2>();
    nees_in_map_ = in_map.dot(P.ldlt().solve(in_map));
    last_m_ = in_map.norm();
    errors_m_.push_back(last_m_);
  }
  /// Of the last estimate, in the world; its mean over dives is 2 if the covariance is right.
  [[nodiscard]] double nees() const { return nees_; }
  [[nodiscard]] double nees_in_map() const { return nees_in_map_; }
  [[nodiscard]] double last_m() const { return last_m_; }  ///< Relative to the map, m.
  [[nodiscard]] double p95_m() {
    std::ranges::sort(errors_m_);
    return errors_m_.empty() ? 0.0 : errors_m_[errors_m_.size() * 95 / 100];
  }

 private:
  Pose map_from_world_;
  double nees_ = 0.0;
  double nees_in_map_ = 0.0;
  double last_m_ = 0.0;
  std::vector<double> errors_m_;
};

/// Whether the range camera could observe the unmapped objects: for how long each was in its field
/// of view within 3 m, whatever stood between.
class InView {
 public:
  explicit InView(const mission::DiveSettings& settings)
      : camera_(settings.range_camera),
        q_CB_(from_rpy(0.0, -deg_to_rad(camera_.tilt_deg), 0.0)),
        seconds_(settings.unmapped.size(), 0.0) {
    for (const planning::Obstacle& object : settings.unmapped) {
      boxes_W_.push_back(planning::bounding_box(object));
      names_.push_back(object.name);
    }
  }

  void observe(const Pose& X_WB) {
    for (std::size_t i = 0; i < boxes_W_.size(); ++i) {
      if (is_seen(boxes_W_[i], X_WB.inverse())) seconds_[i] += vehicle::Simulator::kTick;
    }
  }
  /// True for an object that was in view for less than a second.
  [[nodiscard]] bool was_hidden(const std::string& name) const {
    const auto found = std::ranges::find(names_, name);
    return found != names_.end() &&
           seconds_[static_cast<std::size_t>(found - names_.begin())] < 1.0;
  }

 private:
  [[nodiscard]] bool is_seen(const Eigen::AlignedBox3d& box_W, const Pose& X_BW) const {
    constexpr double kNear = 3.0;  // m
    const double wide = std::tan(0.5 * deg_to_rad(camera_.horizontal_deg));
    const double high = std::tan(0.5 * deg_to_rad(camera_.vertical_deg));
    const auto is_in_view = [&](const Eigen::Vector3d& p_W) {
      const Eigen::Vector3d p_C = q_CB_ * (X_BW * p_W - camera_.origin_B);
      return p_C.norm() < kNear && std::abs(p_C.y()) < wide * p_C.x() &&
             std::abs(p_C.z()) < high * p_C.x();
    };
    for (int corner = 0; corner < 8; ++corner) {
      if (is_in_view(box_W.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))))
        return true;
    }
    return is_in_view(box_W.center());
  }

  vehicle::RangeCameraOptions camera_;
  Eigen::Quaterniond q_CB_;
  std::vector<Eigen::AlignedBox3d> boxes_W_;
  std::vector<std::string> names_;
  std::vector<double> seconds_;
};

void observe_with(Apart& apart, mission::DiveSettings& settings) {
  settings.sensor_observer = [&apart](const auto&, const vehicle::GroundTruth& truth,
                                      const std::optional<Pose>& X_WD) {
    apart.observe(truth, X_WD);
  };
}

// The mission may skip an unreachable goal and still end well.
bool reached_all(const mission::DiveResult& result) {
  return result.outcome == "success" &&
         std::ranges::none_of(result.transitions, [](const mission::TimedTransition& transition) {
           const std::string& event = transition.record.event;
           return event.starts_with("plan.failed") || event.starts_with("timeout");
         });
}

nlohmann::json dive(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings = settings_for(setup, draw, seed);
  Apart apart(setup, settings);
  PositionErrors errors(settings);
  observe_with(apart, settings);
  std::optional<double> wrong_map_s;
  double off_path_m = 0.0;
  InView in_view(settings);
  std::size_t with_hidden = 0;
  bool is_over = false;
  const mission::DiveResult result = mission::simulate_dive(
      setup.mission, setup.world, setup.model, settings,
      [&](const auto&, const mission::StepOutputs& out, const vehicle::GroundTruth& truth,
          const mission::TickContacts& contacts) {
        for (const mission::Collision& collision : contacts.begun) {
          with_hidden += in_view.was_hidden(collision.obstacle) ? 1 : 0;
        }
        in_view.observe(truth.X_WB);
        is_over = is_over || (!draw.until.empty() && out.status.state == draw.until);
        if (!is_over) errors.observe(out.estimate, truth);
        off_path_m = std::max(off_path_m, out.status.cross_track_m);
        for (const mission::FailsafeRecord& failsafe : out.failsafes) {
          if (failsafe.cause == "wrong_map" && !wrong_map_s) wrong_map_s = to_seconds(truth.utime);
        }
      });
  return {{"seed", seed},
          {"outcome", result.outcome},
          {"reached", reached_all(result)},
          {"state", result.final_state},
          {"cause", result.cause},
          {"clearance", apart.from_world_m()},
          {"from_diver", apart.from_diver_m()},
          {"collisions", result.collisions.size()},
          {"hidden", with_hidden},
          {"duration", result.duration_s},
          {"depth", result.final_depth_m},
          {"error", result.final_error_m},
          {"error_p95", errors.p95_m()},
          {"nees", errors.nees()},
          {"nees_in_map", errors.nees_in_map()},
          {"error_end", errors.last_m()},
          {"off_path", off_path_m},
          {"wrong_map", wrong_map_s.value_or(-1.0)},
          {"replans", result.replans},
          {"pieces", result.observed_map.pieces()}};
}

void trace_plan(const planning::PlanResult& plan) {
  std::cout << fmt::format("  plan: {} {}, clearance {:.2f} m\n", planning::to_string(plan.status),
                           plan.reason, plan.clearance_m);
  for (const Pose& pose : plan.waypoints) {
    const Eigen::Vector3d rpy = to_rpy(pose.q);
    std::cout << fmt::format("    {:6.2f} {:6.2f} {:6.2f} rpy {:4.0f} {:4.0f} {:4.0f}\n",
                             pose.p.x(), pose.p.y(), pose.p.z(), rad_to_deg(rpy.x()),
                             rad_to_deg(rpy.y()), rad_to_deg(rpy.z()));
  }
}

void trace(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings = settings_for(setup, draw, seed);
  Apart apart(setup, settings);
  observe_with(apart, settings);
  if (settings.diver) {
    const vehicle::DiverTrack& track = *settings.diver;
    std::cout << fmt::format("a diver, from {:.1f} s at {:.2f} m/s:", track.start_s, track.speed);
    for (const auto& [p_W, pause_s] : track.waypoints) {
      std::cout << fmt::format(" ({:.2f} {:.2f} {:.2f}), {:.0f} s", p_W.x(), p_W.y(), p_W.z(),
                               pause_s);
    }
    std::cout << '\n';
  }
  for (const planning::Obstacle& object : settings.unmapped) {
    const Eigen::AlignedBox3d box = planning::bounding_box(object);
    std::cout << fmt::format("{}: {:.2f} x {:.2f} x {:.2f} m at ({:.2f} {:.2f} {:.2f})\n",
                             object.name, box.sizes().x(), box.sizes().y(), box.sizes().z(),
                             box.center().x(), box.center().y(), box.center().z());
  }
  Utime next = 0;
  std::size_t told = 0;
  MapFix fix;
  const Pose map_from_world =
      vehicle::drawn_map_motion(settings.conditions, settings.seed).inverse();
  const mission::DiveResult result = mission::simulate_dive(
      setup.mission, setup.world, setup.model, settings,
      [&](const mission::StepInputs& in, const mission::StepOutputs& out,
          const vehicle::GroundTruth& truth, const auto&) {
        if (in.map_fix) fix = *in.map_fix;
        for (const planning::ObstacleUpdate& update : in.obstacles) told += update.cells.size();
        for (const auto& t : out.transitions) std::cout << "  " << t.to << ": " << t.cause << '\n';
        for (const auto& f : out.failsafes) std::cout << "  " << f.rung << ": " << f.why << '\n';
        if (in.plan) trace_plan(in.plan->plan);
        if (in.now < next) return;
        next = in.now + 500'000;
        planning::World near;
        in.observed_map.append_within({out.estimate.X_WB.p - Eigen::Vector3d::Constant(2.5),
                                       out.estimate.X_WB.p + Eigen::Vector3d::Constant(2.5)},
                                      near.obstacles);
        const vehicle::ClearanceMeter by_map(near, setup.model.hull);
        const Eigen::Vector3d off = out.estimate.X_WB.p - map_from_world * truth.X_WB.p;
        std::cout << fmt::format(
            "{:6.1f} s  {:<12} at {:6.2f} {:6.2f} {:6.2f} rpy {:4.0f} {:4.0f} {:4.0f} of "
            "{:4.0f} {:4.0f} {:4.0f} rates {:5.2f} {:5.2f} {:5.2f} {:5.2f} {:5.2f} off {:5.2f} "
            "{:5.2f} {:5.2f} sigma {:.2f} v {:.2f} {:.2f} est "
            "{:.2f} {:.2f} of {:.2f}  clear "
            "{:5.2f} diver "
            "{:5.2f} map {:5.2f} path {:5.2f} cross {:.2f} {}  pieces {} (+{}) fix {}/{} {} places "
            "{}/{}/{}\n",
            to_seconds(in.now), out.status.state, truth.X_WB.p.x(), truth.X_WB.p.y(),
            truth.X_WB.p.z(), rad_to_deg(to_rpy(truth.X_WB.q).x()),
            rad_to_deg(to_rpy(truth.X_WB.q).y()), rad_to_deg(to_rpy(truth.X_WB.q).z()),
            rad_to_deg(to_rpy(out.command.o).x()), rad_to_deg(to_rpy(out.command.o).y()),
            rad_to_deg(to_rpy(out.command.o).z()), out.rates.surge, out.rates.heave, out.rates.roll,
            out.rates.pitch, out.rates.yaw, off.x(), off.y(), off.z(),
            estimation::horizontal_sigma(out.estimate), truth.v_WB_B.x(), truth.v_WB_B.y(),
            out.estimate.v_WB_B.x(), out.estimate.v_WB_B.y(), out.command.v,
            apart.from_world_now_m(), apart.from_diver_now_m(),
            near.obstacles.empty() ? 9.99 : by_map.clearance(out.estimate.X_WB),
            out.status.clearance_m, out.status.cross_track_m, out.status.rung,
            in.observed_map.pieces(), told, fix.used, fix.gated, static_cast<int>(fix.problem),
            fix.agreement.confirmed, fix.agreement.missing, fix.agreement.unmapped);
        told = 0;
      });
  std::cout << fmt::format(
      "{} in {} ({}), clearance {:.3f}, to the diver {:.3f}, {} collision(s)\n", result.outcome,
      result.final_state, result.cause, apart.from_world_m(), apart.from_diver_m(),
      result.collisions.size());
}

// Each job is a process of its own and takes every n-th seed.
std::vector<nlohmann::json> dive_all(const RoutedSetup& setup, const Draw& draw, int first,
                                     int dives, int jobs) {
  const std::string folder = fmt::format("/tmp/mission_dives.{}", ::getpid());
  std::vector<pid_t> children;
  for (int job = 0; job < jobs; ++job) {
    const pid_t child = ::fork();
    if (child == 0) {
      std::ofstream out(fmt::format("{}.{}", folder, job));
      for (int i = job; i < dives; i += jobs) {
        out << dive(setup, draw, static_cast<std::uint64_t>(first + i)) << std::endl;
      }
      ::_exit(0);
    }
    children.push_back(child);
  }
  std::vector<nlohmann::json> results;
  for (int job = 0; job < jobs; ++job) {
    int status = 0;
    ::waitpid(children[static_cast<std::size_t>(job)], &status, 0);
    const std::string file = fmt::format("{}.{}", folder, job);
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) results.push_back(nlohmann::json::parse(line));
    ::unlink(file.c_str());
    if (status != 0) std::cerr << fmt::format("job {} ended with {}\n", job, status);
  }
  return results;
}

// The distribution of one kind of clearance, and the five dives with the least.
void report_clearance(const std::string& what, const char* key,
                      const std::vector<nlohmann::json>& results) {
  std::vector<std::pair<double, int>> clearances;
  for (const nlohmann::json& r : results) {
    if (r[key].is_number()) clearances.emplace_back(r[key], r["seed"]);
  }
  if (clearances.empty()) return;
  std::ranges::sort(clearances);
  const auto at = [&](double share) {
    const double last = static_cast<double>(clearances.size()) - 1.0;
    return clearances[static_cast<std::size_t>(share * last)].first;
  };
  std::cout << fmt::format(
      "  {} (ground truth) min {:.3f}, p05 {:.3f}, p25 {:.3f}, median {:.3f}, max {:.3f} m; least:",
      what, at(0.0), at(0.05), at(0.25), at(0.5), at(1.0));
  for (const auto& [least_m, seed] : clearances | std::views::take(5)) {
    std::cout << fmt::format(" seed {} ({:.3f} m)", seed, least_m);
  }
  std::cout << '\n';
}

// The errors of position over all dives, and how well the covariance describes them.
void report_errors(const std::vector<nlohmann::json>& results) {
  constexpr double kBound = 9.21;  // 99 % of the chi-square distribution of two degrees of freedom
  const auto dives = static_cast<double>(results.size());
  double nees = 0.0;
  double nees_in_map = 0.0;
  int beyond = 0;
  std::vector<double> p95;
  std::vector<double> last;
  for (const nlohmann::json& r : results) {
    nees += r["nees"].get<double>() / dives;
    nees_in_map += r["nees_in_map"].get<double>() / dives;
    beyond += r["nees"].get<double>() > kBound ? 1 : 0;
    p95.push_back(r["error_p95"]);
    last.push_back(r["error_end"]);
  }
  if (p95.empty()) return;
  std::ranges::sort(p95);
  std::ranges::sort(last);
  std::cout << fmt::format(
      "  position relative to the map: p95 of a dive's errors median {:.3f}, max {:.3f} m; at the "
      "end median {:.3f}, p95 {:.3f}, max {:.3f} m, NEES {:.2f}; in the world NEES {:.2f}, {} of "
      "{} "
      "beyond {}\n",
      p95[p95.size() / 2], p95.back(), last[last.size() / 2], last[last.size() * 95 / 100],
      last.back(), nees_in_map, nees, beyond, last.size(), kBound);
}

// The largest distance of each dive from the path being followed, as estimated.
void report_off_path(const std::vector<nlohmann::json>& results) {
  std::vector<double> distances;
  for (const nlohmann::json& r : results) distances.push_back(r["off_path"]);
  if (distances.empty()) return;
  std::ranges::sort(distances);
  std::cout << fmt::format("  largest distance from the path median {:.2f}, max {:.2f} m\n",
                           distances[distances.size() / 2], distances.back());
}

// The dives in which the failsafe for a wrong map was raised, and when.
void report_wrong_map(const std::vector<nlohmann::json>& results) {
  std::vector<double> times;
  std::string seeds;
  for (const nlohmann::json& r : results) {
    if (r["wrong_map"].get<double>() < 0.0) continue;
    times.push_back(r["wrong_map"]);
    seeds += fmt::format(" {}", r["seed"].get<int>());
  }
  if (times.empty()) return;
  std::ranges::sort(times);
  std::cout << fmt::format(
      "  wrong_map in {} dives, after {:.1f} to {:.1f} s, median {:.1f} s; seeds{}\n", times.size(),
      times.front(), times.back(), times[times.size() / 2], seeds);
}

void report(const std::string& name, std::vector<nlohmann::json> results) {
  std::ranges::sort(results, {}, [](const nlohmann::json& r) { return r["seed"].get<int>(); });
  std::map<std::string, int> outcomes;
  int collided = 0;
  int reached = 0;
  int hidden = 0;
  for (const nlohmann::json& r : results) {
    ++outcomes[r["outcome"].get<std::string>()];
    if (r["collisions"].get<int>() > 0) ++collided;
    if (r["hidden"].get<int>() > 0) ++hidden;
    if (r["reached"].get<bool>()) ++reached;
    if (!r["reached"].get<bool>()) {
      std::cout << fmt::format("  seed {}: {} in {} after {:.0f} s, {:.1f} m deep: {}\n",
                               r["seed"].get<int>(), r["outcome"].get<std::string>(),
                               r["state"].get<std::string>(), r["duration"].get<double>(),
                               r["depth"].get<double>(), r["cause"].get<std::string>());
    }
  }
  std::cout << name << ": " << results.size() << " dives";
  for (const auto& [outcome, count] : outcomes) std::cout << ", " << count << ' ' << outcome;
  std::cout << fmt::format("; {} reached all goals; {} with a collision", reached, collided);
  if (hidden > 0) {
    std::cout << fmt::format(
        ", {} of them with an object in the range camera's view for less than a second", hidden);
  }
  std::cout << '\n';
  report_clearance("clearance to what stands still", "clearance", results);
  report_clearance("clearance to the diver", "from_diver", results);
  report_errors(results);
  report_off_path(results);
  report_wrong_map(results);
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Dives missions seed after seed; collisions and clearances from ground truth");
  std::vector<std::string> missions;
  int dives = 100;
  int first = 1;
  int jobs = 2;
  int traced = 0;
  dive::bench::Draw draw;
  std::string data;
  std::string fault;
  app.add_option("missions", missions);
  app.add_option("--real", data, "Folder of the shared data: dives the waters made of it");
  app.add_option("--dives", dives);
  app.add_option("--first", first, "Seed of the first dive");
  app.add_option("--jobs", jobs);
  app.add_option("--trace", traced, "This seed alone, every half second");
  app.add_option("--unmapped", draw.unmapped, "Objects on the route that the map lacks");
  app.add_option("--world", draw.world, "World (SDF) to dive in, other than the mission's map");
  app.add_flag("--diver", draw.with_diver, "A diver swims into the path");
  app.add_option("--until", draw.until, "State in which errors of the position no longer count");
  app.add_option("--fault", fault, "A fault of dive run, at a drawn time, for good");
  app.add_option("--set", draw.conditions, "NAME=VALUE of the simulator, as of dive run");
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    if (!fault.empty()) {
      draw.fault = dive::mission::find_fault(fault);
      if (!draw.fault) throw std::runtime_error("there is no fault '" + fault + "'");
    }
    if (!data.empty()) {
      for (std::string& path : dive::bench::write_real_waters(data)) {
        missions.push_back(std::move(path));
      }
    }
    if (missions.empty()) throw std::runtime_error("give missions, or --real DATA");
    for (const std::string& path : missions) {
      const dive::bench::RoutedSetup setup = dive::bench::load(path, draw);
      if (traced > 0) {
        dive::bench::trace(setup, draw, static_cast<std::uint64_t>(traced));
      } else {
        dive::bench::report(path, dive::bench::dive_all(setup, draw, first, dives, jobs));
      }
    }
  });
}
