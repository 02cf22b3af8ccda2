// The quadratic programme of one optimiser iteration: waypoints along a line, smoothed, with
// contacts on every segment, cold start.

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "planning/trajopt/banded_qp.h"

namespace {

using dive::Matrix6d;
using dive::Random;
using dive::Vector6d;
using dive::planning::BandedQp;
using dive::planning::QpRow;
using dive::planning::QpSummary;

constexpr int kContactsPerSegment = 4;

Vector6d random_vector(Random& random) {
  return Vector6d::NullaryExpr([&random] { return random.uniform(-1.0, 1.0); });
}

/// The optimiser's weights: length 100 per metre, hinges 200 per metre, ends fixed.
void pose_problem(int waypoints, Random& random, BandedQp& qp) {
  qp.reset(waypoints);
  const Matrix6d stiffness = Vector6d(70, 70, 70, 20, 20, 20).asDiagonal();
  for (int i = 0; i < waypoints; ++i) {
    qp.hessian().diagonal(i) += stiffness * (i == 0 || i + 1 == waypoints ? 1.0 : 2.0);
    if (i + 1 < waypoints) qp.hessian().lower(i) -= stiffness;
    qp.gradient(i) = 10.0 * random_vector(random);
    if (i == 0 || i + 1 == waypoints) continue;
    qp.lower(i).setConstant(-0.5);
    qp.upper(i).setConstant(0.5);
  }
  for (int i = 0; i + 1 < waypoints; ++i) {
    for (int k = 0; k < kContactsPerSegment; ++k) {
      const Eigen::Vector3d normal = random_vector(random).head<3>().normalized();
      const double share = random.uniform();
      QpRow row{.block = i, .a = {}, .b = random.uniform(-0.3, 0.3), .weight = 200.0};
      row.a << (1.0 - share) * normal, 0.1 * random_vector(random).head<3>(), share * normal,
          0.1 * random_vector(random).head<3>();
      qp.add_row(row);
    }
  }
}

void solve_cold(benchmark::State& state) {
  const int waypoints = static_cast<int>(state.range(0));
  BandedQp qp(waypoints, waypoints * kContactsPerSegment);
  Random random(7);
  pose_problem(waypoints, random, qp);
  QpSummary summary;
  for (auto _ : state) {
    summary = qp.solve();
    benchmark::DoNotOptimize(summary.objective);
  }
  if (summary.status != dive::planning::QpStatus::kSolved) state.SkipWithError("not solved");
  state.counters["iterations"] = summary.iterations;
}
BENCHMARK(solve_cold)->Arg(10)->Arg(20)->Arg(40)->Arg(100)->Arg(400)->Unit(benchmark::kMicrosecond);

}  // namespace
