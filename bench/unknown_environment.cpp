// Measurements in an unknown environment: the map from one scan, and the time from a scan to a
// certified path.
//     unknown_environment stream wreck cluttered     20 scans a second along a mission's route
//     unknown_environment scan wreck cluttered       one scan: coverage, water blocked, time
//     unknown_environment growth                     time of an update against the size of the map
//     unknown_environment hours cluttered            two hours back and forth: use of memory
// --help lists the others.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "bench/environments.h"
#include "bench/quantile.h"
#include "bench/run_study.h"
#include "common/clock.h"
#include "planning/mapping/mapper.h"
#include "planning/planner.h"
#include "planning/world/observed_map.h"
#include "planning/world/scene.h"
#include "vehicle/simulator/sensors/range_camera.h"

namespace dive::bench {
namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

constexpr double kSpeed = 0.4;    // m/s
constexpr double kRate = 20.0;    // Hz
constexpr double kAround = 12.0;  // m of the map passed to a plan, as by PlannerService

template <class Work>
double timed(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return Milliseconds(std::chrono::steady_clock::now() - begin).count();
}

planning::World world_of(const planning::ObservedMap& map, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kAround);
  planning::World world;
  map.append_within({p_W - reach, p_W + reach}, world.obstacles);
  return world;
}

/// Poses along the known routes of a mission, one per scan.
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

/// How well the pieces represent the observed surface.
struct Quality {
  double off = 0.0;         ///< Share of the true surface farther than kTolerance from the pieces.
  double voxel_off = 0.0;   ///< Share of the true surface farther than a voxel from the pieces.
  double farthest_m = 0.0;  ///< Largest distance of the true surface from the pieces, m.
  double blocked = 0.0;     ///< Share of the rays that the pieces block 0.1 m before the hit.
  /// Share of the rays that the pieces block 0.1 m off the surface at the hit.
  double blocked_upright = 0.0;
};

constexpr double kTolerance = 0.05;  // m
constexpr double kShort = 0.10;      // m before the hit at which observed free space ends

bool is_blocked(const planning::Scene& scene, const Eigen::Vector3d& from,
                const Eigen::Vector3d& to) {
  const Eigen::Vector3d path = to - from;
  const double length = path.norm();
  double at = 0.0;
  while (at < length) {
    const double distance = scene.point_distance(from + at / length * path);
    if (distance <= 0.0) return true;
    at += std::max(distance, 1e-3);
  }
  return false;
}

/// The true world, also between the rays of the scans.
struct Truth {
  Truth(const Environment& environment, const Pose& X_WB_in) : X_WB(X_WB_in) {
    options.width *= 2;
    options.height *= 2;
    options.noise_m = options.noise_share = 0.0;
    options.dropout_share = options.particles_per_m3 = 0.0;
    vehicle::RangeCamera camera(environment.world, options, 1);
    scan = camera.take(0, X_WB);
  }
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y * options.width + x);
  }
  [[nodiscard]] Eigen::Vector3d point(int x, int y) const {
    return X_WB * scan.points_B[at(x, y)].cast<double>();
  }
  [[nodiscard]] double range(int x, int y) const {
    return static_cast<double>((scan.points_B[at(x, y)] - scan.origin_B).norm());
  }
  [[nodiscard]] bool hits(int x, int y) const { return range(x, y) <= options.reach_m; }
  /// True if the scan observed the surface on all sides, so that it is not the edge of an occluding
  /// object.
  [[nodiscard]] bool goes_on(int x, int y) const {
    constexpr double kOneSurface = 0.4;  // m
    for (const auto& [dx, dy] : {std::pair(2, 0), {-2, 0}, {0, 2}, {0, -2}}) {
      if (!((point(x + dx, y + dy) - point(x, y)).norm() < kOneSurface)) return false;
    }
    return true;
  }
  /// Sine of the angle between the ray and the surface that it hits.
  [[nodiscard]] double sine(int x, int y, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d normal =
        (point(x + 1, y) - point(x, y)).cross(point(x, y + 1) - point(x, y));
    return std::max(std::abs(normal.normalized().dot(direction)), 0.02);
  }

  Pose X_WB;
  vehicle::RangeCameraOptions options;
  RangeScan scan;
};

