#include "planning/trajopt/trajopt.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/trajopt/kinematic_limits.h"
#include "planning/trajopt/roll_search.h"
#include "planning/trajopt/smooth_costs.h"
#include "planning/trajopt/sweep_contacts.h"
#include "planning/world/sounding.h"

namespace dive::planning {
namespace {

constexpr double kAcceptRatio = 0.1;  // share of the predicted decrease, for a step to be accepted
constexpr double kGoodRatio = 0.5;    // share of it, for the trust region to grow
constexpr double kShrink = 0.4;
constexpr double kGrow = 1.8;
constexpr double kMaxStep = 1.0;  // m: about half a segment
constexpr int kEscalations = 2;   // increases of the obstacle weight while a violation remains
constexpr double kEscalation = 5.0;
constexpr double kFinely = 0.1;       // factor on the smallest trust region, with more weight
constexpr double kWorthwhile = 0.05;  // share of the cost, for other rolls to be tried
constexpr double kOutline = 0.007;    // m of the hull left out, covered by the clearance buffer
constexpr double kQpTolerance = 1e-4;
constexpr double kPull = 0.1;  // in cost: a waypoint that could gain less is at rest

// The attitude without the components that its mode forbids.
Eigen::Quaterniond levelled(const Eigen::Quaterniond& q, AttitudeMode attitude) {
  if (attitude == AttitudeMode::kFree) return q;
  const Eigen::Vector3d rpy = to_rpy(q);
  return from_rpy(0.0, attitude == AttitudeMode::kHorizontal ? 0.0 : rpy.y(), rpy.z());
}

// The first free rotation axis in a waypoint's step (dp, rotation vector in B).
int first_free_axis(AttitudeMode attitude) {
  switch (attitude) {
    case AttitudeMode::kFree:
      return 3;
    case AttitudeMode::kFlat:
      return 4;
    case AttitudeMode::kHorizontal:
      return 5;
  }
  return 5;
}

/// A path and all terms of its cost except the smooth ones.
struct Candidate {
  std::vector<Pose> path;
  std::vector<SweepContact> contacts;
  std::vector<Hinge> hinges;  ///< One hinge per contact first, then all others.
  double hinge_cost = 0.0;
};

/// One run: the path, the contacts near it, and the programme that improves it.
class SequentialProgramme {
 public:
  SequentialProgramme(const TrajoptProblem& problem, const TrajoptOptions& options, Scene& scene,
                      SweepContacts& sweep, std::span<const Pose> initial)
      : problem_(problem),
        options_(options),
        scene_(scene),
        sweep_(sweep),
        obstacle_weight_(options.obstacle_weight),
        qp_(static_cast<int>(initial.size()), kFirstRows) {
    costs_.length_weight = options.length_weight;
    costs_.attitude_weight = options.attitude_weight;
    costs_.turn_weight = options.turn_weight;
    costs_.upright_weight = options.upright_weight;
    costs_.attitude = problem.limits.attitude;
    now_.path.assign(initial.begin(), initial.end());
    fix_ends();
  }

  TrajoptResult run();
  TrajoptAssessment assess();

 private:
  static constexpr int kFirstRows = 256;

  void fix_ends();
  [[nodiscard]] bool improve();
  void build_programme();
  void bound_waypoint(int i);
  void step_to(std::vector<Pose>& path) const;
  void evaluate(Candidate& candidate);
  void add_contact_hinges(Candidate& candidate) const;
  void add_vertical_hinges(Candidate& candidate) const;
  [[nodiscard]] double trust_rad() const {
    return trust_m_ * options_.trust_region_rad / options_.trust_region_m;
  }
  [[nodiscard]] double required(const SweepContact& contact) const {
    return problem_.limits.clearance + options_.clearance_buffer + contact.pad;
  }
  [[nodiscard]] bool is_pulled(int i);
  [[nodiscard]] double violation() const;
  [[nodiscard]] bool is_clear() const;
  [[nodiscard]] TrajoptResult result() const;

