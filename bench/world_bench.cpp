// The world's share of a plan: distances, the certificate, the warm start. Plain fcl::distance runs
// on the same pairs, so that the ratio is independent of the machine.

#include <vector>

#include <benchmark/benchmark.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/distance.h>

#include "bench/shipped_map.h"
#include "common/random.h"
#include "planning/certify/certify.h"
#include "planning/warm_start/warm_start.h"
#include "planning/world/box_tree.h"
#include "planning/world/primitives.h"
#include "planning/world/scene.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

World window() { return bench::shipped_map("window"); }

std::vector<Vector3d> box_vertices(const Vector3d& size) {
  std::vector<Vector3d> vertices;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      for (const double z : {-0.5, 0.5}) vertices.push_back(size.cwiseProduct(Vector3d(x, y, z)));
    }
  }
  return vertices;
}

RobotHull vehicle() { return {{{"body", box_vertices({0.80, 0.48, 0.22})}}}; }

// The hull at two consecutive waypoints, as queried by the optimiser.
std::vector<Vector3d> sweep(Random& random, const Eigen::AlignedBox3d& where) {
  const Vector3d at = where.min() + where.sizes().cwiseProduct(Vector3d(
                                        random.uniform(), random.uniform(), random.uniform()));
  const double yaw = random.uniform(-3.0, 3.0);
  const Eigen::Quaterniond q = from_rpy(0.0, 0.0, yaw);
  const Pose a{at, q};
  const Pose b{at + q * Vector3d(1.5, 0.0, 0.0), q * from_rpy(0.0, 0.0, random.uniform(-0.3, 0.3))};
  std::vector<Vector3d> points;
  for (const Pose& pose : {a, b}) {
    for (const Vector3d& v : box_vertices({0.80, 0.48, 0.22})) points.push_back(pose * v);
  }
  return points;
}

std::vector<std::vector<Vector3d>> sweeps(const Eigen::AlignedBox3d& where) {
  Random random(7);
  std::vector<std::vector<Vector3d>> result;
  for (int i = 0; i < 256; ++i) result.push_back(sweep(random, where));
  return result;
}

const Eigen::AlignedBox3d kRooms(Vector3d(0.5, -3.5, -6.5), Vector3d(11.5, 3.5, -2.5));

void contacts_in_window(benchmark::State& state) {
  Scene scene(window());
  const auto solids = sweeps(kRooms);
  std::vector<Contact> contacts;
  std::size_t next = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    scene.contacts(solids[next++ % solids.size()], 1.5, contacts);
    found += contacts.size();
  }
  state.counters["pair"] = benchmark::Counter(
      static_cast<double>(found), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(contacts_in_window)->Unit(benchmark::kMicrosecond);

void plain_fcl_in_window(benchmark::State& state) {
  const World world = window();
  const auto solids = sweeps(kRooms);
  fcl::DistanceRequestd request(true, true);
  request.gjk_solver_type = fcl::GST_LIBCCD;
  std::size_t next = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    const auto& solid = solids[next++ % solids.size()];
    const auto convex = std::make_shared<fcl::Convexd>(
        std::make_shared<std::vector<Vector3d>>(solid), 0, std::make_shared<std::vector<int>>());
    for (const Obstacle& obstacle : world.obstacles) {
      const fcl::Boxd box(std::get<Box>(obstacle.shape).size);
      fcl::Transform3d pose = fcl::Transform3d::Identity();
      pose.linear() = obstacle.X_WO.q.toRotationMatrix();
      pose.translation() = obstacle.X_WO.p;
      fcl::DistanceResultd result;
      fcl::distance(convex.get(), fcl::Transform3d::Identity(), &box, pose, request, result);
      if (result.min_distance < 1.5) ++found;
    }
  }
  state.counters["pair"] = benchmark::Counter(
      static_cast<double>(found), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(plain_fcl_in_window)->Unit(benchmark::kMicrosecond);

World boulders(int count) {
  Random random(3);
  World world;
  for (int i = 0; i < count; ++i) {
    const Vector3d at(random.uniform(0, 100), random.uniform(0, 100), random.uniform(-20, 0));
    const Vector3d turn(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
    world.obstacles.push_back({"boulder", Box{Vector3d(1.0, 0.5, 0.3)}, {at, so3_exp(turn)}});
  }
  return world;
}

const Eigen::AlignedBox3d kField(Vector3d(0, 0, -20), Vector3d(100, 100, 0));

void contacts_among_boulders(benchmark::State& state) {
  Scene scene(boulders(static_cast<int>(state.range(0))));
  const auto solids = sweeps(kField);
  std::vector<Contact> contacts;
  std::size_t next = 0;
  for (auto _ : state) scene.contacts(solids[next++ % solids.size()], 1.5, contacts);
}
BENCHMARK(contacts_among_boulders)->Arg(20)->Arg(200)->Arg(2000)->Unit(benchmark::kMicrosecond);

// The same broadphase query on FCL's tree.
void fcl_manager_among_boulders(benchmark::State& state) {
  const World world = boulders(static_cast<int>(state.range(0)));
  std::vector<fcl::CollisionObjectd> objects;
  for (const Obstacle& obstacle : world.obstacles) {
    objects.emplace_back(std::make_shared<fcl::Boxd>(std::get<Box>(obstacle.shape).size),
                         obstacle.X_WO.q.toRotationMatrix(), obstacle.X_WO.p);
  }
  fcl::DynamicAABBTreeCollisionManagerd manager;
  for (fcl::CollisionObjectd& object : objects) manager.registerObject(&object);
  manager.setup();
  const auto solids = sweeps(kField);
  std::size_t next = 0;
  int found = 0;
  for (auto _ : state) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : solids[next++ % solids.size()]) box.extend(p);
    const Vector3d grown = box.sizes() + Vector3d::Constant(3.0);
    fcl::CollisionObjectd query(std::make_shared<fcl::Boxd>(grown), Eigen::Matrix3d::Identity(),
                                box.center());
    manager.collide(&query, &found,
                    [](fcl::CollisionObjectd*, fcl::CollisionObjectd*, void* count) {
                      ++*static_cast<int*>(count);
                      return false;
                    });
  }
  benchmark::DoNotOptimize(found);
}
BENCHMARK(fcl_manager_among_boulders)->Arg(20)->Arg(200)->Arg(2000)->Unit(benchmark::kMicrosecond);

void broadphase_among_boulders(benchmark::State& state) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Obstacle& obstacle : boulders(static_cast<int>(state.range(0))).obstacles) {
    boxes.push_back(bounding_box(obstacle));
  }
  const BoxTree tree(boxes);
  const auto solids = sweeps(kField);
  std::size_t next = 0;
  int found = 0;
  for (auto _ : state) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : solids[next++ % solids.size()]) box.extend(p);
    tree.visit(box, 1.5, [&](std::size_t) {
      ++found;
      return 1.5;
    });
  }
  benchmark::DoNotOptimize(found);
}
BENCHMARK(broadphase_among_boulders)->Arg(20)->Arg(200)->Arg(2000)->Unit(benchmark::kMicrosecond);

