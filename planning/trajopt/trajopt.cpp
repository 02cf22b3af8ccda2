#include "planning/trajopt/trajopt.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/assert.h"
#include "planning/trajopt/banded_qp.h"
#include "planning/trajopt/smooth_costs.h"
#include "planning/trajopt/sweep_contacts.h"

namespace dive::planning {
namespace {

constexpr double kAcceptRatio = 0.1;  // of the decrease promised, for a step to be taken
constexpr double kGoodRatio = 0.5;    // for the trust region to grow
constexpr double kShrink = 0.4;
constexpr double kGrow = 1.8;
constexpr double kLargestStep = 1.0;  // m: half a segment or so
constexpr int kEscalations = 2;       // of the obstacle weight, when a violation stays
constexpr double kEscalation = 5.0;
constexpr double kQpTolerance = 1e-6;

double length_of(std::span<const Pose> path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i].p - path[i - 1].p).norm();
  return length;
}

/// One run: the path, what is near it, and the programme that improves it.
class SequentialProgramme {
 public:
  SequentialProgramme(const TrajoptProblem& problem, const TrajoptOptions& options,
                      SweepContacts& sweep, std::span<const Pose> initial)
      : problem_(problem),
        options_(options),
        sweep_(sweep),
        path_(initial.begin(), initial.end()),
        obstacle_weight_(options.obstacle_weight),
        qp_(static_cast<int>(initial.size()), kFirstRows) {
    costs_.length_weight = options.length_weight;
    costs_.attitude_weight = options.attitude_weight;
    costs_.turn_weight = options.turn_weight;
    costs_.attitude = problem.attitude;
    fix_ends();
  }

  TrajoptResult run();

 private:
  static constexpr int kFirstRows = 256;

  void fix_ends();
  [[nodiscard]] bool improve();
  void build_programme();
  void bound_waypoint(int i);
  void add_rows();
  [[nodiscard]] std::vector<Pose> stepped() const;
  void find_contacts(std::span<const Pose> path, std::vector<SweepContact>& out) const;
  [[nodiscard]] double required(const SweepContact& contact) const {
    return problem_.clearance + options_.clearance_buffer + contact.pad;
  }
  [[nodiscard]] double surface_excess(const Pose& pose) const {
    return std::max(0.0, pose.p.z() + problem_.clearance);
  }
  [[nodiscard]] double merit(std::span<const Pose> path,
                             const std::vector<SweepContact>& contacts) const;
  [[nodiscard]] double violation() const;
  [[nodiscard]] TrajoptResult result() const;

  const TrajoptProblem& problem_;
  const TrajoptOptions& options_;
  SweepContacts& sweep_;
  std::vector<Pose> path_;
  std::vector<SweepContact> contacts_;
  std::vector<SweepContact> candidate_contacts_;
  SmoothCosts costs_;
  double obstacle_weight_;
  double trust_m_ = 0.0;
  BandedQp qp_;
  int rows_capacity_ = kFirstRows;
  double merit_ = 0.0;
  TrajoptStatus status_ = TrajoptStatus::kIterationLimit;
  int iterations_ = 0;
  int qp_solves_ = 0;
};

void SequentialProgramme::fix_ends() {
  path_.front() = problem_.start;
  path_.back().p = problem_.goal.p;
  if (problem_.goal_attitude_fixed) path_.back().q = problem_.goal.q;
  if (problem_.attitude != AttitudeMode::kHorizontal) return;
  const std::size_t end = path_.size() - (problem_.goal_attitude_fixed ? 1 : 0);
  for (std::size_t i = 1; i < end; ++i) {
    path_[i].q = from_rpy(0.0, 0.0, to_rpy(path_[i].q).z());
  }
}

// Contacts as far off as a step can reach are modelled, so that a step does not end in an obstacle
// that the programme did not know of.
void SequentialProgramme::find_contacts(std::span<const Pose> path,
                                        std::vector<SweepContact>& out) const {
  sweep_.find(path, problem_.clearance + options_.clearance_buffer + trust_m_, out);
}

double SequentialProgramme::merit(std::span<const Pose> path,
                                  const std::vector<SweepContact>& contacts) const {
  double cost = costs_.value(path);
  for (const SweepContact& contact : contacts) {
    cost += obstacle_weight_ * std::max(0.0, required(contact) - contact.distance);
  }
  for (std::size_t i = 1; i + 1 < path.size(); ++i) {
    cost += options_.surface_weight * surface_excess(path[i]);
  }
  return cost;
}

void SequentialProgramme::bound_waypoint(int i) {
  const Pose& pose = path_[static_cast<std::size_t>(i)];
  const bool first = i == 0;
  const bool last = i + 1 == static_cast<int>(path_.size());
  Vector6d& lower = qp_.lower(i);
  Vector6d& upper = qp_.upper(i);
  if (first) return;  // fixed: reset() left it so
  const double trust_rad = trust_m_ * options_.trust_region_rad / options_.trust_region_m;
  if (!last) {
    lower.head<3>().setConstant(-trust_m_);
    upper.head<3>().setConstant(trust_m_);
    lower.z() = std::clamp(problem_.min_z - pose.p.z(), -trust_m_, trust_m_);
    upper.z() = std::clamp(problem_.max_z - pose.p.z(), lower.z(), trust_m_);
  }
  if (last && problem_.goal_attitude_fixed) return;
  const int first_axis = problem_.attitude == AttitudeMode::kHorizontal ? 5 : 3;
  for (int k = first_axis; k < 6; ++k) {
    lower(k) = -trust_rad;
    upper(k) = trust_rad;
  }
}