Quality evaluate(const Environment& environment, const planning::World& pieces, const Pose& X_WB) {
  const planning::Scene scene(pieces);
  const Truth truth(environment, X_WB);
  const Eigen::Vector3d sensor_origin_W = X_WB * truth.scan.origin_B.cast<double>();
  Quality quality;
  double surface = 0.0;
  double rays = 0.0;
  for (int y = 2; y + 2 < truth.options.height; ++y) {
    for (int x = 2; x + 2 < truth.options.width; ++x) {
      const double range = truth.range(x, y);
      if (!std::isfinite(range)) continue;
      const Eigen::Vector3d p_W = truth.point(x, y);
      const Eigen::Vector3d direction = (p_W - sensor_origin_W).normalized();
      const auto blocks = [&](double margin) {
        const double end = std::min(range, truth.options.reach_m) - margin;
        return end > 0.0 && is_blocked(scene, sensor_origin_W, sensor_origin_W + end * direction)
                   ? 1.0
                   : 0.0;
      };
      ++rays;
      quality.blocked += blocks(kShort);
      if (!truth.hits(x, y)) continue;
      quality.blocked_upright += blocks(kShort / truth.sine(x, y, direction));
      if (!truth.goes_on(x, y)) continue;
      ++surface;
      const double distance = scene.point_distance(p_W);
      quality.farthest_m = std::max(quality.farthest_m, distance);
      if (distance > kTolerance) ++quality.off;
      if (distance > planning::MapperOptions{}.voxel_m) ++quality.voxel_off;
    }
  }
  quality.off /= std::max(surface, 1.0);
  quality.voxel_off /= std::max(surface, 1.0);
  quality.blocked /= std::max(rays, 1.0);
  quality.blocked_upright /= std::max(rays, 1.0);
  return quality;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

std::string both(const std::vector<double>& values) {
  return fmt::format("{:.1f} / {:.1f}", quantile(values, 0.5), quantile(values, 0.95));
}

/// The map from single scans, all at once.
void scan_of(const std::string& name, int every, bool clean) {
  const Environment environment = load_environment(name);
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  vehicle::RangeCameraOptions options;
  planning::MapperOptions mapping;
  mapping.confirm = 1;
  mapping.points_per_update = 1'000'000;
  if (clean) {
    options.noise_m = 1e-5;  // no two scans are equal
    options.noise_share = options.dropout_share = options.particles_per_m3 = 0.0;
    mapping.noise.constant_m = mapping.noise.share = 0.0;
  }
  vehicle::RangeCamera camera(environment.world, options, 1);
  std::vector<double> total, triangulate, divide, pieces, off, voxel_off, farthest, blocked,
      upright;
  Utime now = 0;
  for (std::size_t i = 0; i < poses.size(); i += static_cast<std::size_t>(every)) {
    planning::Mapper mapper(environment.hull, mapping, clock);
    planning::ObservedMap map;
    // the first fills the voxels, the second splits all surfaces
    for (int pass = 0; pass < 2; ++pass) {
      const RangeScan scan = camera.take(now += 200'000, poses[i]);
      if (const auto update = mapper.add(scan, {poses[i]})) {
        static_cast<void>(map.apply(update->obstacles));
      }
      if (pass == 0) mapper.rebuild_all();
    }
    total.push_back(mapper.times().total_ms);
    triangulate.push_back(mapper.times().triangulate_ms);
    divide.push_back(mapper.times().divide_ms);
    pieces.push_back(static_cast<double>(map.pieces()));
    const Quality quality = evaluate(environment, world_of(map, poses[i].p), poses[i]);
    off.push_back(100.0 * quality.off);
    voxel_off.push_back(100.0 * quality.voxel_off);
    farthest.push_back(quality.farthest_m);
    blocked.push_back(100.0 * quality.blocked);
    upright.push_back(100.0 * quality.blocked_upright);
  }
  std::cout << fmt::format(
      "{}{}: {} scans; median / p95 ms: all {}, triangulate {}, divide {}; {:.0f} pieces\n"
      "  true surface off the pieces: by more than 0.05 m {:.2f} %, more than a voxel {:.3f} %, "
      "farthest {:.2f} m\n  free rays blocked: up to 0.1 m before the hit {:.2f} % (worst scan "
      "{:.2f} %), up to 0.1 m off the surface {:.2f} %\n",
      name, clean ? " (no noise)" : "", total.size(), both(total), both(triangulate), both(divide),
      quantile(pieces, 0.5), mean(off), mean(voxel_off), quantile(farthest, 1.0), mean(blocked),
      quantile(blocked, 1.0), mean(upright));
}

/// The rest of `path` from the waypoint after the one nearest to `start`, as the previous plan of a
/// request; empty if that is too short, or if the path leads to another goal.
std::vector<Pose> rest_of(const planning::PlanResult& path, const Pose& start, const Pose& goal) {
  if (path.waypoints.empty() || (path.waypoints.back().p - goal.p).norm() >= 0.5) return {};
  std::vector<Pose> rest{start};
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < path.waypoints.size(); ++k) {
    if ((path.waypoints[k].p - start.p).norm() < (path.waypoints[nearest].p - start.p).norm()) {
      nearest = k;
    }
  }
  for (std::size_t k = nearest + 1; k < path.waypoints.size(); ++k) {
    rest.push_back(path.waypoints[k]);
  }
  if (rest.size() < 2) rest.clear();
  return rest;
}

/// The request at `start`: to the last goal of the mission that is more than 1 m away.
planning::PlanRequest request_at(const Pose& start, const Environment& environment,
                                 const planning::PlanResult& path) {
  planning::PlanRequest request = environment.legs.back().request;
  request.start = start;
  for (const EnvironmentLeg& leg : environment.legs) {
    if ((leg.request.goal.p - start.p).norm() > 1.0) request.goal = leg.request.goal;
  }
  request.previous = rest_of(path, start, request.goal);
  return request;
}

/// Figures of a stream, one per scan, except the last two: one per 100 scans.
struct StreamFigures {
  std::vector<double> all, points, triangulate, divide, build, plan, meshed, blocked, upright;
  int failed = 0;  ///< Number of failed plans.
};

void stream_of(const std::string& name, bool rebuild) {
  const Environment environment = load_environment(name);
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  vehicle::RangeCameraOptions options;
  options.rate_hz = kRate;
  vehicle::RangeCamera camera(environment.world, options, 1);
  planning::MapperOptions mapping;
  if (rebuild) mapping.points_per_update = 100'000'000;
  planning::Mapper mapper(environment.hull, mapping, clock);
  planning::ObservedMap map;
  planning::PlanResult path;
  StreamFigures figures;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const RangeScan scan = camera.take(from_seconds(static_cast<double>(i + 1) / kRate), poses[i]);
    if (rebuild) mapper.rebuild_all();
    const Eigen::Vector3d v_W = poses[i].q * Eigen::Vector3d(kSpeed, 0.0, 0.0);
    figures.all.push_back(timed([&] {
      if (auto update = mapper.add(scan, {poses[i], v_W}))
        static_cast<void>(map.apply(update->obstacles));
      std::optional<planning::Planner> planner;
      planning::World world;
      figures.build.push_back(timed([&] {
        world = world_of(map, poses[i].p);
        planner.emplace(world, environment.hull, planning::PlannerOptions{}, clock);
      }));
      figures.plan.push_back(timed([&] {
        planning::PlanResult next = planner->plan(request_at(poses[i], environment, path));
        if (!next.accepted) {
          ++figures.failed;
        } else {
          path = std::move(next);
        }
      }));
    }));
    figures.points.push_back(mapper.times().points_ms);
    figures.triangulate.push_back(mapper.times().triangulate_ms);
    figures.divide.push_back(mapper.times().divide_ms);
    figures.meshed.push_back(mapper.stats().meshed_points);
    if (i % 100 == 50) {
      const Quality quality = evaluate(environment, world_of(map, poses[i].p), poses[i]);
      figures.blocked.push_back(100.0 * quality.blocked);
      figures.upright.push_back(100.0 * quality.blocked_upright);
    }
  }
  std::cout << fmt::format(
      "{}{}: {} scans; median / p95 ms: scan to certified path {}; points {}, triangulate {}, "
      "divide {}, world {}, plan and certify {}\n  {} points divided again, {} pieces in the end; "
      "{} plans failed; free rays blocked {:.2f} %, off the surface {:.2f} %\n",
      name, rebuild ? " (all again each time)" : "", figures.all.size(), both(figures.all),
      both(figures.points), both(figures.triangulate), both(figures.divide), both(figures.build),
      both(figures.plan), both(figures.meshed), map.pieces(), figures.failed, mean(figures.blocked),
      mean(figures.upright));
}