void point_distance_among_boulders(benchmark::State& state) {
  const Scene scene(boulders(static_cast<int>(state.range(0))));
  const auto solids = sweeps(kField);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(scene.point_distance(solids[next++ % solids.size()][0]));
  }
}
BENCHMARK(point_distance_among_boulders)->Arg(20)->Arg(200)->Arg(2000);

std::vector<Pose> through_window() {
  const std::vector<Vector3d> corners{
      {-1, -2, -4}, {3.5, 1.5, -4.6}, {6.15, 2.1, -4.6}, {8.5, 1.5, -4.6}, {9.8, -2, -4.6}};
  std::vector<Pose> path;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Vector3d leg = corners[i + 1] - corners[i];
    const Eigen::Quaterniond q = from_rpy(0.0, 0.0, std::atan2(leg.y(), leg.x()));
    for (int k = 0; k < 4; ++k) path.push_back({corners[i] + leg * (k / 4.0), q});
  }
  path.push_back({corners.back(), path.back().q});
  return path;
}

void certificate_of_window(benchmark::State& state) {
  Certifier certifier(window(), vehicle());
  const auto path = through_window();
  Certificate certificate;
  for (auto _ : state) certificate = certifier.certify(path);
  state.counters["clearance_m"] = certificate.clearance_m;
  state.counters["evaluations"] = certificate.evaluations;
}
BENCHMARK(certificate_of_window)->Unit(benchmark::kMicrosecond);

// A path of 15 waypoints, turning all the time, between boulders that it touches in places.
void certificate_among_boulders(benchmark::State& state) {
  RobotHull hull = vehicle();
  for (const double x : {-0.3, 0.0, 0.3}) {
    for (const double y : {-0.3, 0.3}) {
      ConvexSolid fin{"fin", box_vertices({0.20, 0.14, 0.10})};
      for (Vector3d& v : fin.vertices) v += Vector3d(x, y, 0.0);
      hull.parts.push_back(fin);
    }
  }
  Certifier certifier(boulders(static_cast<int>(state.range(0))), hull);
  std::vector<std::vector<Pose>> paths;
  Random random(11);
  for (int i = 0; i < 64; ++i) {
    std::vector<Pose> path{
        {{random.uniform(0, 80), random.uniform(0, 80), -10.0}, from_rpy(0, 0, 0)}};
    for (int k = 0; k < 14; ++k) {
      const Eigen::Quaterniond q = path.back().q * from_rpy(0.1, 0.0, random.uniform(-0.4, 0.4));
      path.push_back({path.back().p + q * Vector3d(1.5, 0.0, 0.0), q});
    }
    paths.push_back(path);
  }
  std::size_t next = 0;
  int evaluations = 0;
  for (auto _ : state) evaluations += certifier.certify(paths[next++ % paths.size()]).evaluations;
  state.counters["evaluations"] =
      benchmark::Counter(evaluations, benchmark::Counter::kAvgIterations);
}
BENCHMARK(certificate_among_boulders)->Arg(200)->Arg(2000)->Unit(benchmark::kMicrosecond);

void warm_start_in_window(benchmark::State& state) {
  WarmStart warm_start(window(), {.limits = {.clearance = 0.5}});
  const std::vector<VirtualObstacle> virtual_obstacles{{{5.9, -2.0, -4.4}, 1.0}};
  std::uint64_t seed = 0;
  double length = 0.0;
  for (auto _ : state) {
    const auto path =
        warm_start.plan({-1, -2, -4}, {9.8, -2, -4.6}, virtual_obstacles, 1.5, ++seed);
    if (!path) {
      state.SkipWithError("no path");
      break;
    }
    for (std::size_t i = 1; i < path->size(); ++i) length += ((*path)[i] - (*path)[i - 1]).norm();
  }
  state.counters["length_m"] = benchmark::Counter(length, benchmark::Counter::kAvgIterations);
}
BENCHMARK(warm_start_in_window)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dive::planning
