// Dives with the visual-inertial estimator through a vision outage, one seed after the other,
// compared with ground truth:
//     vision_dives missions/scenarios/missions/basin_visual_inertial.xml --runs 10 --at 10
//     vision_dives MISSION --fault camera_missing --for 3 --scale 0.5 --rate 10
// or on laps, with and without loop closures:
//     vision_dives missions/laps_visual_inertial.xml --fault none --runs 3 --without-loops
// or past a diver:
//     vision_dives MISSION --fault none --diver 5:20,0.2,-1.8:2,0.2,-1.8

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <fmt/format.h>

#include "bench/quantile.h"
#include "bench/run_study.h"
#include "bench/study_setup.h"
#include "common/random.h"
#include "mission/cli/loading.h"
#include "mission/simulation/simulated_dive.h"
#include "vehicle/simulator/water/named_waters.h"

namespace dive::bench {
namespace {

constexpr double kStartSigma = 0.05;  // m, as in the executive

struct Study {
  std::string mission = "missions/scenarios/missions/basin_visual_inertial.xml";
  std::string fault = "camera_blackout";
  int runs = 10;
  double at_s = 10.0;
  double for_s = 7.0;
  double scale = 1.0;
  double rate_hz = 20.0;
  double current = 0.0;
  std::uint64_t first = 1;
  std::optional<vehicle::DiverTrack> diver;
  bool without_loops = false;
  bool is_verbose = false;
};

/// Figures of one dive; times in s, lengths in m.
struct Figures {
  /// Time at which the visual-inertial estimator first became active.
  std::optional<double> first;
  std::optional<double> switched;  ///< Time from the loss of vision to the switch of the estimator.
  std::optional<double> back;      ///< Time from the return of vision to the switch back.
  /// Largest step in a tick beyond the motion explained by the velocity.
  double step_excess = 0.0;
  double error_before = 0.0;
  double error_after = 0.0;
  double cost = 0.0;  ///< Change of the error during the outage.
  double end = 0.0;
  double sigma_after = 0.0;  ///< Estimated horizontal sigma after the outage.
  double drift = 0.0;        ///< Drift at the end of the mission, defined as for the data sets, %.
  int loops = 0;
  std::vector<double> nees_position, nees_heading, error;
  int switches = 0;
  double off_depth = 0.0;  ///< Largest distance of the true depth from that of the start.
  double clearance = std::numeric_limits<double>::infinity();  ///< To anything, the diver included.
  double from_diver = std::numeric_limits<double>::infinity();
  int collisions = 0;
  std::string outcome;
};

/// Compares the estimates with ground truth. For NEES a random start error is added, because in the
/// simulator the vehicle starts exactly at the planned position.
class Judge {
 public:
  Judge(const Study& study, std::uint64_t seed, Figures& figures)
      : study_(study), figures_(figures) {
    Random random(seed, 0x57a47);
    start_error_W_ = kStartSigma * Eigen::Vector3d(random.normal(), random.normal(), 0.0);
  }

  void observe(const mission::StepOutputs& out, const vehicle::GroundTruth& truth) {
    const estimation::StateEstimate& estimate = out.estimate;
    if (!estimate.valid) return;
    const double t = to_seconds(truth.utime);
    const Eigen::Vector3d error_W = truth.X_WB.p - estimate.X_WB.p;
    const bool is_visual = estimate.source == estimation::EstimatorKind::kVisualInertial;
    if (last_) note_step(estimate);
    const double end = study_.at_s + study_.for_s;
    if (is_visual && !figures_.first) figures_.first = t;
    if (t <= study_.at_s) before_W_ = error_W;
    if (t > study_.at_s && !is_visual && !figures_.switched) figures_.switched = t - study_.at_s;
    if (t <= end) {
      figures_.cost = (error_W - before_W_).head<2>().norm();
      figures_.error_after = error_W.norm();
      figures_.error_before = before_W_.norm();
      figures_.sigma_after = estimation::horizontal_sigma(estimate);
    }
    if (t > end && is_visual && !figures_.back) figures_.back = t - end;
    figures_.end = error_W.norm();
    if (is_visual && !is_done_) note_drift(estimate, truth);
    if (!is_done_) {
      if (!start_z_) start_z_ = truth.X_WB.p.z();
      figures_.off_depth = std::max(figures_.off_depth, std::abs(truth.X_WB.p.z() - *start_z_));
    }
    for (const mission::TransitionRecord& record : out.transitions) {
      is_done_ |= record.event.starts_with("done.state");
    }
    if (last_ && last_->source != estimate.source) ++figures_.switches;
    if (figures_.first && t >= next_) sample(t, estimate, truth, error_W);
    last_ = estimate;
  }

 private:
  void note_step(const estimation::StateEstimate& estimate) {
    const double dt = to_seconds(estimate.utime - last_->utime);
    const double speed = std::max(estimate.v_WB_B.norm(), last_->v_WB_B.norm());
    const double step = (estimate.X_WB.p - last_->X_WB.p).head<2>().norm();
    figures_.step_excess = std::max(figures_.step_excess, step - speed * dt);
  }

