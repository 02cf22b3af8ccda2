// Does the position at the end of each leg spread as dive check predicts? Of each mission, dives
// with the errors of its priors: the horizontal position error relative to the map when a leg ends,
// along its worst axis, beside the sigma that the check predicts there and the vehicle's own.
//
//     position_spread missions/pool3.xml --dives 100 --first 4711

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "bench/run_study.h"
#include "bench/study_setup.h"
#include "common/parallel.h"
#include "mission/check/position_margin.h"
#include "mission/simulation/simulated_conditions.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::bench {
namespace {

/// The end of one leg in all dives that reached it.
struct LegEnds {
  std::string goal;
  double predicted_m = 0.0;
  Eigen::Matrix2d errors = Eigen::Matrix2d::Zero();  ///< Sum of e e^T, m^2.
  std::vector<double> own_m;                         ///< Sigmas of the vehicle.
};

std::vector<LegEnds> predict(const StudySetup& setup) {
  const planning::Scene scene(setup.world);
  const mission::Route route = mission::nominal_route(setup.mission, scene);
  std::vector<mission::PlannedRouteLeg> legs =
      mission::plan_route(route, setup.mission, setup.world, setup.model.hull, {}, 1);
  mission::predict_position_margins(route, legs, setup.mission, setup.world, setup.model);
  std::vector<LegEnds> ends;
  for (const mission::PlannedRouteLeg& leg : legs) {
    ends.push_back({leg.goal, leg.margin.end_sigma_m, Eigen::Matrix2d::Zero(), {}});
  }
  return ends;
}

/// The error and the vehicle's sigma when a leg ended.
struct LegEnd {
  Eigen::Vector2d error;
  double own_m = 0.0;
};

/// Of each leg in turn, as far as the dive came.
std::vector<LegEnd> dive(const StudySetup& setup, const std::vector<LegEnds>& legs,
                         std::uint64_t seed) {
  mission::DiveSettings settings;
  settings.conditions = mission::simulated_conditions(setup.mission);
  settings.seed = seed;
  std::vector<LegEnd> ended;
  bool is_under_way = false;
  LegEnd last;
  static_cast<void>(mission::simulate_dive(setup.mission, setup.world, setup.model, settings,
                                           [&](const auto&, const mission::StepOutputs& out,
                                               const vehicle::GroundTruth& truth, const auto&) {
                                             if (ended.size() == legs.size()) return;
                                             const bool heads_for_it =
                                                 out.status.goal == legs[ended.size()].goal;
                                             if (is_under_way && !heads_for_it)
                                               ended.push_back(last);
                                             is_under_way = heads_for_it;
                                             last = {(out.estimate.X_WB.p - truth.X_WB.p).head<2>(),
                                                     estimation::horizontal_sigma(out.estimate)};
                                           }));
  return ended;
}

void measure(const std::string& path, int first, int dives, int jobs) {
  const StudySetup setup = load_setup(path);
  if (!mission::has_position_margins(setup.mission)) {
    throw std::runtime_error(path + ": no margins can be predicted");
  }
  std::vector<LegEnds> legs = predict(setup);
  std::mutex mutex;
  run_in_parallel(static_cast<std::size_t>(dives), jobs, [&](std::size_t i) {
    const std::vector<LegEnd> ended =
        dive(setup, legs, static_cast<std::uint64_t>(first) + static_cast<std::uint64_t>(i));
    const std::scoped_lock lock(mutex);
    for (std::size_t leg = 0; leg < ended.size(); ++leg) {
      legs[leg].errors += ended[leg].error * ended[leg].error.transpose();
      legs[leg].own_m.push_back(ended[leg].own_m);
    }
  });
  std::cout << path << ":\n";
  for (const LegEnds& leg : legs) {
    const auto count = static_cast<double>(leg.own_m.size());
    const double spread =
        std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(leg.errors / std::max(count, 1.0))
                      .eigenvalues()
                      .maxCoeff());
    std::cout << fmt::format(
        "  to {:<12} {:4.0f} dives: error (RMS) {:.3f} m, predicted {:.3f} m, ratio {:.2f}; the "
        "vehicle's own sigma {:.3f} m (median)\n",
        leg.goal, count, spread, leg.predicted_m, leg.predicted_m / spread,
        quantile(leg.own_m, 0.5));
  }
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("The spread of the position at the end of each leg beside its prediction");
  std::vector<std::string> missions;
  int dives = 100;
  int first = 1;
  int jobs = 2;
  app.add_option("missions", missions)->required();
  app.add_option("--dives", dives);
  app.add_option("--first", first, "Seed of the first dive");
  app.add_option("--jobs", jobs);
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    for (const std::string& path : missions) dive::bench::measure(path, first, dives, jobs);
  });
}
