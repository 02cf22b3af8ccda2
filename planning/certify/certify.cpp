#include "planning/certify/certify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/assert.h"
#include "planning/certify/bodies.h"
#include "planning/certify/neighbours.h"

namespace dive::planning {
namespace {

using certify::FixedBody;
using certify::MovingBody;
using certify::Separator;
using Eigen::Vector3d;

constexpr int kMaxHalvings = 40;
constexpr double kFinely = 0.1;  // share of the tolerance, near the requested clearance

/// A pose on the path, and its position along it.
struct Station {
  Pose X_WB;
  double fraction = 0.0;
};

/// A part of one segment, over which the body turns by `angle`.
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

// Largest distance of a body point from the chord of its path, in any direction, m.
double bulge(const MovingBody& body, const Piece& piece) {
  return body.radius() * piece.angle * piece.angle / 8.0;
}

}  // namespace

struct Certifier::Impl {
  CertifyOptions options;
  MovingBody whole;  // Hull of all parts: cheap, and sufficient for distant obstacles.
  // The parts; empty if there is only one, because `whole` is then exact.
  std::vector<MovingBody> parts;
  std::vector<FixedBody> obstacles;
  certify::Neighbours neighbours;
  std::vector<Vector3d> directions;  // Last separating direction of each obstacle; zero if none.
  std::vector<int> directed;         // Obstacles with a direction.
  Certificate result;
  double asked = 0.0;  // m

  struct Candidate {
    double at_least;
    int waypoint;
    int obstacle;
  };

  [[nodiscard]] Eigen::AlignedBox3d box_around(const Pose& pose) const;
  [[nodiscard]] double reach() const { return std::max(result.nearest_m, 0.0); }
  void certify_waypoints(std::span<const Pose> waypoints);
  void certify_candidate(std::span<const Pose> waypoints, const Candidate& candidate);
  void certify_segments(std::span<const Pose> waypoints);
  void certify_segment(const Piece& segment, int obstacle, double at_least);
  void certify_pair(const Piece& piece, const MovingBody& body, int obstacle, const Separator& at_a,
                    const Separator& at_b);
  void certify_parts(const Piece& piece, int obstacle, const Separator& at_a,
                     const Separator& at_b);

  // True if the last separating direction of the obstacle, the direction from it to here, or one of
  // its axes proves that it is no nearer than the nearest so far.
  [[nodiscard]] bool is_farther(const Pose& X_WB, int obstacle);
  [[nodiscard]] bool settled_along(const Piece& segment, int obstacle, const Vector3d& n_W);
  void remember(int obstacle, const Vector3d& n_W);

  // FCL query; a distance of the true hull also counts as a sample.
  Separator ask(const Station& station, int segment, const MovingBody& body, int obstacle);
  void sample_parts(const Station& station, int segment, int obstacle, const Vector3d& n_W);