void SequentialProgramme::add_rows() {
  for (const SweepContact& contact : contacts_) {
    qp_.add_row({.block = contact.segment,
                 .a = contact.gradient,
                 .b = required(contact) - contact.distance,
                 .weight = obstacle_weight_});
  }
  for (int i = 1; i + 1 < static_cast<int>(path_.size()); ++i) {
    QpRow row{.block = i, .a = Vector12d::Zero(), .b = 0.0, .weight = options_.surface_weight};
    row.b = path_[static_cast<std::size_t>(i)].p.z() + problem_.clearance;
    if (row.b < -trust_m_) continue;  // out of reach of this step
    row.a(2) = -1.0;
    qp_.add_row(row);
  }
}

void SequentialProgramme::build_programme() {
  const auto blocks = static_cast<int>(path_.size());
  const auto rows = static_cast<int>(contacts_.size() + path_.size());
  if (rows > rows_capacity_) {
    rows_capacity_ = 2 * rows;
    qp_ = BandedQp(blocks, rows_capacity_);
  }
  qp_.reset(blocks);
  costs_.add_to(path_, qp_);
  for (int i = 0; i < blocks; ++i) bound_waypoint(i);
  add_rows();
}

std::vector<Pose> SequentialProgramme::stepped() const {
  std::vector<Pose> path = path_;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector6d& step = qp_.x(static_cast<int>(i));
    path[i].p += step.head<3>();
    path[i].q = (path[i].q * so3_exp(step.tail<3>())).normalized();
  }
  path.back().p = problem_.goal.p;
  return path;
}

// One convexification, with as many shorter steps as it takes. False when the path has converged
// or nothing helps.
bool SequentialProgramme::improve() {
  costs_.reference_length = std::max(length_of(path_), 1e-3);
  merit_ = merit(path_, contacts_);
  for (; trust_m_ >= options_.min_trust_region; trust_m_ *= kShrink) {
    build_programme();
    double promised = 0.0;  // the model at a step of zero
    for (const SweepContact& contact : contacts_) {
      promised += obstacle_weight_ * std::max(0.0, required(contact) - contact.distance);
    }
    for (std::size_t i = 1; i + 1 < path_.size(); ++i) {
      promised += options_.surface_weight * surface_excess(path_[i]);
    }
    const QpSummary summary = qp_.solve({.tolerance = kQpTolerance});
    ++qp_solves_;
    if (summary.status == QpStatus::kNumericalError) {
      status_ = TrajoptStatus::kQpFailed;
      return false;
    }
    promised -= summary.objective;
    if (promised < options_.improvement_tolerance * merit_) {
      status_ = TrajoptStatus::kConverged;
      return false;
    }
    std::vector<Pose> candidate = stepped();
    find_contacts(candidate, candidate_contacts_);
    const double decrease = merit_ - merit(candidate, candidate_contacts_);
    if (decrease < kAcceptRatio * promised) continue;
    path_ = std::move(candidate);
    std::swap(contacts_, candidate_contacts_);
    if (decrease > kGoodRatio * promised) trust_m_ = std::min(kGrow * trust_m_, kLargestStep);
    return true;
  }
  status_ = TrajoptStatus::kConverged;  // no step that the model can be trusted for helps
  return false;
}

double SequentialProgramme::violation() const {
  double worst = 0.0;
  for (const SweepContact& contact : contacts_) {
    worst = std::max(worst, problem_.clearance + contact.pad - contact.distance);
  }
  return worst;
}

TrajoptResult SequentialProgramme::result() const {
  TrajoptResult result;
  result.status = status_;
  result.waypoints = path_;
  result.merit = merit_;
  result.length_m = length_of(path_);
  result.violation_m = violation();
  result.iterations = iterations_;
  result.qp_solves = qp_solves_;
  result.waypoint_cost.assign(path_.size(), 0.0);
  for (const SweepContact& contact : contacts_) {
    const double cost =
        options_.obstacle_weight * std::max(0.0, required(contact) - contact.distance);
    const auto i = static_cast<std::size_t>(contact.segment);
    result.waypoint_cost[i] += 0.5 * cost;
    result.waypoint_cost[i + 1] += 0.5 * cost;
  }
  return result;
}

TrajoptResult SequentialProgramme::run() {
  for (int escalation = 0; escalation <= kEscalations; ++escalation) {
    trust_m_ = options_.trust_region_m;
    find_contacts(path_, contacts_);
    while (iterations_ < options_.max_iterations) {
      ++iterations_;
      status_ = TrajoptStatus::kIterationLimit;
      if (!improve()) break;
    }
    // A path that is inside something is in a local minimum that no weight gets it out of.
    const double missing = violation();
    if (missing <= 0.0 || missing >= problem_.clearance) break;
    obstacle_weight_ *= kEscalation;
  }
  return result();
}

}  // namespace

Trajopt::Trajopt(Scene& scene, const RobotHull& hull, TrajoptOptions options)
    : scene_(scene), hull_vertices_(hull.hull_vertices()), options_(options) {}

TrajoptResult Trajopt::optimise(const TrajoptProblem& problem, std::span<const Pose> initial) {
  DIVE_DEMAND(initial.size() >= 2);
  SweepContacts sweep(scene_, hull_vertices_);
  return SequentialProgramme(problem, options_, sweep, initial).run();
}

}  // namespace dive::planning
