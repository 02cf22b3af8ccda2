#include "planning/trajopt/roll_search.h"

#include <algorithm>
#include <array>
#include <limits>

namespace dive::planning {
namespace {

// The hull is nearly the same upside down, so half a turn covers all choices.
constexpr std::array<double, 5> kRolls{0.0, M_PI / 4, -M_PI / 4, M_PI / 2, -M_PI / 2};

// Extent of a hull on its edge beyond that of a level one, m: with more clearance than that, the
// roll of a segment makes no difference.
constexpr double kReach = 0.15;

class Search {
 public:
  Search(const TrajoptProblem& problem, const TrajoptOptions& options, SweepContacts& sweep,
         std::span<const Pose> path)
      : problem_(problem), options_(options), sweep_(sweep), path_(path) {}

  RollSearch run() {
    RollSearch result;
    const std::size_t count = path_.size();
    std::vector<std::vector<Pose>> choices(count);
    for (std::size_t i = 0; i < count; ++i) choices[i] = choices_at(i);
    // best[i][k]: cost of the path to choice k of waypoint i; from[i][k]: the choice before it.
    std::vector<std::vector<double>> best(count);
    std::vector<std::vector<std::size_t>> from(count);
    best[0].assign(choices[0].size(), 0.0);
    for (std::size_t i = 1; i < count; ++i) {
      const bool tight = is_tight(i - 1);
      result.cost_before += cost(path_[i - 1], path_[i], tight);
      for (const Pose& to : choices[i]) {
        double least = std::numeric_limits<double>::infinity();
        std::size_t best_from = 0;
        for (std::size_t k = 0; k < choices[i - 1].size(); ++k) {
          const double total = best[i - 1][k] + cost(choices[i - 1][k], to, tight);
          if (total < least) {
            least = total;
            best_from = k;
          }
        }
        best[i].push_back(least);
        from[i].push_back(best_from);
      }
    }
    const auto end = std::min_element(best.back().begin(), best.back().end());
    result.cost = *end;
    auto k = static_cast<std::size_t>(end - best.back().begin());
    result.path.resize(count);
    for (std::size_t i = count; i-- > 0;) {
      result.path[i] = choices[i][k];
      if (i > 0) k = from[i][k];
    }
    return result;
  }

 private:
  [[nodiscard]] std::vector<Pose> choices_at(std::size_t i) const {
    const Pose& pose = path_[i];
    const bool given = i == 0 || (i + 1 == path_.size() && problem_.goal_attitude_fixed);
    if (given) return {pose};
    const Eigen::Vector3d rpy = to_rpy(pose.q);
    std::vector<Pose> result;
    for (const double roll : kRolls) {
      Pose turned;
      turned.p = pose.p;
      turned.q = from_rpy(roll, rpy.y(), rpy.z());
      result.push_back(turned);
    }
    return result;
  }

  void find(const Pose& a, const Pose& b, double reach) {
    const std::array<Pose, 2> segment{a, b};
    sweep_.find(segment, problem_.limits.clearance + options_.clearance_buffer + reach, contacts_);
  }

  [[nodiscard]] bool is_tight(std::size_t segment) {
    find(path_[segment], path_[segment + 1], kReach);
    return !contacts_.empty();
  }

  [[nodiscard]] double cost(const Pose& a, const Pose& b, bool tight) {
    const double turn = angle_between(a.q, b.q);
    double sum = options_.turn_weight * turn * turn;
    if (!tight) return sum;
    find(a, b, 0.0);
    for (const SweepContact& contact : contacts_) {
      const double required = problem_.limits.clearance + options_.clearance_buffer + contact.pad;
      sum += options_.obstacle_weight * std::max(0.0, required - contact.distance);
    }
    return sum;
  }

  const TrajoptProblem& problem_;
  const TrajoptOptions& options_;
  SweepContacts& sweep_;
  std::span<const Pose> path_;
  std::vector<SweepContact> contacts_;
};

}  // namespace

RollSearch search_rolls(const TrajoptProblem& problem, const TrajoptOptions& options,
                        SweepContacts& sweep, std::span<const Pose> path) {
  return Search(problem, options, sweep, path).run();
}

}  // namespace dive::planning