  const TrajoptProblem& problem_;
  const TrajoptOptions& options_;
  Scene& scene_;
  SweepContacts& sweep_;
  Candidate now_;
  Candidate next_;
  SmoothCosts costs_;
  double obstacle_weight_;
  double trust_m_ = 0.0;
  double least_trust_m_ = 0.0;
  bool finely_ = false;  ///< True to use all corners that face an obstacle, and small steps.
  BandedQp qp_;
  int rows_capacity_ = kFirstRows;
  double merit_ = 0.0;
  TrajoptStatus status_ = TrajoptStatus::kIterationLimit;
  int iterations_ = 0;
  int qp_solves_ = 0;
  long waypoints_solved_ = 0;
};

void SequentialProgramme::fix_ends() {
  std::vector<Pose>& path = now_.path;
  path.front() = problem_.start;
  path.back().p = problem_.goal.p;
  if (problem_.goal_attitude_fixed) path.back().q = problem_.goal.q;
  const std::size_t end = path.size() - (problem_.goal_attitude_fixed ? 1 : 0);
  for (std::size_t i = 1; i < end; ++i) path[i].q = levelled(path[i].q, problem_.limits.attitude);
}

// Computes all terms of the cost except the smooth ones. Hinges within reach of a step are
// modelled, so that no step ends in an obstacle that is missing in the programme.
void SequentialProgramme::evaluate(Candidate& candidate) {
  sweep_.find(candidate.path, problem_.limits.clearance + options_.clearance_buffer + trust_m_,
              candidate.contacts);
  if (finely_) {
    sweep_.add_corners(candidate.path,
                       problem_.limits.clearance + options_.clearance_buffer + trust_m_,
                       candidate.contacts);
  }
  candidate.hinges.clear();
  add_contact_hinges(candidate);
  add_vertical_hinges(candidate);
  add_kinematic_limits(candidate.path, options_.kinematics, problem_.limits.attitude,
                       problem_.goal_attitude_fixed, trust_m_, trust_rad(), candidate.hinges);
  candidate.hinge_cost = 0.0;
  for (const Hinge& hinge : candidate.hinges) candidate.hinge_cost += hinge.cost();
}

void SequentialProgramme::add_contact_hinges(Candidate& candidate) const {
  for (const SweepContact& contact : candidate.contacts) {
    candidate.hinges.push_back({.block = contact.segment,
                                .a = contact.gradient,
                                .missing = required(contact) - contact.distance,
                                .weight = obstacle_weight_});
  }
}

// Surface and altitude. Both ends are given, and their violations are not charged to the path.
void SequentialProgramme::add_vertical_hinges(Candidate& candidate) const {
  for (int i = 1; i + 1 < static_cast<int>(candidate.path.size()); ++i) {
    const Eigen::Vector3d& p = candidate.path[static_cast<std::size_t>(i)].p;
    Hinge surface{.block = i, .missing = p.z() + problem_.limits.clearance};
    surface.a(2) = -1.0;
    surface.weight = options_.surface_weight;
    if (surface.missing > -trust_m_) candidate.hinges.push_back(surface);
    if (problem_.limits.min_altitude <= problem_.limits.clearance)
      continue;  // covered by the clearance
    const auto ground = ground_below(scene_, p, problem_.limits.min_altitude + 2.0 * trust_m_);
    if (!ground) continue;
    Hinge altitude{.block = i, .missing = *ground + problem_.limits.min_altitude - p.z()};
    altitude.a(2) = 1.0;
    altitude.weight = options_.altitude_weight;
    candidate.hinges.push_back(altitude);
  }
}

void SequentialProgramme::bound_waypoint(int i) {
  const Pose& pose = now_.path[static_cast<std::size_t>(i)];
  const bool last = i + 1 == static_cast<int>(now_.path.size());
  if (i == 0) return;  // fixed by reset()
  Vector6d& lower = qp_.lower(i);
  Vector6d& upper = qp_.upper(i);
  if (!last) {
    lower.head<3>().setConstant(-trust_m_);
    upper.head<3>().setConstant(trust_m_);
    lower.z() = std::clamp(problem_.limits.min_z - pose.p.z(), -trust_m_, trust_m_);
    upper.z() = std::clamp(problem_.limits.max_z - pose.p.z(), lower.z(), trust_m_);
  }
  if (last && problem_.goal_attitude_fixed) return;
  for (int k = first_free_axis(problem_.limits.attitude); k < 6; ++k) {
    lower(k) = -trust_rad();
    upper(k) = trust_rad();
  }
}

void SequentialProgramme::build_programme() {
  const auto blocks = static_cast<int>(now_.path.size());
  const auto rows = static_cast<int>(now_.hinges.size());
  if (rows > rows_capacity_) {
    rows_capacity_ = 2 * rows;
    qp_ = BandedQp(blocks, rows_capacity_);
  }
  qp_.reset(blocks);
  costs_.add_to(now_.path, qp_);
  for (int i = 0; i < blocks; ++i) bound_waypoint(i);
  for (const Hinge& hinge : now_.hinges) {
    qp_.add_row({.block = hinge.block, .a = hinge.a, .b = hinge.missing, .weight = hinge.weight});
  }
}

void SequentialProgramme::step_to(std::vector<Pose>& path) const {
  path = now_.path;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector6d& step = qp_.x(static_cast<int>(i));
    path[i].p += step.head<3>();
    path[i].q = (path[i].q * so3_exp(step.tail<3>())).normalized();
    if (problem_.limits.attitude == AttitudeMode::kFlat) {
      path[i].q = levelled(path[i].q, problem_.limits.attitude);
    }
  }
  path.back().p = problem_.goal.p;
  if (problem_.goal_attitude_fixed) path.back().q = problem_.goal.q;
}

// One convexification, with as many shorter steps as needed. False if the path has converged or no
// step improves it.
bool SequentialProgramme::improve() {
  costs_.reference_length = std::max(path_length(now_.path), 1e-3);
  merit_ = costs_.value(now_.path) + now_.hinge_cost;
  for (; trust_m_ >= least_trust_m_; trust_m_ *= kShrink) {
    build_programme();
    const QpSummary summary = qp_.solve({.tolerance = kQpTolerance});
    ++qp_solves_;
    waypoints_solved_ += static_cast<long>(now_.path.size());
    if (summary.status == QpStatus::kNumericalError) {
      status_ = TrajoptStatus::kQpFailed;
      return false;
    }
    const double promised = now_.hinge_cost - summary.objective;
    if (promised < options_.improvement_tolerance * merit_) {
      status_ = TrajoptStatus::kConverged;
      return false;
    }
    step_to(next_.path);
    evaluate(next_);
    const double decrease = merit_ - costs_.value(next_.path) - next_.hinge_cost;
    if (decrease < kAcceptRatio * promised) continue;
    std::swap(now_, next_);
    if (decrease > kGoodRatio * promised) trust_m_ = std::min(kGrow * trust_m_, kMaxStep);
    return true;
  }
  status_ = TrajoptStatus::kConverged;  // no step within the model's validity improves it
  return false;
}

double SequentialProgramme::violation() const {
  double worst = 0.0;
  for (const SweepContact& contact : now_.contacts) {
    worst = std::max(worst, problem_.limits.clearance + contact.pad - contact.distance);
  }
  return worst;
}

// The path may use up the buffer, except for the part taken by the outline.
bool SequentialProgramme::is_clear() const {
  return std::all_of(now_.contacts.begin(), now_.contacts.end(), [&](const auto& contact) {
    return required(contact) - contact.distance <= options_.clearance_buffer - kOutline;
  });
}

TrajoptResult SequentialProgramme::result() const {
  TrajoptResult result;
  result.status = status_;
  result.waypoints = now_.path;
  result.merit = merit_;
  result.length_m = path_length(now_.path);
  result.violation_m = violation();
  result.is_clear = is_clear();
  for (const SweepContact& contact : now_.contacts) {
    const bool violates = contact.distance < problem_.limits.clearance + contact.pad;
    const bool listed =
        !result.tight_segments.empty() && result.tight_segments.back() == contact.segment;
    if (violates && !listed) result.tight_segments.push_back(contact.segment);
  }
  result.iterations = iterations_;
  result.qp_solves = qp_solves_;
  result.waypoints_solved = waypoints_solved_;
  result.waypoint_cost.assign(now_.path.size(), 0.0);
  for (const SweepContact& contact : now_.contacts) {
    const double cost =
        options_.obstacle_weight * std::max(0.0, required(contact) - contact.distance);
    const auto i = static_cast<std::size_t>(contact.segment);
    result.waypoint_cost[i] += 0.5 * cost;
    result.waypoint_cost[i + 1] += 0.5 * cost;
  }
  return result;
}

TrajoptResult SequentialProgramme::run() {
  least_trust_m_ = options_.min_trust_region;
  for (int escalation = 0; escalation <= kEscalations; ++escalation) {
    trust_m_ = options_.trust_region_m;
    evaluate(now_);
    while (iterations_ < options_.max_iterations) {
      ++iterations_;
      status_ = TrajoptStatus::kIterationLimit;
      if (!improve()) break;
    }
    const double missing = violation();
    if (missing <= 0.0 || missing > problem_.escalate_below) break;
    obstacle_weight_ *= kEscalation;
    // A vehicle at an angle between two walls gains from its last hundredth of a radian.
    least_trust_m_ = kFinely * options_.min_trust_region;
    finely_ = true;
  }
  return result();
}

// True if a Newton step of waypoint i alone would gain enough in the smooth terms.
bool SequentialProgramme::is_pulled(int i) {
  const bool last = i + 1 == static_cast<int>(now_.path.size());
  if (i == 0) return false;
  const Vector6d& gradient = qp_.gradient(i);
  const Vector6d curvature = qp_.hessian().diagonal(i).diagonal();
  double gain = 0.0;
  const auto add = [&](int k) {
    if (gradient(k) != 0.0) gain += 0.5 * gradient(k) * gradient(k) / curvature(k);
  };
  for (int k = 0; k < 3 && !last; ++k) add(k);
  if (last && problem_.goal_attitude_fixed) return false;
  for (int k = first_free_axis(problem_.limits.attitude); k < 6; ++k) add(k);
  return gain > kPull;
}

TrajoptAssessment SequentialProgramme::assess() {
  trust_m_ = 0.0;
  evaluate(now_);
  costs_.reference_length = std::max(path_length(now_.path), 1e-3);
  merit_ = costs_.value(now_.path) + now_.hinge_cost;
  const auto blocks = static_cast<int>(now_.path.size());
  qp_.reset(blocks);
  costs_.add_to(now_.path, qp_);
  TrajoptAssessment assessment;
  assessment.pulled.resize(now_.path.size());
  assessment.violating.resize(now_.path.size());
  for (int i = 0; i < blocks; ++i) assessment.pulled[static_cast<std::size_t>(i)] = is_pulled(i);
  for (const Hinge& hinge : now_.hinges) {
    if (hinge.missing <= options_.clearance_buffer - kOutline) continue;
    const auto i = static_cast<std::size_t>(hinge.block);
    assessment.violating[i] = true;
    if (i + 1 < now_.path.size()) assessment.violating[i + 1] = true;
  }
  assessment.path = result();
  return assessment;
}

}  // namespace

