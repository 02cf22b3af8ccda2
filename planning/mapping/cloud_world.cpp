#include "planning/mapping/cloud_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/clock.h"
#include "planning/mapping/mapper.h"
#include "planning/mapping/voxel_cell.h"
#include "planning/world/box_tree.h"
#include "planning/world/nearest_in_hull.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kMaxVoxel = 2.0;  // m, as the mapper allows
constexpr double kWiden = 1.2;     // ratio of one tried voxel width to the one before
constexpr double kMaxEdge = 5.0;   // m, as the mapper allows
// ratio of the longest edge of a surface to the spacing of its points
constexpr double kEdgeSpacings = 3.0;
constexpr double kCover = 0.3;  // in voxels: growth limit of a piece, and the radius of a ball
constexpr std::size_t kBlock = 5'000;  // points triangulated at once
constexpr std::size_t kSpacingSample = 500;
constexpr std::size_t kSpacingNeighbour = 4;
constexpr float kWellInside = 1e-3F;  // m: margin for rounding of floats

/// Index of the voxel that contains a point.
using Place = std::array<std::int32_t, 3>;

struct PlaceHash {
  std::size_t operator()(const Place& place) const {
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (const std::int32_t c : place) {
      hash = (hash ^ static_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29U;
    }
    return hash;
  }
};

// No overflow: points are within 10^8 m of the origin, and steps are at least millimetres.
Place place_of(const Vector3f& p, double step) {
  Place place{};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    place[static_cast<std::size_t>(axis)] =
        static_cast<std::int32_t>(std::clamp(std::floor(double{p[axis]} / step), -2e9, 2e9));
  }
  return place;
}

/// The first point of every voxel; absent if there are more than `most`.
std::optional<std::vector<Vector3f>> thinned(std::span<const Vector3f> points, double voxel,
                                             std::size_t most) {
  std::unordered_set<Place, PlaceHash> taken;
  std::vector<Vector3f> result;
  for (const Vector3f& p : points) {
    if (!taken.insert(place_of(p, voxel)).second) continue;
    if (result.size() == most) return std::nullopt;
    result.push_back(p);
  }
  return result;
}

/// Median distance of a point to its fourth neighbour: on a grid, the grid's spacing.
double spacing_of(const std::vector<Vector3f>& points) {
  if (points.size() <= kSpacingNeighbour) return 0.0;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kSpacingSample);
  std::vector<float> spacings;
  for (std::size_t i = 0; i < points.size(); i += step) {
    std::array<float, kSpacingNeighbour + 1> least{};  // including the point itself
    least.fill(std::numeric_limits<float>::infinity());
    for (const Vector3f& p : points) {
      float d = (p - points[i]).squaredNorm();
      if (d >= least.back()) continue;
      for (float& at : least) {
        if (d < at) std::swap(d, at);
      }
    }
    spacings.push_back(std::sqrt(least.back()));
  }
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  return double{*middle};
}

using Cells = std::map<CellKey, std::vector<Polytope>>;

/// Block by block, halved at the median until small, because the time of PCL's triangulation grows
/// with the square of its input. When a later block adds points to a cell, the mapper splits the
/// cell's surface again and joins it with the existing one.
void add_in_blocks(std::span<Vector3f> points, Mapper& mapper, Cells& cells) {
  if (points.size() > kBlock) {
    Eigen::AlignedBox3f box;
    for (const Vector3f& p : points) box.extend(p);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t half = points.size() / 2;
    const auto less = [axis](const Vector3f& a, const Vector3f& b) {
      if (a[axis] != b[axis]) return a[axis] < b[axis];
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    };
    std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half),
                     points.end(), less);
    add_in_blocks(points.first(half), mapper, cells);
    add_in_blocks(points.subspan(half), mapper, cells);
    return;
  }
  ObstacleUpdate update = mapper.add_cloud(points);
  for (MapCell& cell : update.cells) cells[cell.key] = std::move(cell.pieces);
}

AlignedBox3d box_of(const Polytope& piece) {
  AlignedBox3d box;
  for (const Vector3d& v : piece.vertices) box.extend(v);
  return {box.min() - Vector3d::Constant(piece.radius),
          box.max() + Vector3d::Constant(piece.radius)};
}

/// Makes the pieces contain every point: a piece that misses a point by no more than `reach` grows,
/// and a point farther from all pieces becomes a ball. Distances are to the original pieces, so
/// that none grows by more than `reach`.
class Cover {
 public:
  Cover(std::vector<Polytope> pieces, double reach)
      : pieces_(std::move(pieces)), tree_(boxes_of(pieces_)), reach_(reach) {
    for (const Polytope& piece : pieces_) {
      facets_.emplace_back(piece);
      radii_.push_back(piece.radius);
    }
  }

