#include "planning/certify/certify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/assert.h"
#include "planning/certify/bodies.h"

namespace dive::planning {
namespace {

using certify::FixedBody;
using certify::MovingBody;
using certify::Separator;
using Eigen::Vector3d;

constexpr int kMaxHalvings = 40;

/// A pose on the way, and where it is.
struct Station {
  Pose X_WB;
  double fraction = 0.0;
};

/// A stretch of one segment, over which the body turns by `angle`.
struct Piece {
  int segment = 0;
  Station a;
  Station b;
  double angle = 0.0;
  int halvings = 0;
};

/// A direction and its separation at both ends of a piece.
struct Chord {
  double at_a = 0.0;
  double at_b = 0.0;
};

// min over t in [0, 1] of the larger of two linear functions.
double least_of_larger(const Chord& first, const Chord& second) {
  const double at_a = std::max(first.at_a, second.at_a);
  const double at_b = std::max(first.at_b, second.at_b);
  const double difference_a = first.at_a - second.at_a;
  const double difference_b = first.at_b - second.at_b;
  double least = std::min(at_a, at_b);
  if (difference_a * difference_b < 0.0) {
    const double t = difference_a / (difference_a - difference_b);
    least = std::min(least, first.at_a + t * (first.at_b - first.at_a));
  }
  return least;
}

// How far a point of the body leaves the chord of its path, in any direction.
double bulge(const MovingBody& body, const Piece& piece) {
  return body.radius() * piece.angle * piece.angle / 8.0;
}

}  // namespace

struct Certifier::Impl {
  CertifyOptions options;
  MovingBody whole;               // Hull of all parts: cheap, and enough for what is far.
  std::vector<MovingBody> parts;  // Empty when the hull is one part: then `whole` is exact.
  std::vector<FixedBody> obstacles;
  std::vector<int> nearby;  // Obstacles within the cutoff of the path as a whole.
  Certificate result;

  void find_nearby(std::span<const Pose> waypoints);
  void certify_waypoints(std::span<const Pose> waypoints);
  void certify_segment(const Piece& segment);
  void certify_pair(const Piece& piece, const MovingBody& body, int obstacle, Separator at_a,
                    Separator at_b);
  void certify_parts(const Piece& piece, int obstacle, const Separator& at_a,
                     const Separator& at_b);

  // FCL's answer; a distance of the true hull also counts as a sample.
  Separator ask(const Station& station, int segment, const MovingBody& body, int obstacle);
  void sample_parts(const Station& station, int segment, int obstacle, const Vector3d& n_W);

  [[nodiscard]] double bound(const Piece& piece, const MovingBody& body, int obstacle,
                             const Separator& at_a, const Separator& at_b) const;
  [[nodiscard]] double highest(const Piece& piece) const;
  // A bound that need not be refined is part of the result.
  [[nodiscard]] bool settled(double bound, int halvings);
  [[nodiscard]] bool is_exact(const MovingBody& body) const {
    return &body != &whole || parts.empty();
  }
  [[nodiscard]] const FixedBody& at(int obstacle) const {
    return obstacles[static_cast<std::size_t>(obstacle)];
  }
};

Separator Certifier::Impl::ask(const Station& station, int segment, const MovingBody& body,
                               int obstacle) {
  ++result.evaluations;
  const Separator separator = body.nearest(station.X_WB, at(obstacle));
  if (is_exact(body) && separator.distance < result.nearest_m) {
    result.nearest_m = separator.distance;
    result.segment = segment;
    result.fraction = station.fraction;
    result.obstacle = obstacle;
  }
  return separator;
}

void Certifier::Impl::sample_parts(const Station& station, int segment, int obstacle,
                                   const Vector3d& n_W) {
  for (const MovingBody& part : parts) {
    if (part.separation(station.X_WB, at(obstacle), n_W) >= result.nearest_m) continue;
    ask(station, segment, part, obstacle);
  }
}

double Certifier::Impl::bound(const Piece& piece, const MovingBody& body, int obstacle,
                              const Separator& at_a, const Separator& at_b) const {
  const FixedBody& other = at(obstacle);
  const Chord along_a{body.separation(piece.a.X_WB, other, at_a.n_W),
                      body.separation(piece.b.X_WB, other, at_a.n_W)};
  const Chord along_b{body.separation(piece.a.X_WB, other, at_b.n_W),
                      body.separation(piece.b.X_WB, other, at_b.n_W)};
  return least_of_larger(along_a, along_b) - bulge(body, piece);
}

double Certifier::Impl::highest(const Piece& piece) const {
  const Vector3d up = Vector3d::UnitZ();
  return std::max(whole.reach(piece.a.X_WB, up), whole.reach(piece.b.X_WB, up)) +
         bulge(whole, piece);
}

bool Certifier::Impl::settled(double bound, int halvings) {
  const bool hopeless = result.nearest_m <= 0.0 || halvings >= kMaxHalvings ||
                        result.evaluations >= options.max_evaluations;
  if (bound < result.nearest_m - options.tolerance && !hopeless) return false;
  result.clearance_m = std::min(result.clearance_m, bound);
  return true;
}

void Certifier::Impl::find_nearby(std::span<const Pose> waypoints) {
  const Vector3d margin = Vector3d::Constant(whole.radius());
  Eigen::AlignedBox3d swept;
  for (const Pose& pose : waypoints) swept.extend(pose.p - margin).extend(pose.p + margin);
  nearby.clear();
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    if (obstacles[k].box_distance(swept) < options.cutoff) nearby.push_back(static_cast<int>(k));
  }
}

