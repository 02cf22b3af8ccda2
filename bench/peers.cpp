#include "bench/peers.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <map>
#include <memory>

#include <ompl/base/SpaceInformation.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/SE3StateSpace.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/fmt/FMT.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/kpiece/KPIECE1.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/geometric/planners/rrt/InformedRRTstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "planning/world/scene.h"

namespace dive::bench {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Eigen::Vector3d;

constexpr double kMargin = 5.0;    // m around map, start and goal
constexpr double kRotation = 0.5;  // m equivalent to one radian

// Pose in SE(3). Horizontal states are four numbers, x, y, z and the yaw scaled by kRotation,
// because OMPL's informed samplers support no other space.
Pose pose_of(const ob::State* state, bool horizontal) {
  Pose pose;
  if (horizontal) {
    const double* x = state->as<ob::RealVectorStateSpace::StateType>()->values;
    pose.p = Vector3d(x[0], x[1], x[2]);
    pose.q = from_rpy(0.0, 0.0, x[3] / kRotation);
  } else {
    const auto* x = state->as<ob::SE3StateSpace::StateType>();
    pose.p = Vector3d(x->getX(), x->getY(), x->getZ());
    const auto& q = x->rotation();
    pose.q = Eigen::Quaterniond(q.w, q.x, q.y, q.z);
  }
  return pose;
}

void set(ob::State* state, const Pose& pose, bool horizontal) {
  if (horizontal) {
    double* x = state->as<ob::RealVectorStateSpace::StateType>()->values;
    Vector3d::Map(x) = pose.p;
    x[3] = to_rpy(pose.q).z() * kRotation;
  } else {
    auto* x = state->as<ob::SE3StateSpace::StateType>();
    x->setXYZ(pose.p.x(), pose.p.y(), pose.p.z());
    auto& q = x->rotation();
    q.w = pose.q.w();
    q.x = pose.q.x();
    q.y = pose.q.y();
    q.z = pose.q.z();
  }
}

/// Length of the path, whatever the attitudes.
class Swum final : public ob::PathLengthOptimizationObjective {
 public:
  Swum(const ob::SpaceInformationPtr& information, bool horizontal)
      : ob::PathLengthOptimizationObjective(information), horizontal_(horizontal) {}
  ob::Cost motionCost(const ob::State* a, const ob::State* b) const override {
    return ob::Cost((pose_of(a, horizontal_).p - pose_of(b, horizontal_).p).norm());
  }
  ob::Cost motionCostHeuristic(const ob::State* a, const ob::State* b) const override {
    return motionCost(a, b);
  }

 private:
  bool horizontal_;
};

/// Position of a state in cells of a metre, the projection that KPIECE needs.
class Place final : public ob::ProjectionEvaluator {
 public:
  Place(const ob::StateSpace* space, bool horizontal)
      : ob::ProjectionEvaluator(space), horizontal_(horizontal) {}
  [[nodiscard]] unsigned int getDimension() const override { return 3; }
  void defaultCellSizes() override { cellSizes_ = {1.0, 1.0, 1.0}; }
  void project(const ob::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override {
    projection = pose_of(state, horizontal_).p;
  }

 private:
  bool horizontal_;
};

ob::StateSpacePtr space_over(const Eigen::AlignedBox3d& region, bool horizontal) {
  ob::RealVectorBounds bounds(horizontal ? 4 : 3);
  for (unsigned i = 0; i < 3; ++i) {
    bounds.setLow(i, region.min()(static_cast<int>(i)));
    bounds.setHigh(i, region.max()(static_cast<int>(i)));
  }
  if (horizontal) {
    bounds.setLow(3, -M_PI * kRotation);
    bounds.setHigh(3, M_PI * kRotation);
    auto space = std::make_shared<ob::RealVectorStateSpace>(4);
    space->setBounds(bounds);
    return space;
  }
  auto space = std::make_shared<ob::SE3StateSpace>();
  space->setBounds(bounds);
  space->setSubspaceWeight(1, kRotation);
  return space;
}

class Question {
 public:
  Question(const planning::World& world, const planning::RobotHull& hull, const PeerTask& task)
      : task_(task), scene_(world), hull_B_(hull.hull_vertices()), hull_W_(hull_B_.size()) {
    Eigen::AlignedBox3d region = world.bounds();
    region.extend(task.start.p).extend(task.goal.p);
    region.min().array() -= kMargin;
    region.max().array() += kMargin;
    region.min().z() = std::max(region.min().z(), task.min_z);
    region.max().z() = std::min(region.max().z(), task.max_z);
    const ob::StateSpacePtr space = space_over(region, task.horizontal);
    space->registerDefaultProjection(std::make_shared<Place>(space.get(), task.horizontal));
    information_ = std::make_shared<ob::SpaceInformation>(space);
    information_->setStateValidityChecker([this](const ob::State* s) { return is_valid(s); });
    information_->setStateValidityCheckingResolution(task.look / space->getMaximumExtent());
    information_->setup();
  }

