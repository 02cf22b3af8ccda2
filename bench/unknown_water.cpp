// Unknown water, measured: what one sweep becomes and how long from a sweep to a certified path.
//   unknown_water stream wreck cluttered     20 sweeps a second along the mission's own route
//   unknown_water scan wreck cluttered       one sweep: coverage, water blocked, time
//   unknown_water growth                     an update beside the size of the map

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/environments.h"
#include "common/clock.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/scene.h"
#include "planning/world/seen.h"
#include "vehicle/simulator/range_camera.h"

namespace dive::bench {
namespace {

planning::MapperOptions g_options;
using Milliseconds = std::chrono::duration<double, std::milli>;
using planning::MapUpdate;

constexpr double kSpeed = 0.4;    // m/s
constexpr double kRate = 20.0;    // Hz
constexpr double kAround = 25.0;  // m of the map that a plan is given

template <class Work>
double timed(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return Milliseconds(std::chrono::steady_clock::now() - begin).count();
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

planning::World world_of(const planning::SeenMap& map, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kAround);
  planning::World world;
  map.append_within({p_W - reach, p_W + reach}, world.obstacles);
  return world;
}

/// Poses along the known routes of a mission, one per sweep.
std::vector<Pose> swum(const Environment& environment) {
  SteadyClock clock;
  planning::Planner planner(environment.world, environment.hull, {}, clock);
  std::vector<Pose> poses;
  for (const EnvironmentLeg& leg : environment.legs) {
    const planning::PlanResult plan = planner.plan(leg.request);
    for (std::size_t i = 1; i < plan.waypoints.size(); ++i) {
      const double length = (plan.waypoints[i].p - plan.waypoints[i - 1].p).norm();
      const int steps = std::max(1, static_cast<int>(length / kSpeed * kRate));
      for (int s = 0; s < steps; ++s) {
        poses.push_back(
            interpolate(plan.waypoints[i - 1], plan.waypoints[i], static_cast<double>(s) / steps));
      }
    }
  }
  return poses;
}

/// Share of the true surface in view that is off the pieces, and of the free rays that they block.
struct Quality {
  double uncovered = 0.0;
  double worst_m = 0.0;
  double scanned = 0.0;  ///< Of the surface as it was scanned.
  double scanned_worst_m = 0.0;
  double blocked = 0.0;          ///< Rays that end 0.1 m before what they hit ...
  double blocked_upright = 0.0;  ///< ... or 0.1 m off its surface.
};

constexpr double kTolerance = 0.05;  // m: a surface so near to a piece is covered
constexpr double kShort = 0.10;      // m short of the hit ends the water that is known to be free

bool is_blocked(const planning::Scene& scene, const Eigen::Vector3d& from,
                const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  const double length = way.norm();
  double at = 0.0;
  while (at < length) {
    const double distance = scene.point_distance(from + at / length * way);
    if (distance <= 0.0) return true;
    at += std::max(distance, 1e-3);
  }
  return false;
}

// Of the surface as it was scanned, half way between neighbouring pixels of one surface and
// diagonally: the share that is farther off the pieces than the tolerance.
double off_the_scan(const planning::Scene& scene, const Pose& X_WB, const RangeScan& scan,
                    double& worst_m) {
  constexpr int kWidth = 100;
  constexpr float kOneSurface = 0.3F;  // m between neighbours
  int count = 0;
  int off = 0;
  const auto consider = [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    if (!((a - b).norm() < kOneSurface)) return;  // also NaN
    if ((a - scan.origin_B).norm() > scan.reach || (b - scan.origin_B).norm() > scan.reach) return;
    const double distance = scene.point_distance(X_WB * (0.5F * (a + b)).cast<double>());
    worst_m = std::max(worst_m, distance);
    ++count;
    if (distance > kTolerance) ++off;
  };
  for (std::size_t i = 0; i + kWidth + 1 < scan.points_B.size(); ++i) {
    if (i % kWidth + 1 == kWidth) continue;
    consider(scan.points_B[i], scan.points_B[i + 1]);
    consider(scan.points_B[i], scan.points_B[i + kWidth]);
    consider(scan.points_B[i], scan.points_B[i + kWidth + 1]);
  }
  return count > 0 ? static_cast<double>(off) / count : 0.0;
}

Quality judge(const Environment& environment, const planning::World& pieces, const Pose& X_WB,
              const RangeScan& scan) {
  const planning::Scene scene(pieces);
  Quality quality;
  const Eigen::Vector3d eye_W = X_WB * scan.origin_B.cast<double>();
  // Truth, twice as fine.
  vehicle::RangeCameraOptions fine;
  fine.width *= 2;
  fine.height *= 2;
  fine.noise_m = fine.noise_share = fine.dropout_share = fine.particles_per_m3 = 0.0;
  vehicle::RangeCamera camera(environment.world, fine, 1);
  const RangeScan truth = camera.take(scan.utime, X_WB);
  quality.scanned = off_the_scan(scene, X_WB, scan, quality.scanned_worst_m);
  const auto range = [&](int x, int y) {
    const auto i = static_cast<std::size_t>(y * fine.width + x);
    return (truth.points_B[i] - truth.origin_B).norm();
  };
  int surface = 0;
  int off = 0;
  int rays = 0;
  int blocked = 0;
  int blocked_upright = 0;
  for (int y = 2; y + 2 < fine.height; ++y) {
    for (int x = 2; x + 2 < fine.width; ++x) {
      const auto i = static_cast<std::size_t>(y * fine.width + x);
      const Eigen::Vector3d p_W = X_WB * truth.points_B[i].cast<double>();
      const double r = range(x, y);
      if (!std::isfinite(r)) continue;
      const bool hit = r <= fine.reach_m;
      const Eigen::Vector3d end =
          eye_W + (p_W - eye_W).normalized() * (std::min(r, fine.reach_m) - kShort);
      ++rays;
      if (is_blocked(scene, eye_W, end)) ++blocked;
      if (hit && std::isfinite(range(x + 1, y)) && std::isfinite(range(x, y + 1))) {
        const Eigen::Vector3d a = X_WB * truth.points_B[i + 1].cast<double>() - p_W;
        const Eigen::Vector3d b =
            X_WB * truth.points_B[i + static_cast<std::size_t>(fine.width)].cast<double>() - p_W;
        const Eigen::Vector3d way = (p_W - eye_W).normalized();
        const double sine = std::abs(a.cross(b).normalized().dot(way));
        const Eigen::Vector3d stop = eye_W + way * std::max(0.0, r - kShort / std::max(sine, 0.02));
        if (is_blocked(scene, eye_W, stop)) ++blocked_upright;
      }
      // Surface that goes on to the next pixels: not beyond an edge that hides the rest.
      if (!hit) continue;
      bool goes_on = true;
      const double alike = 0.4;
      for (const auto& [dx, dy] :
           {std::pair(2, 0), std::pair(-2, 0), std::pair(0, 2), std::pair(0, -2)}) {
        const auto k = static_cast<std::size_t>((y + dy) * fine.width + x + dx);
        goes_on &= (truth.points_B[k] - truth.points_B[i]).norm() < alike;
      }
      if (!goes_on) continue;
      ++surface;
      const double distance = scene.point_distance(p_W);
      quality.worst_m = std::max(quality.worst_m, distance);
      if (distance > kTolerance) ++off;
    }
  }
  quality.uncovered = surface > 0 ? static_cast<double>(off) / surface : 0.0;
  quality.blocked = rays > 0 ? static_cast<double>(blocked) / rays : 0.0;
  quality.blocked_upright = rays > 0 ? static_cast<double>(blocked_upright) / rays : 0.0;
  return quality;
}

void scan_of(const std::string& name, int every, bool clean) {
  const Environment environment = load_environment(name);
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  vehicle::RangeCameraOptions options;
  options.rate_hz = kRate;
  if (clean) options.noise_share = options.dropout_share = options.particles_per_m3 = 0.0;
  if (clean) options.noise_m = 1e-5;  // no sweep is like the last one
  vehicle::RangeCamera camera(environment.world, options, 1);
  std::vector<double> scanned, scanned_worst, upright, total, triangulate, divide, uncovered, worst,
      blocked, points, pieces;
  for (std::size_t i = 0; i < poses.size(); i += static_cast<std::size_t>(every)) {
    planning::MapperOptions mapping = g_options;
    mapping.confirm = 1;
    if (clean) mapping.noise_m = mapping.noise_share = 0.0;
    mapping.points_per_update = 1'000'000;
    planning::Mapper mapper(environment.hull, mapping, clock);
    const RangeScan scan = camera.take(from_seconds(static_cast<double>(i) / kRate), poses[i]);
    planning::SeenMap map;
    if (auto update = mapper.add(scan, poses[i], Eigen::Vector3d::Zero())) map.apply(*update);
    mapper.rebuild_all();
    RangeScan again = camera.take(scan.utime + 200'000, poses[i]);
    if (auto update = mapper.add(again, poses[i], Eigen::Vector3d::Zero())) map.apply(*update);
    const planning::MapperTimes& times = mapper.times();
    total.push_back(times.total_ms);
    triangulate.push_back(times.triangulate_ms);
    divide.push_back(times.divide_ms);
    points.push_back(mapper.stats().meshed_points);
    pieces.push_back(static_cast<double>(map.pieces()));
    const Quality quality = judge(environment, world_of(map, poses[i].p), poses[i], scan);
    uncovered.push_back(quality.uncovered);
    worst.push_back(quality.worst_m);
    blocked.push_back(quality.blocked);
    upright.push_back(quality.blocked_upright);
    scanned.push_back(quality.scanned);
    scanned_worst.push_back(quality.scanned_worst_m);
  }
  std::cout << fmt::format(
      "{:<12} {:4} sweeps: voxels {:.0f}, pieces {:.0f}; total {:.1f} ms, triangulate {:.1f}, "
      "divide "
      "{:.1f} (medians), p95 {:.1f}, {:.1f}, {:.1f}\n             surface uncovered mean {:.3f} % "
      "max {:.3f} %, farthest {:.3f} m (median of worst {:.3f}); free rays blocked mean {:.2f} % "
      "max "
      "{:.2f} %, off the surface mean {:.2f} %; scanned surface "
      "uncovered mean {:.3f} % max {:.3f} %, farthest {:.3f} m\n",
      name, total.size(), quantile(points, 0.5), quantile(pieces, 0.5), quantile(total, 0.5),
      quantile(triangulate, 0.5), quantile(divide, 0.5), quantile(total, 0.95),
      quantile(triangulate, 0.95), quantile(divide, 0.95),
      100.0 * std::accumulate(uncovered.begin(), uncovered.end(), 0.0) /
          static_cast<double>(uncovered.size()),
      100.0 * quantile(uncovered, 1.0), quantile(worst, 1.0), quantile(worst, 0.5),
      100.0 * std::accumulate(blocked.begin(), blocked.end(), 0.0) /
          static_cast<double>(blocked.size()),
      100.0 * quantile(blocked, 1.0),
      100.0 * std::accumulate(upright.begin(), upright.end(), 0.0) /
          static_cast<double>(upright.size()),
      100.0 * std::accumulate(scanned.begin(), scanned.end(), 0.0) /
          static_cast<double>(scanned.size()),
      100.0 * quantile(scanned, 1.0), quantile(scanned_worst, 1.0));
}

int g_most = 1000000;
void stream_of(const std::string& name, bool rebuild) {
  const Environment environment = load_environment(name);
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  vehicle::RangeCameraOptions options;
  options.rate_hz = kRate;
  vehicle::RangeCamera camera(environment.world, options, 1);
  planning::MapperOptions mapping = g_options;
  if (rebuild) mapping.points_per_update = 100'000'000;
  planning::Mapper mapper(environment.hull, mapping, clock);
  planning::SeenMap map;
  planning::PlanResult path;
  std::vector<double> all, points, triangulate, divide, build, plan, meshed, pieces, blocked;
  int failed = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(poses.size(),g_most); ++i) {
    const RangeScan scan = camera.take(from_seconds(static_cast<double>(i + 1) / kRate), poses[i]);
    if (rebuild) mapper.rebuild_all();
    double to_build = 0.0;
    double to_plan = 0.0;
    const Eigen::Vector3d v_W = poses[i].q * Eigen::Vector3d(kSpeed, 0.0, 0.0);
    all.push_back(timed([&] {
      if (auto update = mapper.add(scan, poses[i], v_W)) map.apply(*update);
      std::optional<planning::Planner> planner;
      planning::World world;
      to_build = timed([&] {
        world = world_of(map, poses[i].p);
        planner.emplace(world, environment.hull, planning::PlannerOptions{}, clock);
      });
      to_plan = timed([&] {
        planning::PlanRequest request = environment.legs.back().request;
        request.start = poses[i];
        for (std::size_t leg = 0; leg < environment.legs.size(); ++leg) {
          if ((environment.legs[leg].request.goal.p - poses[i].p).norm() > 1.0) {
            request.goal = environment.legs[leg].request.goal;
          }
        }
        const bool is_same =
            !path.waypoints.empty() && (path.waypoints.back().p - request.goal.p).norm() < 0.5;
        if (is_same) {
          request.previous = {request.start};
          std::size_t nearest = 0;
          for (std::size_t k = 1; k < path.waypoints.size(); ++k) {
            if ((path.waypoints[k].p - request.start.p).norm() <
                (path.waypoints[nearest].p - request.start.p).norm()) {
              nearest = k;
            }
          }
          for (std::size_t k = nearest + 1; k < path.waypoints.size(); ++k) {
            request.previous.push_back(path.waypoints[k]);
          }
          if (request.previous.size() < 2) request.previous.clear();
        }
        planning::PlanResult next = planner->plan(request);
        if (next.status != planning::PlanStatus::kSuccess) {
          ++failed;
        } else {
          path = std::move(next);
        }
      });
    }));
    points.push_back(mapper.times().points_ms);
    triangulate.push_back(mapper.times().triangulate_ms);
    divide.push_back(mapper.times().divide_ms);
    build.push_back(to_build);
    plan.push_back(to_plan);
    meshed.push_back(mapper.stats().meshed_points);
    pieces.push_back(static_cast<double>(map.pieces()));
    if (i % 200 == 199) {
      std::size_t balls = 0, small = 0;
      for (const auto& [k, ps] : map.cells()) for (const auto& q : ps) { balls += q.vertices.size() == 1; small += q.vertices.size() == 3; }
      std::cerr << fmt::format("{} cells {} voxels {} surface {} all {} balls {} triangles {} waiting {}\n", i, mapper.stats().cells, mapper.stats().voxels, mapper.stats().pieces, map.pieces(), balls, small, mapper.stats().waiting_cells);
    }
    if (i % 100 == 50) {
      blocked.push_back(judge(environment, world_of(map, poses[i].p), poses[i], scan).blocked);
    }
  }
  const auto both = [](const std::vector<double>& values) {
    return fmt::format("{:.1f} / {:.1f}", quantile(values, 0.5), quantile(values, 0.95));
  };
  std::cout << fmt::format(
      "{:<10}{} {} sweeps, median / p95 ms: cloud to certified path {}; points {}, triangulate {}, "
      "divide {}, world {}, plan {}; meshed {}, pieces {}; {} without a path; free rays blocked "
      "mean "
      "{:.2f} % max {:.2f} %\n",
      name, rebuild ? " (full rebuild)" : "", poses.size(), both(all), both(points),
      both(triangulate), both(divide), both(build), both(plan), both(meshed), both(pieces), failed,
      100.0 * std::accumulate(blocked.begin(), blocked.end(), 0.0) /
          std::max(1.0, static_cast<double>(blocked.size())),
      100.0 * quantile(blocked, 1.0));
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Unknown water, measured");
  app.require_subcommand(1);
  std::vector<std::string> names;
  int every = 40;
  bool rebuild = false;
  bool clean = false;
  CLI::App* stream = app.add_subcommand("stream", "20 sweeps a second along a mission's route");
  stream->add_option("missions", names)->required();
  stream->add_flag("--rebuild", rebuild, "Everything anew with each sweep");
  CLI::App* scan = app.add_subcommand("scan", "Single sweeps");
  scan->add_option("missions", names)->required();
  scan->add_option("--every", every, "Of so many sweeps one");
  scan->add_flag("--clean", clean, "Without noise, dropouts and particles");
  for (CLI::App* x : {stream, scan}) { x->add_option("--voxel", dive::bench::g_options.voxel_m); x->add_option("--most", dive::bench::g_most);
  x->add_option("--skin", dive::bench::g_options.skin_m);
  x->add_option("--flat", dive::bench::g_options.flat_m);
  x->add_option("--edge", dive::bench::g_options.longest_edge_m);
  x->add_option("--ball", dive::bench::g_options.ball_m); }
  CLI11_PARSE(app, argc, argv);
  for (const std::string& name : names) {
    if (stream->parsed()) dive::bench::stream_of(name, rebuild);
    if (scan->parsed()) dive::bench::scan_of(name, every, clean);
  }
  return 0;
}
