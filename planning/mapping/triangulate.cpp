// The only file that includes PCL, whose templates are slow to compile. Greedy projection is
// compiled here because PCL's library for it links VTK, which the command would load at every
// start.
#include "planning/mapping/triangulate.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <pcl/console/print.h>
#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/gp3.h>
#include <pcl/surface/impl/gp3.hpp>
#include <pcl/surface/impl/reconstruction.hpp>

#include "common/se3.h"

namespace dive::planning {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kMinSurfacePoints = 4;  // least number of points for a surface
constexpr int kMaxNeighbours = 40;
constexpr int kStitchNeighbours = 10;
constexpr std::size_t kStitches = 2;  // triangles from one point of a rim

using Cloud = pcl::PointCloud<pcl::PointNormal>;
using Tree = pcl::search::KdTree<pcl::PointNormal>;

Cloud::Ptr to_cloud(std::span<const Vector3f> points) {
  const Cloud::Ptr cloud(new Cloud);
  cloud->resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) (*cloud)[i].getVector3fMap() = points[i];
  return cloud;
}

Tree::Ptr to_tree(const Cloud::Ptr& cloud) {
  const Tree::Ptr tree(new Tree);
  tree->setSortedResults(false);
  tree->setInputCloud(cloud);
  return tree;
}

/// The points projected onto the planes of their neighbours, with normals.
Cloud::Ptr smoothed(std::span<const Vector3f> points, std::span<const float> slack,
                    int neighbours) {
  const Cloud::Ptr cloud = to_cloud(points);
  const Tree::Ptr tree = to_tree(cloud);
  const Cloud::Ptr result(new Cloud(*cloud));
  pcl::Indices nearest;
  std::vector<float> distances;
  const int count = std::min(neighbours, static_cast<int>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    pcl::PointNormal& p = (*result)[i];
    p.getNormalVector3fMap() = Vector3f::UnitZ();
    if (tree->nearestKSearch((*cloud)[i], count, nearest, distances) < 3) continue;
    Eigen::Vector4f plane;
    float curvature = 0.0F;
    if (!pcl::computePointNormal(*cloud, nearest, plane, curvature) || !plane.allFinite()) continue;
    p.getNormalVector3fMap() = plane.head<3>();
    const float off = plane.head<3>().dot(points[i]) + plane[3];
    if (std::abs(off) <= slack[i]) p.getVector3fMap() = points[i] - off * plane.head<3>();
  }
  return result;
}

/// Keeps one of the points that are nearly at the same position.
Cloud::Ptr thinned(const Cloud& cloud, float apart, std::vector<std::uint32_t>& stands_for) {
  const Cloud::Ptr result(new Cloud);
  std::unordered_map<std::int64_t, std::uint32_t> first;
  stands_for.resize(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vector3f at = cloud[i].getVector3fMap() / apart;
    const auto part = [](float c) {
      return static_cast<std::int64_t>(std::floor(c)) & ((std::int64_t{1} << 21) - 1);
    };
    const std::int64_t key = part(at.x()) << 42 | part(at.y()) << 21 | part(at.z());
    const auto [where, is_new] = first.emplace(key, static_cast<std::uint32_t>(result->size()));
    if (is_new) result->push_back(cloud[i]);
    stands_for[i] = where->second;
  }
  return result;
}

/// Continues the surface where greedy projection stops (at edges, where normals differ): from every
/// point of a rim to the nearest two others to which it has no edge.
void stitch(const Cloud::Ptr& cloud, const Tree& tree, float longest, SurfaceMesh& mesh) {
  std::unordered_map<std::uint64_t, int> triangles_at;
  const auto edge = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++triangles_at[edge(t[i], t[(i + 1) % 3])];
  }
  std::vector<char> has_triangle(mesh.points.size());
  std::vector<char> is_rim(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      has_triangle[t[i]] = true;
      if (triangles_at[edge(t[i], t[(i + 1) % 3])] == 1) {
        is_rim[t[i]] = is_rim[t[(i + 1) % 3]] = true;
      }
    }
  }
  pcl::Indices nearest;
  std::vector<float> distances;
  for (std::uint32_t i = 0; i < mesh.points.size(); ++i) {
    if (has_triangle[i] && !is_rim[i]) continue;
    const int found = tree.nearestKSearch((*cloud)[i], kStitchNeighbours, nearest, distances);
    std::vector<std::pair<float, std::uint32_t>> others;
    for (std::size_t k = 0; k < static_cast<std::size_t>(found); ++k) {
      const auto other = static_cast<std::uint32_t>(nearest[k]);
      if (other == i || distances[k] > longest * longest) continue;
      if (triangles_at.contains(edge(i, other)) && triangles_at[edge(i, other)] > 1) continue;
      if (!has_triangle[other] || is_rim[other]) others.emplace_back(distances[k], other);
    }
    std::sort(others.begin(), others.end());
    for (std::size_t k = 0; k + 1 < others.size() && k < kStitches; ++k) {
      mesh.triangles.push_back({i, others[k].second, others[k + 1].second});
    }
  }
}

}  // namespace

SurfaceMesh triangulate(std::span<const Vector3f> points, std::span<const float> slack,
                        const TriangulationOptions& options) {
  SurfaceMesh mesh;
  if (points.size() < kMinSurfacePoints) {
    mesh.points.assign(points.begin(), points.end());
    for (std::uint32_t i = 0; i < points.size(); ++i) mesh.stands_for.push_back(i);
    return mesh;
  }
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // it would write to the terminal
  const Cloud::Ptr cloud =
      thinned(*smoothed(points, slack, options.neighbours), options.apart_m, mesh.stands_for);
  for (const pcl::PointNormal& p : *cloud) mesh.points.emplace_back(p.getVector3fMap());
  if (cloud->size() < kMinSurfacePoints) return mesh;

  pcl::GreedyProjectionTriangulation<pcl::PointNormal> greedy;
  greedy.setInputCloud(cloud);
  const Tree::Ptr tree = to_tree(cloud);
  greedy.setSearchMethod(tree);
  greedy.setSearchRadius(options.longest_edge_m);
  greedy.setMu(options.edge_ratio);
  greedy.setMaximumNearestNeighbors(std::min(kMaxNeighbours, static_cast<int>(cloud->size())));
  greedy.setMaximumSurfaceAngle(deg_to_rad(60.0));
  greedy.setMinimumAngle(deg_to_rad(8.0));
  greedy.setMaximumAngle(deg_to_rad(140.0));
  greedy.setNormalConsistency(false);
  std::vector<pcl::Vertices> polygons;
  greedy.reconstruct(polygons);
  mesh.triangles.reserve(polygons.size());
  for (const pcl::Vertices& polygon : polygons) {
    if (polygon.vertices.size() != 3) continue;
    mesh.triangles.push_back({static_cast<std::uint32_t>(polygon.vertices[0]),
                              static_cast<std::uint32_t>(polygon.vertices[1]),
                              static_cast<std::uint32_t>(polygon.vertices[2])});
  }
  stitch(cloud, *tree, 0.5F * options.longest_edge_m, mesh);
  return mesh;
}

}  // namespace dive::planning
