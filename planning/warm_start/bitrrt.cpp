#include "planning/warm_start/bitrrt.h"

#include <algorithm>
#include <memory>
#include <mutex>

#include <ompl/base/MotionValidator.h>
#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/objectives/MechanicalWorkOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

namespace dive::planning {
namespace {

namespace ob = ompl::base;
using Eigen::Vector3d;

Vector3d position(const ob::State* state) {
  return Vector3d::Map(state->as<ob::RealVectorStateSpace::StateType>()->values);
}

class Validity final : public ob::StateValidityChecker {
 public:
  Validity(const ob::SpaceInformationPtr& information, const FreeSpace& space)
      : ob::StateValidityChecker(information), space_(space) {}
  bool isValid(const ob::State* state) const override {
    return space_.slack(position(state)) >= 0.0;
  }

 private:
  const FreeSpace& space_;
};

class Motions final : public ob::MotionValidator {
 public:
  Motions(const ob::SpaceInformationPtr& information, const FreeSpace& space)
      : ob::MotionValidator(information), space_(space) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    return space_.is_free(position(from), position(to));
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last_valid) const override {
    last_valid.second = 0.0;  // Part of a motion is of no use to this planner.
    return checkMotion(from, to);
  }

 private:
  const FreeSpace& space_;
};

// The cost map of T-RRT: the missing share of the preferred clearance, in [0, 1].
class Tightness final : public ob::MechanicalWorkOptimizationObjective {
 public:
  Tightness(const ob::SpaceInformationPtr& information, const FreeSpace& space, double preferred)
      : ob::MechanicalWorkOptimizationObjective(information),
        space_(space),
        preferred_(preferred) {}
  ob::Cost stateCost(const ob::State* state) const override {
    if (preferred_ <= 0.0) return ob::Cost(0.0);
    return ob::Cost(std::clamp(1.0 - space_.slack(position(state)) / preferred_, 0.0, 1.0));
  }

 private:
  const FreeSpace& space_;
  double preferred_;
};

std::shared_ptr<ob::RealVectorStateSpace> make_space(const Eigen::AlignedBox3d& region) {
  auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  ob::RealVectorBounds bounds(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    bounds.setLow(axis, region.min()[axis]);
    bounds.setHigh(axis, region.max()[axis]);
  }
  space->setBounds(bounds);
  return space;
}

std::vector<Vector3d> positions_of(const ompl::geometric::PathGeometric& path) {
  std::vector<Vector3d> positions;
  positions.reserve(path.getStateCount());
  for (std::size_t i = 0; i < path.getStateCount(); ++i) {
    positions.push_back(position(path.getState(static_cast<unsigned>(i))));
  }
  return positions;
}

// OMPL's generators take their seeds from one global sequence at construction, so a query locks
// that sequence from seeding it until the planner is destroyed.
std::mutex& global_seed() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

std::optional<std::vector<Vector3d>> bitrrt(const FreeSpace& space, const BiTrrtQuery& query) {
  const std::lock_guard<std::mutex> lock(global_seed());
  ompl::msg::noOutputHandler();
  // OMPL uses 32 bits and does not accept 0.
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(query.seed % 0xfffffffbU + 1U));

  const auto states = make_space(query.region);
  const auto information = std::make_shared<ob::SpaceInformation>(states);
  information->setStateValidityChecker(std::make_shared<Validity>(information, space));
  information->setMotionValidator(std::make_shared<Motions>(information, space));
  information->setup();

  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<ob::RealVectorStateSpace> start(states);
  ob::ScopedState<ob::RealVectorStateSpace> goal(states);
  Vector3d::Map(start->values) = query.start_W;
  Vector3d::Map(goal->values) = query.goal_W;
  problem->setStartAndGoalStates(start, goal);
  problem->setOptimizationObjective(
      std::make_shared<Tightness>(information, space, query.preferred_slack));

  ompl::geometric::BiTRRT planner(information);
  planner.setProblemDefinition(problem);
  planner.setRange(2.0);
  planner.setup();
  int iterations = 0;
  const ob::PlannerTerminationCondition enough([&] { return ++iterations > query.max_iterations; });
  if (planner.solve(enough) != ob::PlannerStatus::EXACT_SOLUTION) return std::nullopt;
  return positions_of(*problem->getSolutionPath()->as<ompl::geometric::PathGeometric>());
}

}  // namespace dive::planning