/// Resident memory of this process, MB.
double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Swims back and forth, with two scans a second for two hours. A slow drift displaces the scans,
/// so that there is always something new to map.
void swim_for_hours(const std::string& name) {
  constexpr double kPeriod = 0.5;  // s
  constexpr double kHours = 2.0;
  constexpr double kDriftPerHour = 20.0;  // m
  const Environment environment = load_environment(name);
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  vehicle::RangeCamera camera(environment.world, {}, 1);
  planning::Mapper mapper(environment.hull, {}, clock);
  planning::ObservedMap map;
  const auto stride = static_cast<std::size_t>(kPeriod * kRate);
  const std::size_t round = 2 * (poses.size() - 1);
  for (int count = 1; count <= static_cast<int>(kHours * 3600.0 / kPeriod); ++count) {
    const std::size_t at = static_cast<std::size_t>(count) * stride % round;
    Pose X_WB = poses[std::min(at, round - at)];
    const double t = count * kPeriod;
    const RangeScan scan = camera.take(from_seconds(t), X_WB);
    X_WB.p.y() += kDriftPerHour * t / 3600.0;
    if (const auto update = mapper.add(scan, {X_WB})) {
      static_cast<void>(map.apply(update->obstacles));
    }
    if (count % static_cast<int>(600.0 / kPeriod) != 0) continue;
    std::cout << fmt::format("{}: {:3.0f} min, {} voxels, {} cells, {} pieces, {:.0f} MB\n", name,
                             t / 60.0, mapper.stats().voxels, mapper.stats().cells, map.pieces(),
                             resident_mb());
  }
}