  // Aligned with the truth by yaw and translation where the visual-inertial estimator first became
  // active, because the compass has an error.
  void note_drift(const estimation::StateEstimate& estimate, const vehicle::GroundTruth& truth) {
    if (!begun_) begun_ = {estimate.X_WB, truth.X_WB, truth.distance_swum_m};
    const double yaw = to_rpy(begun_->truth.q * begun_->estimate.q.conjugate()).z();
    const Eigen::Vector3d estimated =
        from_rpy(0.0, 0.0, yaw) * (estimate.X_WB.p - begun_->estimate.p);
    const double way = std::max(truth.distance_swum_m - begun_->way_m, 1.0);
    figures_.drift = 100.0 * (estimated - (truth.X_WB.p - begun_->truth.p)).norm() / way;
  }

  void sample(double t, const estimation::StateEstimate& estimate,
              const vehicle::GroundTruth& truth, const Eigen::Vector3d& error_W) {
    next_ = t + 1.0;
    const Eigen::Vector3d e = error_W + start_error_W_;
    const Eigen::Matrix3d P = estimate.covariance.topLeftCorner<3, 3>();
    figures_.nees_position.push_back(e.dot(P.inverse() * e));
    const Eigen::Vector3d up_B = estimate.X_WB.q.conjugate() * Eigen::Vector3d::UnitZ();
    const double yaw = so3_log(estimate.X_WB.q.conjugate() * truth.X_WB.q).dot(up_B);
    const double variance = up_B.dot(estimate.covariance.bottomRightCorner<3, 3>() * up_B);
    figures_.nees_heading.push_back(yaw * yaw / variance);
    figures_.error.push_back(error_W.norm());
  }