  [[nodiscard]] double bound(const Piece& piece, const MovingBody& body, int obstacle,
                             const Separator& at_a, const Separator& at_b) const;
  [[nodiscard]] double highest(const Piece& piece) const;
  // True if the bound needs no refinement; it then becomes part of the result.
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
  remember(obstacle, separator.n_W);
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

bool Certifier::Impl::settled_along(const Piece& segment, int obstacle, const Vector3d& n_W) {
  const double separation = std::min(whole.separation(segment.a.X_WB, at(obstacle), n_W),
                                     whole.separation(segment.b.X_WB, at(obstacle), n_W));
  const double least = separation - bulge(whole, segment);
  // In collision the axes give the better depth.
  return result.nearest_m > 0.0 && least >= result.nearest_m - options.tolerance &&
         settled(least, 0);
}

double Certifier::Impl::highest(const Piece& piece) const {
  const Vector3d up = Vector3d::UnitZ();
  return std::max(whole.reach(piece.a.X_WB, up), whole.reach(piece.b.X_WB, up)) +
         bulge(whole, piece);
}

bool Certifier::Impl::settled(double bound, int halvings) {
  const bool hopeless = result.nearest_m <= 0.0 || halvings >= kMaxHalvings ||
                        result.evaluations >= options.max_evaluations;
  const bool undecided = bound < asked && result.nearest_m >= asked;
  const double tolerance = undecided ? kFinely * options.tolerance : options.tolerance;
  if (bound < result.nearest_m - tolerance && !hopeless) return false;
  result.clearance_m = std::min(result.clearance_m, bound);
  return true;
}

void Certifier::Impl::remember(int obstacle, const Vector3d& n_W) {
  Vector3d& direction = directions[static_cast<std::size_t>(obstacle)];
  if (direction.isZero()) directed.push_back(obstacle);
  direction = n_W;
}

bool Certifier::Impl::is_farther(const Pose& X_WB, int obstacle) {
  const Vector3d& n_W = directions[static_cast<std::size_t>(obstacle)];
  if (!n_W.isZero() && whole.separation(X_WB, at(obstacle), n_W) >= result.nearest_m) return true;
  const Vector3d towards_W = at(obstacle).towards(X_WB.p);
  if (!towards_W.isZero() && whole.separation(X_WB, at(obstacle), towards_W) >= result.nearest_m) {
    remember(obstacle, towards_W);
    return true;
  }
  const Separator along = whole.along_axes(X_WB, at(obstacle));
  if (along.separation < result.nearest_m) return false;
  remember(obstacle, along.n_W);
  return true;
}

Eigen::AlignedBox3d Certifier::Impl::box_around(const Pose& pose) const {
  const Vector3d margin = Vector3d::Constant(whole.radius());
  return {pose.p - margin, pose.p + margin};
}

void Certifier::Impl::certify_candidate(std::span<const Pose> waypoints,
                                        const Candidate& candidate) {
  const Station station{waypoints[static_cast<std::size_t>(candidate.waypoint)], 0.0};
  if (is_farther(station.X_WB, candidate.obstacle)) return;
  const Separator separator = ask(station, candidate.waypoint, whole, candidate.obstacle);
  if (separator.separation < result.nearest_m) {
    sample_parts(station, candidate.waypoint, candidate.obstacle, separator.n_W);
  }
}

// Distances at the waypoints, nearest candidates first: the rest is compared with them. The very
// first one excludes most of the others before they are listed.
void Certifier::Impl::certify_waypoints(std::span<const Pose> waypoints) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Pose& pose : waypoints) boxes.push_back(box_around(pose));
  Candidate first{result.nearest_m, 0, -1};
  neighbours.visit(
      boxes, [&] { return first.at_least > 0.0 ? first.at_least : -1.0; },
      [&](int waypoint, int obstacle, double at_least) {
        if (at_least < first.at_least) first = {at_least, waypoint, obstacle};
      });
  if (first.obstacle < 0) return;
  certify_candidate(waypoints, first);

  std::vector<Candidate> candidates;
  neighbours.visit(
      boxes, [&] { return reach(); },
      [&](int waypoint, int obstacle, double at_least) {
        if (waypoint == first.waypoint && obstacle == first.obstacle) return;
        candidates.push_back({at_least, waypoint, obstacle});
      });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.at_least < b.at_least; });
  for (const Candidate& candidate : candidates) {
    if (candidate.at_least >= result.nearest_m || result.nearest_m <= 0.0) break;
    certify_candidate(waypoints, candidate);
  }
}