  [[nodiscard]] const ob::SpaceInformationPtr& information() const { return information_; }

  [[nodiscard]] ob::ProblemDefinitionPtr problem() const {
    auto problem = std::make_shared<ob::ProblemDefinition>(information_);
    ob::ScopedState<> start(information_);
    ob::ScopedState<> goal(information_);
    set(start.get(), task_.start, task_.horizontal);
    set(goal.get(), task_.goal, task_.horizontal);
    problem->setStartAndGoalStates(start, goal);
    auto objective = std::make_shared<Swum>(information_, task_.horizontal);
    objective->setCostThreshold(ob::Cost(task_.length_target));
    problem->setOptimizationObjective(objective);
    return problem;
  }

  [[nodiscard]] double length_of(const og::PathGeometric& path) const {
    double length = 0.0;
    for (std::size_t i = 1; i < path.getStateCount(); ++i) {
      length += (pose_of(path.getState(static_cast<unsigned>(i)), task_.horizontal).p -
                 pose_of(path.getState(static_cast<unsigned>(i - 1)), task_.horizontal).p)
                    .norm();
    }
    return length;
  }

 private:
  bool is_valid(const ob::State* state) {
    if (!information_->satisfiesBounds(state)) return false;
    const Pose pose = pose_of(state, task_.horizontal);
    for (std::size_t i = 0; i < hull_B_.size(); ++i) hull_W_[i] = pose * hull_B_[i];
    return scene_.clearance(hull_W_, task_.clearance) >= task_.clearance;
  }

  const PeerTask& task_;
  planning::Scene scene_;
  std::vector<Vector3d> hull_B_;
  std::vector<Vector3d> hull_W_;
  ob::SpaceInformationPtr information_;
};

enum class Use { kRestart, kImprove, kMoreSamples };

struct Peer {
  Use use;
  std::function<ob::PlannerPtr(const ob::SpaceInformationPtr&)> make;
};

template <class Planner>
ob::PlannerPtr make(const ob::SpaceInformationPtr& information) {
  return std::make_shared<Planner>(information);
}

const std::map<std::string, Peer>& peers() {
  static const std::map<std::string, Peer> all{
      {"RRTConnect", {Use::kRestart, make<og::RRTConnect>}},
      {"KPIECE", {Use::kRestart, make<og::KPIECE1>}},
      {"BiTRRT", {Use::kRestart, make<og::BiTRRT>}},
      {"RRT*", {Use::kImprove, make<og::RRTstar>}},
      {"Informed RRT*", {Use::kImprove, make<og::InformedRRTstar>}},
      {"BIT*", {Use::kImprove, make<og::BITstar>}},
      {"FMT*", {Use::kMoreSamples, make<og::FMT>}},
  };
  return all;
}

}  // namespace

const std::vector<std::string>& peer_names() {
  static const std::vector<std::string> names{"RRTConnect",    "BiTRRT", "KPIECE", "RRT*",
                                              "Informed RRT*", "BIT*",   "FMT*"};
  return names;
}

PeerRun run_peer(const std::string& name, const planning::World& world,
                 const planning::RobotHull& hull, const PeerTask& task) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(task.seed));
  const Peer& peer = peers().at(name);
  PeerRun run;
  run.best_length = std::numeric_limits<double>::infinity();
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  Question question(world, hull, task);
  unsigned samples = 1000;
  while (!run.reached && elapsed() < task.time_limit_s) {
    const ob::ProblemDefinitionPtr problem = question.problem();
    const ob::PlannerPtr planner = peer.make(question.information());
    if (peer.use == Use::kMoreSamples) {
      planner->as<og::FMT>()->setNumSamples(samples);
      samples *= 2;
    }
    planner->setProblemDefinition(problem);
    planner->setup();
    const bool solved =
        planner->solve(task.time_limit_s - elapsed()) == ob::PlannerStatus::EXACT_SOLUTION;
    if (solved) {
      auto path = *problem->getSolutionPath()->as<og::PathGeometric>();
      if (peer.use == Use::kRestart) {
        og::PathSimplifier simplifier(question.information());
        simplifier.simplify(path, task.time_limit_s - elapsed(), true);
      }
      run.best_length = std::min(run.best_length, question.length_of(path));
    }
    run.reached = run.best_length <= task.length_target;
  }
  run.seconds = elapsed();
  return run;
}

}  // namespace dive::bench