Trajopt::Trajopt(Scene& scene, const RobotHull& hull, TrajoptOptions options)
    : scene_(scene), hull_vertices_(hull.outline(kOutline)), options_(options) {}

TrajoptResult Trajopt::optimise(const TrajoptProblem& problem, std::span<const Pose> initial) {
  DIVE_DEMAND(initial.size() >= 2);
  SweepContacts sweep(scene_, hull_vertices_);
  return SequentialProgramme(problem, options_, scene_, sweep, initial).run();
}

TrajoptAssessment Trajopt::assess(const TrajoptProblem& problem, std::span<const Pose> path) {
  DIVE_DEMAND(path.size() >= 2);
  SweepContacts sweep(scene_, hull_vertices_);
  return SequentialProgramme(problem, options_, scene_, sweep, path).assess();
}

std::optional<std::vector<Pose>> Trajopt::other_rolls(const TrajoptProblem& problem,
                                                      std::span<const Pose> path) {
  if (problem.limits.attitude != AttitudeMode::kFree) return std::nullopt;
  SweepContacts sweep(scene_, hull_vertices_);
  RollSearch found = search_rolls(problem, options_, sweep, path);
  if (found.cost > (1.0 - kWorthwhile) * found.cost_before) return std::nullopt;
  return std::move(found.path);
}

}  // namespace dive::planning