  void hold(const Vector3f& p) {
    const Vector3d at = p.cast<double>();
    double best = reach_;
    std::size_t nearest = pieces_.size();
    tree_.visit(at, reach_, [&](std::size_t i) {
      if (best <= 0.0) return -1.0;
      const Polytope& piece = pieces_[i];
      double distance = 0.0;
      if (piece.vertices.size() < 3 || !facets_[i].contains(p, -kWellInside)) {
        distance = (at - nearest_in_hull(piece.vertices, at)).norm() - radii_[i];
      }
      if (distance <= best) {
        best = distance;
        nearest = i;
      }
      return best > 0.0 ? best : -1.0;
    });
    if (nearest == pieces_.size()) {
      put_ball(p);
    } else if (best > 0.0) {
      pieces_[nearest].radius = std::max(pieces_[nearest].radius, radii_[nearest] + best);
    }
  }

  [[nodiscard]] std::vector<Polytope> take() && {
    for (const auto& [place, centres] : balls_) {
      for (const Vector3f& c : centres) rest_.push_back(c);
    }
    // Sorted by position, because the order of the table depends on the library.
    std::sort(rest_.begin(), rest_.end(), [](const Vector3f& a, const Vector3f& b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    });
    for (const Vector3f& c : rest_) pieces_.push_back({{c.cast<double>()}, reach_});
    return std::move(pieces_);
  }

 private:
  static std::vector<AlignedBox3d> boxes_of(const std::vector<Polytope>& pieces) {
    std::vector<AlignedBox3d> boxes;
    boxes.reserve(pieces.size());
    for (const Polytope& piece : pieces) boxes.push_back(box_of(piece));
    return boxes;
  }

  void put_ball(const Vector3f& p) {
    const Place place = place_of(p, reach_);
    for (int i = 0; i < 27; ++i) {
      const Place other{place[0] + i / 9 - 1, place[1] + i / 3 % 3 - 1, place[2] + i % 3 - 1};
      const auto at = balls_.find(other);
      if (at == balls_.end()) continue;
      for (const Vector3f& c : at->second) {
        if ((c - p).cast<double>().norm() <= reach_) return;
      }
    }
    balls_[place].push_back(p);
  }

  std::vector<Polytope> pieces_;
  BoxTree tree_;
  double reach_;
  std::vector<Facet> facets_;
  std::vector<double> radii_;  ///< Original radii.
  std::unordered_map<Place, std::vector<Vector3f>, PlaceHash> balls_;
  std::vector<Vector3f> rest_;
};

MapperOptions mapper_options(double voxel, double longest_edge) {
  MapperOptions options;
  const double scale = voxel / options.voxel_m;
  options.voxel_m = voxel;
  options.noise.constant_m *= scale;
  options.flat_m *= scale;
  options.ball_m *= scale;
  options.longest_edge_m = longest_edge;
  return options;
}

Obstacle obstacle_of(Polytope piece, const Vector3d& to_W, const Vector3d& origin) {
  AlignedBox3d box;
  for (const Vector3d& v : piece.vertices) box.extend(v);
  // Vertices relative to their own centre, as for the pieces of a map.
  const Vector3d middle = box.center();
  for (Vector3d& v : piece.vertices) v -= middle;
  Obstacle obstacle;
  obstacle.X_WO.p = middle + to_W;
  const Vector3d at = obstacle.X_WO.p + origin;
  obstacle.name = fmt::format("cloud at {:.1f}, {:.1f}, {:.1f}", at.x(), at.y(), at.z());
  obstacle.shape = std::move(piece);
  return obstacle;
}

/// The points to convert, and their resolution.
struct Sampling {
  std::vector<Vector3f> within;  ///< Points within the region; empty if that is all of the cloud.
  std::vector<Vector3f> thin;    ///< One point per voxel.
  double voxel = 0.0;
  bool is_all = true;
};

// Points up to this far outside the region still shape the surface within.
constexpr double kRegionMargin = kMaxEdge + kMaxVoxel;

tl::expected<Sampling, std::string> sample(const CloudFile& cloud,
                                           const CloudWorldOptions& options) {
  Sampling sampling;
  sampling.voxel = options.voxel_m;
  std::optional<std::vector<Vector3f>> thin =
      thinned(cloud.points, sampling.voxel, options.max_voxels);
  if (!thin && !options.region.isEmpty()) {
    const Vector3d margin = Vector3d::Constant(kRegionMargin);
    const AlignedBox3d box(options.region.min() - margin - cloud.origin,
                           options.region.max() + margin - cloud.origin);
    for (const Vector3f& p : cloud.points) {
      if (box.contains(p.cast<double>())) sampling.within.push_back(p);
    }
    sampling.is_all = sampling.within.size() == cloud.points.size();
  }
  const std::span<const Vector3f> points =
      sampling.is_all ? std::span(cloud.points) : std::span<const Vector3f>(sampling.within);
  if (!thin) thin = thinned(points, sampling.voxel, options.max_voxels);
  while (!thin && sampling.voxel < kMaxVoxel) {
    sampling.voxel = std::min(kWiden * sampling.voxel, kMaxVoxel);
    thin = thinned(points, sampling.voxel, options.max_voxels);
  }
  if (!thin) {
    return tl::unexpected(
        fmt::format("it is too wide: even with one point every {:g} m more than {} are left; "
                    "give a part of it",
                    kMaxVoxel, options.max_voxels));
  }
  sampling.thin = std::move(*thin);
  return sampling;
}