void Certifier::Impl::certify_segments(std::span<const Pose> waypoints) {
  // A single pose is a motion of length zero.
  const std::size_t segments = std::max<std::size_t>(waypoints.size() - 1, 1);
  std::vector<Piece> pieces;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t i = 0; i < segments; ++i) {
    const Pose& a = waypoints[i];
    const Pose& b = waypoints[std::min(i + 1, waypoints.size() - 1)];
    pieces.push_back({static_cast<int>(i), {a, 0.0}, {b, 1.0}, angle_between(a.q, b.q), 0});
    boxes.push_back(box_around(a).merged(box_around(b)));
    result.highest_z_m = std::max(result.highest_z_m, highest(pieces.back()));
  }
  neighbours.visit(
      boxes, [&] { return reach(); },
      [&](int segment, int obstacle, double at_least) {
        certify_segment(pieces[static_cast<std::size_t>(segment)], obstacle, at_least);
      });
}

void Certifier::Impl::certify_segment(const Piece& segment, int obstacle, double at_least) {
  // Touching boxes give no bound: continue with the bodies, however deep the overlap.
  if (at_least > 0.0 && settled(at_least, 0)) return;
  const Vector3d last = directions[static_cast<std::size_t>(obstacle)];
  if (!last.isZero() && settled_along(segment, obstacle, last)) return;
  const Vector3d towards_W = at(obstacle).towards(0.5 * (segment.a.X_WB.p + segment.b.X_WB.p));
  if (!towards_W.isZero() && settled_along(segment, obstacle, towards_W)) {
    remember(obstacle, towards_W);
    return;
  }
  const Separator axis_a = whole.along_axes(segment.a.X_WB, at(obstacle));
  const Separator axis_b = whole.along_axes(segment.b.X_WB, at(obstacle));
  if (settled(bound(segment, whole, obstacle, axis_a, axis_b), 0)) {
    remember(obstacle, axis_b.n_W);
    return;
  }
  const Separator at_a = ask(segment.a, segment.segment, whole, obstacle);
  const Separator at_b = ask(segment.b, segment.segment, whole, obstacle);
  certify_pair(segment, whole, obstacle, at_a, at_b);
}

void Certifier::Impl::certify_pair(const Piece& piece, const MovingBody& body, int obstacle,
                                   const Separator& at_a, const Separator& at_b) {
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

// The direction that separates the hull of all parts may separate a part sufficiently; only
// otherwise query FCL again.
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
    : impl_(new Impl{options, MovingBody(hull.hull_vertices()), {}, {}, {}, {}, {}, {}}) {
  if (hull.parts.size() > 1) {
    for (const ConvexSolid& part : hull.parts) impl_->parts.emplace_back(part.vertices);
  }
  reset(world, options);
}

Certifier::Certifier(Certifier&&) noexcept = default;
Certifier::~Certifier() = default;

void Certifier::reset(const World& world, const CertifyOptions& options) {
  impl_->options = options;
  impl_->obstacles.clear();
  impl_->neighbours = {};
  for (const Obstacle& obstacle : world.obstacles) {
    impl_->obstacles.emplace_back(obstacle);
    impl_->neighbours.add(impl_->obstacles.back().box_W());
    impl_->directions.emplace_back(Vector3d::Zero());
  }
}

Certificate Certifier::certify(std::span<const Pose> waypoints) {
  return certify(waypoints, impl_->options.cutoff, 0.0);
}

Certificate Certifier::certify(std::span<const Pose> waypoints, double cutoff, double asked) {
  DIVE_DEMAND(!waypoints.empty());
  DIVE_DEMAND(std::all_of(waypoints.begin(), waypoints.end(),
                          [](const Pose& pose) { return pose.is_finite(); }));
  Impl& impl = *impl_;
  Certificate& result = impl.result;
  result = {};
  impl.asked = asked;
  // A certificate must not depend on earlier ones.
  for (const int obstacle : impl.directed) {
    impl.directions[static_cast<std::size_t>(obstacle)].setZero();
  }
  impl.directed.clear();
  result.clearance_m = result.nearest_m = cutoff;
  result.highest_z_m = -std::numeric_limits<double>::infinity();
  impl.certify_waypoints(waypoints);
  impl.certify_segments(waypoints);
  result.clearance_m = std::min(result.clearance_m, result.nearest_m);
  return result;
}

}  // namespace dive::planning