  const Study& study_;
  Figures& figures_;
  Eigen::Vector3d start_error_W_;
  Eigen::Vector3d before_W_ = Eigen::Vector3d::Zero();
  std::optional<estimation::StateEstimate> last_;
  double next_ = 0.0;
  struct Begun {
    Pose estimate, truth;
    double way_m = 0.0;
  };
  std::optional<Begun> begun_;
  bool is_done_ = false;
  std::optional<double> start_z_;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

void trace(const estimation::StateEstimate& estimate, const vehicle::GroundTruth& truth) {
  const Eigen::Vector3d e = truth.X_WB.p - estimate.X_WB.p;
  const Eigen::Matrix3d P = estimate.covariance.topLeftCorner<3, 3>();
  const Eigen::Vector3d v = truth.X_WB.q * truth.v_WB_B;
  const Eigen::Vector3d up_B = estimate.X_WB.q.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d v_e = v - estimate.X_WB.q * estimate.v_WB_B;
  fmt::print(
      "  {:3.0f} s error {:7.4f} {:7.4f} {:7.4f} m, sigma {:.4f} {:.4f} {:.4f}; at {:.2f} {:.2f} "
      "m/s, off by {:6.3f} {:6.3f}; heading off by {:6.3f} deg, sigma {:.3f}\n",
      to_seconds(truth.utime), e.x(), e.y(), e.z(), std::sqrt(P(0, 0)), std::sqrt(P(1, 1)),
      std::sqrt(P(2, 2)), v.x(), v.y(), v_e.x(), v_e.y(),
      rad_to_deg(to_rpy(truth.X_WB.q * estimate.X_WB.q.conjugate()).z()),
      rad_to_deg(std::sqrt(up_B.dot(estimate.covariance.bottomRightCorner<3, 3>() * up_B))));
}

Figures dive_once(const StudySetup& setup, const Study& study, std::uint64_t seed) {
  mission::DiveSettings settings;
  settings.seed = seed;
  settings.conditions.current_W.y() = study.current;
  settings.cameras = vehicle::stereo_camera_in(setup.mission.simulated_water)->scaled(study.scale);
  settings.cameras->rate_hz = study.rate_hz;
  if (const auto kind = mission::find_fault(study.fault)) {
    settings.faults.push_back({*kind, study.at_s, study.for_s});
  }
  settings.diver = study.diver;
  Figures figures;
  Judge judge(study, seed, figures);
  const mission::DiveResult result =
      mission::simulate_dive(setup.mission, setup.world, setup.model, settings,
                             [&](const mission::StepInputs& in, const mission::StepOutputs& out,
                                 const vehicle::GroundTruth& truth, const auto&) {
                               judge.observe(out, truth);
                               if (in.vision) figures.loops = in.vision->loops.count;
                               if (!study.is_verbose) return;
                               if (in.now % 1'000'000 == 0) trace(out.estimate, truth);
                               for (const auto& a : out.actions) {
                                 fmt::print("  {:.2f} s {}\n", to_seconds(in.now), a.text);
                               }
                             });
  figures.outcome = result.outcome;
  figures.clearance = result.nearest.clearance_m;
  figures.from_diver = result.diver_clearance_m;
  figures.collisions = static_cast<int>(result.collisions.size());
  return figures;
}

std::string or_never(const std::optional<double>& value, double per) {
  return value ? fmt::format("{:.2f}", *value / per) : "never";
}

void report(const Study& study, const std::vector<Figures>& all) {
  const auto column = [&](auto of) {
    std::vector<double> values;
    for (const Figures& one : all) values.push_back(of(one));
    return values;
  };
  const auto line = [](const char* what, const std::vector<double>& values) {
    fmt::print("{:<46} median {:.3f}, largest {:.3f}\n", what, quantile(values, 0.5),
               quantile(values, 1.0));
  };
  line("visual-inertial for the first time after, s",
       column([](auto& f) { return f.first.value_or(1e9); }));
  line("to the primitive estimator after, images",
       column([&](auto& f) { return f.switched.value_or(1e9) * study.rate_hz; }));
  line("visual-inertial again after, s", column([](auto& f) { return f.back.value_or(1e9); }));
  line("step of a tick beyond its velocity, mm",
       column([](auto& f) { return 1e3 * f.step_excess; }));
  line("error before, m", column([](auto& f) { return f.error_before; }));
  line("cost of it, m", column([](auto& f) { return f.cost; }));
  line("sigma after, m", column([](auto& f) { return f.sigma_after; }));
  line("error at the end, m", column([](auto& f) { return f.end; }));
  line("drift at the end, % of the distance swum", column([](auto& f) { return f.drift; }));
  line("true depth away from that of the start, m", column([](auto& f) { return f.off_depth; }));
  const auto least = [&](const char* what, const std::vector<double>& values) {
    fmt::print("{:<46} median {:.3f}, least {:.3f}\n", what, quantile(values, 0.5),
               quantile(values, 0.0));
  };
  least("clearance, m", column([](auto& f) { return f.clearance; }));
  if (study.diver) least("clearance to the diver, m", column([](auto& f) { return f.from_diver; }));
  line("collisions", column([](auto& f) { return static_cast<double>(f.collisions); }));
  line("loops", column([](auto& f) { return static_cast<double>(f.loops); }));
  const double band = 1.96 * std::sqrt(6.0 / static_cast<double>(all.size()));
  fmt::print(
      "NEES of position {:.2f} (3; {:.2f} to {:.2f} of so many dives), of heading {:.2f} (1)\n",
      mean(column([](auto& f) { return mean(f.nees_position); })), 3.0 - band, 3.0 + band,
      mean(column([](auto& f) { return mean(f.nees_heading); })));
}

void dive_all(const Study& study) {
  StudySetup setup = load_setup(study.mission);
  setup.mission.closes_loops &= !study.without_loops;
  std::vector<Figures> all;
  for (int i = 0; i < study.runs; ++i) {
    const std::uint64_t seed = study.first + static_cast<std::uint64_t>(i);
    const Figures one = dive_once(setup, study, seed);
    fmt::print(
        "seed {:2}: {}, visual-inertial at {} s, lost after {} images, back after {} s, excess "
        "{:.1f} mm, "
        "error {:.3f} m, cost {:.3f} m (sigma {:.3f}), at the end {:.3f} m, {} switches, "
        "{} loops, drift {:.3f} %, NEES {:.2f} {:.2f}, clearance {:.3f} m, to the diver {:.3f} m, "
        "{} collisions, depth off by {:.3f} m\n",
        seed, one.outcome, or_never(one.first, 1.0), or_never(one.switched, 1.0 / study.rate_hz),
        or_never(one.back, 1.0), 1e3 * one.step_excess, one.error_before, one.cost, one.sigma_after,
        one.end, one.switches, one.loops, one.drift, mean(one.nees_position),
        mean(one.nees_heading), one.clearance, one.from_diver, one.collisions, one.off_depth);
    std::fflush(stdout);
    all.push_back(one);
  }
  report(study, all);
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  using namespace dive::bench;
  CLI::App app("Dives with the visual-inertial estimator through a vision outage");
  Study study;
  app.add_option("MISSION", study.mission, "Mission (XML) with the visual-inertial estimator");
  app.add_option("--runs", study.runs, "Dives");
  app.add_option("--fault", study.fault, "Fault of the cameras; none: no fault");
  app.add_option("--at", study.at_s, "Start of the fault, s");
  app.add_option("--for", study.for_s, "Duration of the fault, s");
  app.add_option("--scale", study.scale, "Scale of the images");
  app.add_option("--rate", study.rate_hz, "Image pairs per second");
  app.add_option("--current", study.current, "Current towards north, m/s");
  app.add_option("--first", study.first, "Seed of the first dive");
  std::string diver;
  app.add_option("--diver", diver, "Track of a diver, as of dive run");
  app.add_flag("--without-loops", study.without_loops,
               "Without loop closure, whatever the mission says");
  app.add_flag("-v,--verbose", study.is_verbose, "Print the notes of the executive");
  CLI11_PARSE(app, argc, argv);
  return run_study([&] {
    if (!diver.empty()) {
      study.diver = dive::mission::parse_diver(diver);
      if (!study.diver) throw std::runtime_error("the diver's track cannot be read");
    }
    dive_all(study);
  });
}