std::string validate(const CloudFile& cloud, const CloudWorldOptions& options) {
  if (cloud.points.empty()) return "it holds no point";
  if (!(options.voxel_m >= 0.02 && options.voxel_m <= kMaxVoxel)) {
    return fmt::format("voxel_m must be in [0.02, {:g}], not {:g}", kMaxVoxel, options.voxel_m);
  }
  if (options.max_voxels < 1) return "max_voxels must be 1 or more";
  return {};
}

/// Sets the frame W of the result, and its bounds.
void set_frame(const CloudFile& cloud, const CloudWorldOptions& options, CloudWorld& result) {
  AlignedBox3d bounds;  // in the axes of the file
  for (const Vector3f& p : cloud.points) bounds.extend(cloud.origin + p.cast<double>());
  result.has_surface = bounds.max().z() <= 0.0;
  result.origin = cloud.origin;
  const double highest = options.region.isEmpty()
                             ? bounds.max().z()
                             : std::max(bounds.max().z(), options.region.max().z());
  result.origin.z() = result.has_surface ? 0.0 : std::ceil(highest) + kNoSurface;
  result.bounds_W = AlignedBox3d(bounds.min() - result.origin, bounds.max() - result.origin);
}

/// Sets voxel and longest edge for the spacing of the points, and warns if that is large.
void set_resolution(const Sampling& sampling, const CloudWorldOptions& options,
                    CloudWorld& result) {
  if (sampling.voxel > options.voxel_m) {
    result.warnings.push_back(
        fmt::format("it is wide: one point every {:.2f} m shapes the surfaces, instead of every "
                    "{:.2f} m, and they are up to {:.2f} m too thick",
                    sampling.voxel, options.voxel_m, kCover * sampling.voxel));
  }
  const double spacing = spacing_of(sampling.thin);
  result.voxel_m = std::min(std::max(sampling.voxel, 0.5 * spacing), kMaxVoxel);
  const MapperOptions defaults;
  const double usual_edge = defaults.longest_edge_m / defaults.voxel_m * result.voxel_m;
  result.longest_edge_m = std::min(std::max(usual_edge, kEdgeSpacings * spacing), kMaxEdge);
  if (kEdgeSpacings * spacing > kMaxEdge) {
    result.warnings.push_back(
        fmt::format("its points are about {:.1f} m from each other: between those farther than "
                    "{:g} m the water is taken to be free",
                    spacing, kMaxEdge));
  } else if (result.longest_edge_m > 2.0 * defaults.longest_edge_m) {
    result.warnings.push_back(fmt::format(
        "its points are about {:.1f} m from each other: gaps up to {:.1f} m are taken to be closed",
        spacing, result.longest_edge_m));
  }
}

/// Convex pieces that contain all `points`, in the file's frame.
std::vector<Polytope> pieces_of(std::span<const Vector3f> points, std::vector<Vector3f>& thin,
                                const CloudWorld& result) {
  SteadyClock clock;
  Mapper mapper(RobotHull{}, mapper_options(result.voxel_m, result.longest_edge_m), clock);
  Cells cells;
  add_in_blocks(thin, mapper, cells);
  std::vector<Polytope> pieces;
  for (auto& [key, some] : cells) {
    std::move(some.begin(), some.end(), std::back_inserter(pieces));
  }
  Cover cover(std::move(pieces), kCover * result.voxel_m);
  for (const Vector3f& p : points) cover.hold(p);
  return std::move(cover).take();
}

}  // namespace

tl::expected<CloudWorld, std::string> world_from_cloud(const CloudFile& cloud,
                                                       const CloudWorldOptions& options) {
  if (std::string problem = validate(cloud, options); !problem.empty()) {
    return tl::unexpected(std::move(problem));
  }
  CloudWorld result;
  result.warnings = cloud.warnings;
  set_frame(cloud, options, result);

  tl::expected<Sampling, std::string> sampling = sample(cloud, options);
  if (!sampling) return tl::unexpected(std::move(sampling.error()));
  const std::span<const Vector3f> points =
      sampling->is_all ? std::span(cloud.points) : std::span<const Vector3f>(sampling->within);
  result.points = points.size();
  result.voxels = sampling->thin.size();
  if (!sampling->is_all) {
    result.known_W =
        AlignedBox3d(options.region.min() - result.origin, options.region.max() - result.origin);
    result.warnings.push_back(fmt::format("{} of {} points are far away and left out",
                                          cloud.points.size() - points.size(),
                                          cloud.points.size()));
  }
  set_resolution(*sampling, options, result);
  const Vector3d to_W = cloud.origin - result.origin;
  for (Polytope& piece : pieces_of(points, sampling->thin, result)) {
    result.world.obstacles.push_back(obstacle_of(std::move(piece), to_W, result.origin));
  }
  return result;
}

tl::expected<CloudWorld, std::string> world_from_cloud(const std::string& path,
                                                       const CloudOptions& file,
                                                       const CloudWorldOptions& options) {
  const tl::expected<CloudFile, std::string> cloud = read_cloud(path, file);
  if (!cloud) return tl::unexpected(cloud.error());
  return world_from_cloud(*cloud, options);
}

}  // namespace dive::planning