/// The same scans, with a growing map elsewhere.
void grow() {
  const Environment environment = load_environment("wreck");
  const std::vector<Pose> poses = swum(environment);
  SteadyClock clock;
  for (const int points : {0, 10'000, 100'000, 1'000'000}) {
    vehicle::RangeCamera camera(environment.world, {}, 1);
    planning::MapperOptions mapping;
    mapping.max_voxels = 2'000'000;
    planning::Mapper mapper(environment.hull, mapping, clock);
    constexpr int kTile = 100;  // points along the side of a tile
    for (int tile = 0; tile * kTile * kTile < points; ++tile) {
      std::vector<Eigen::Vector3f> bed;
      for (int k = 0; k < kTile * kTile; ++k) {
        bed.emplace_back(100.0F + 0.15F * static_cast<float>(tile % 10 * kTile + k % kTile),
                         0.15F * static_cast<float>(tile / 10 * kTile + k / kTile), -20.0F);
      }
      static_cast<void>(mapper.add_cloud(bed));
    }
    std::vector<double> took;
    for (std::size_t i = 0; i < 100; ++i) {
      const RangeScan scan =
          camera.take(from_seconds(static_cast<double>(i + 1) / kRate), poses[i]);
      static_cast<void>(mapper.add(scan, {poses[i]}));
      if (i >= 20) took.push_back(mapper.times().total_ms);
    }
    std::cout << fmt::format("beside {} points ({} cells): median / p95 of an update {} ms\n",
                             points, mapper.stats().cells, both(took));
  }
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Measurements of mapping in an unknown environment");
  app.require_subcommand(1);
  std::vector<std::string> names;
  int every = 40;
  bool rebuild = false;
  bool clean = false;
  CLI::App* stream = app.add_subcommand("stream", "20 scans a second along a mission's route");
  stream->add_option("missions", names)->required();
  stream->add_flag("--rebuild", rebuild, "Rebuild all surfaces with each scan");
  CLI::App* scan = app.add_subcommand("scan", "Single scans");
  scan->add_option("missions", names)->required();
  scan->add_option("--every", every, "Number of poses per scan")->check(CLI::PositiveNumber);
  scan->add_flag("--clean", clean, "Without noise, dropouts and particles");
  CLI::App* hours = app.add_subcommand("hours", "Two hours back and forth: use of memory");
  hours->add_option("missions", names)->required();
  CLI::App* growth = app.add_subcommand("growth", "Time of an update against the size of the map");
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    if (growth->parsed()) dive::bench::grow();
    for (const std::string& name : names) {
      if (stream->parsed()) dive::bench::stream_of(name, rebuild);
      if (hours->parsed()) dive::bench::swim_for_hours(name);
      if (scan->parsed()) dive::bench::scan_of(name, every, clean);
    }
  });
}