// Distances at the waypoints, nearest candidates first: they set what the rest is measured against.
void Certifier::Impl::certify_waypoints(std::span<const Pose> waypoints) {
  struct Candidate {
    double at_least;
    int waypoint;
    int obstacle;
  };
  std::vector<Candidate> candidates;
  const Vector3d margin = Vector3d::Constant(whole.radius());
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Eigen::AlignedBox3d box(waypoints[i].p - margin, waypoints[i].p + margin);
    for (const int obstacle : nearby) {
      const double at_least = at(obstacle).box_distance(box);
      if (at_least < options.cutoff) {
        candidates.push_back({at_least, static_cast<int>(i), obstacle});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.at_least < b.at_least; });
  for (const Candidate& candidate : candidates) {
    if (candidate.at_least >= result.nearest_m || result.nearest_m <= 0.0) break;
    const Station station{waypoints[static_cast<std::size_t>(candidate.waypoint)], 0.0};
    const Separator separator = ask(station, candidate.waypoint, whole, candidate.obstacle);
    if (separator.separation < result.nearest_m) {
      sample_parts(station, candidate.waypoint, candidate.obstacle, separator.n_W);
    }
  }
}

void Certifier::Impl::certify_segment(const Piece& segment) {
  const Vector3d margin = Vector3d::Constant(whole.radius());
  Eigen::AlignedBox3d swept(segment.a.X_WB.p - margin, segment.a.X_WB.p + margin);
  swept.extend(Eigen::AlignedBox3d(segment.b.X_WB.p - margin, segment.b.X_WB.p + margin));
  for (const int obstacle : nearby) {
    const double at_least = at(obstacle).box_distance(swept);
    // Touching boxes say nothing: go on to the bodies, however deep the plan is in trouble.
    if (at_least > 0.0 && settled(at_least, 0)) continue;
    const Separator axis_a = whole.along_axes(segment.a.X_WB, at(obstacle));
    const Separator axis_b = whole.along_axes(segment.b.X_WB, at(obstacle));
    if (settled(bound(segment, whole, obstacle, axis_a, axis_b), 0)) continue;
    const Separator at_a = ask(segment.a, segment.segment, whole, obstacle);
    const Separator at_b = ask(segment.b, segment.segment, whole, obstacle);
    certify_pair(segment, whole, obstacle, at_a, at_b);
  }
}

void Certifier::Impl::certify_pair(const Piece& piece, const MovingBody& body, int obstacle,
                                   Separator at_a, Separator at_b) {
  if (settled(bound(piece, body, obstacle, at_a, at_b), piece.halvings)) return;
  if (!is_exact(body)) {
    certify_parts(piece, obstacle, at_a, at_b);
    return;
  }
  const double middle = (piece.a.fraction + piece.b.fraction) / 2.0;
  const Station station{interpolate(piece.a.X_WB, piece.b.X_WB, 0.5), middle};
  const Separator at_middle = ask(station, piece.segment, body, obstacle);
  const double half_angle = piece.angle / 2.0;
  const int halvings = piece.halvings + 1;
  certify_pair({piece.segment, piece.a, station, half_angle, halvings}, body, obstacle, at_a,
               at_middle);
  certify_pair({piece.segment, station, piece.b, half_angle, halvings}, body, obstacle, at_middle,
               at_b);
}

// What separates the hull of all parts may separate a part by enough; only then ask FCL again.
void Certifier::Impl::certify_parts(const Piece& piece, int obstacle, const Separator& at_a,
                                    const Separator& at_b) {
  for (const MovingBody& part : parts) {
    const double inherited = bound(piece, part, obstacle, at_a, at_b);
    if (settled(inherited, piece.halvings)) continue;
    const Separator part_a = ask(piece.a, piece.segment, part, obstacle);
    const Separator part_b = ask(piece.b, piece.segment, part, obstacle);
    certify_pair(piece, part, obstacle, part_a, part_b);
  }
}

Certifier::Certifier(const World& world, const RobotHull& hull, CertifyOptions options)
    : impl_(new Impl{options, MovingBody(hull.hull_vertices()), {}, {}, {}, {}}) {
  if (hull.parts.size() > 1) {
    for (const ConvexSolid& part : hull.parts) impl_->parts.emplace_back(part.vertices);
  }
  for (const Obstacle& obstacle : world.obstacles) impl_->obstacles.emplace_back(obstacle);
}

Certifier::Certifier(Certifier&&) noexcept = default;
Certifier::~Certifier() = default;

Certificate Certifier::certify(std::span<const Pose> waypoints) {
  DIVE_DEMAND(!waypoints.empty());
  DIVE_DEMAND(std::all_of(waypoints.begin(), waypoints.end(),
                          [](const Pose& pose) { return pose.is_finite(); }));
  Impl& impl = *impl_;
  Certificate& result = impl.result;
  result = {};
  result.clearance_m = result.nearest_m = impl.options.cutoff;
  result.highest_z_m = -std::numeric_limits<double>::infinity();
  impl.find_nearby(waypoints);
  impl.certify_waypoints(waypoints);
  // One pose is a motion that stays where it is.
  const std::size_t segments = std::max<std::size_t>(waypoints.size() - 1, 1);
  for (std::size_t i = 0; i < segments; ++i) {
    const Pose& a = waypoints[i];
    const Pose& b = waypoints[std::min(i + 1, waypoints.size() - 1)];
    const Piece piece{static_cast<int>(i), {a, 0.0}, {b, 1.0}, angle_between(a.q, b.q), 0};
    impl.certify_segment(piece);
    result.highest_z_m = std::max(result.highest_z_m, impl.highest(piece));
  }
  result.clearance_m = std::min(result.clearance_m, result.nearest_m);
  return result;
}

}  // namespace dive::planning
