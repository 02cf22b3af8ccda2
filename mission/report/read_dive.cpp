#include "mission/report/read_dive.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "mission/document/mission.h"
#include "mission/executive/executive.h"
#include "mission/executive/machine.h"
#include "mission/onboard/settings.h"
#include "mission/record/log.h"
#include "mission/record/replay.h"
#include "mission/record/unfinished_dive.h"
#include "mission/report/clearances.h"
#include "mission/report/followed_path.h"
#include "mission/report/sample_list.h"
#include "mission/report/sha256.h"
#include "planning/world/observed_map.h"
#include "vehicle/command_timing.h"

namespace dive::mission {
namespace {

constexpr Utime kExitPeriod = kMicrosecondsPerSecond;
constexpr std::size_t kMaxExits = 400;

/// Reads the ticks of a log, in order.
class DiveReader {
 public:
  DiveReader(Report& report, const ReadDiveOptions& options)
      : report_(report), dive_(*report.dive), options_(options), samples_(options.max_samples) {}

  /// `executive` after the tick; null where it was not run again.
  void tick(const LoggedTick& tick, const Executive* executive);
  /// When the dive began, s, by the vehicle's clock, by which explain() counts.
  [[nodiscard]] double origin_s() const { return to_seconds(origin_.value_or(0)); }
  [[nodiscard]] bool has_ticks() const { return origin_.has_value(); }
  void finish();

 private:
  void plans(const LoggedTick& tick);
  void distance(const LoggedTick& tick);
  void contacts(const LoggedTick& tick);
  void health(const StepInputs& inputs);
  void observed(const StepInputs& inputs);
  void executive(const Executive& executive, const StepOutputs& outputs);
  void exits(const vehicle::ExitPath& path);
  void thin_out_exits();
  [[nodiscard]] bool is_new_segment(const Status& status);
  [[nodiscard]] DiveSample sample(const LoggedTick& tick);
  void name_outcome();
  [[nodiscard]] double rest_s() const;
  void true_speeds();
  void collect_observed();
  [[nodiscard]] static int index_of(std::vector<std::string>& names, const std::string& name);

  Report& report_;
  DiveReport& dive_;
  const ReadDiveOptions& options_;
  SampleList samples_;
  std::optional<Utime> origin_;
  double t_s_ = 0.0;
  Utime now_ = 0;
  std::optional<Utime> last_tick_;
  std::optional<Pose> last_truth_;
  double true_distance_m_ = 0.0;
  double estimated_distance_m_ = 0.0;
  estimation::StateEstimate last_estimate_;
  Status last_status_;
  FailsafeRecord last_failsafe_;
  std::optional<ExecutiveResult> result_;  ///< Result of the executive that is run again.
  bool is_rerun_to_end_ = false;
  std::optional<HealthSample> health_;
  std::optional<int> features_;
  bool is_following_ = false;
  int segment_ = 0;
  std::string goal_;
  std::size_t breadcrumbs_ = 0;
  std::int64_t exit_revision_ = -1;
  Utime next_exit_ = 0;
  Utime exit_period_ = kExitPeriod;
  planning::ObservedMap map_;
  std::map<planning::CellKey, double> occupied_since_s_;
};

void DiveReader::tick(const LoggedTick& tick, const Executive* rerun) {
  now_ = tick.inputs.now;
  if (!origin_) origin_ = now_ - kControlPeriod;
  t_s_ = to_seconds(now_ - *origin_);
  distance(tick);
  plans(tick);
  contacts(tick);
  health(tick.inputs);
  observed(tick.inputs);
  last_estimate_ = tick.outputs.estimate;
  const Status& status = tick.outputs.status;
  // While no path is followed the distance is 0, or stays as it was.
  is_following_ = status.segment > 0 && status.cross_track_m > 0.0 &&
                  status.cross_track_m != last_status_.cross_track_m;
  last_status_ = tick.outputs.status;
  for (const FailsafeRecord& record : tick.outputs.failsafes) last_failsafe_ = record;
  for (const TransitionRecord& record : tick.outputs.transitions) {
    dive_.transitions.push_back({t_s_, record});
  }
  is_rerun_to_end_ = rerun != nullptr;
  if (rerun != nullptr) executive(*rerun, tick.outputs);

  const bool is_new = is_new_segment(tick.outputs.status);
  if (is_new) dive_.local_goals.push_back({t_s_, segment_});
  const bool is_marked = is_new || !tick.outputs.transitions.empty() ||
                         !tick.outputs.failsafes.empty() ||
                         (tick.truth && !tick.truth->contacts.empty());
  if (is_marked || samples_.is_due(now_)) samples_.add(now_, sample(tick), is_marked);
}

void DiveReader::distance(const LoggedTick& tick) {
  // In a longer gap between two ticks the vehicle had stopped.
  const Utime since_last = std::min(now_ - last_tick_.value_or(now_), vehicle::kCommandStale);
  estimated_distance_m_ += tick.outputs.estimate.v_WB_B.norm() * to_seconds(since_last);
  last_tick_ = now_;
  if (!tick.truth) return;
  dive_.verdict.has_truth = true;
  if (last_truth_) true_distance_m_ += (tick.truth->X_WB.p - last_truth_->p).norm();
  last_truth_ = tick.truth->X_WB;
}

void DiveReader::plans(const LoggedTick& tick) {
  if (tick.inputs.plan) {
    const PlanReply& reply = *tick.inputs.plan;
    const auto asked = std::find_if(report_.paths.rbegin(), report_.paths.rend(),
                                    [&](const ReportPath& path) { return path.id == reply.id; });
    if (asked != report_.paths.rend()) {
      asked->answered_s = t_s_;
      asked->plan = reply.plan;
    }
  }
  if (tick.outputs.plan_query) {
    const PlanQuery& query = *tick.outputs.plan_query;
    ReportPath path;
    path.id = query.id;
    path.state = query.state;
    path.goal = tick.outputs.status.goal;
    path.cause = query.cause;
    path.asked_s = t_s_;
    path.answered_s = kUnknownValue;
    path.is_replan = !query.request.previous.empty();
    path.plan.reason = "not answered";
    report_.paths.push_back(std::move(path));
    ++dive_.verdict.plans;
    if (report_.paths.back().is_replan) ++dive_.verdict.replans;
  }
}

void DiveReader::contacts(const LoggedTick& tick) {
  if (!tick.truth) return;
  const TruthRecord& truth = *tick.truth;
  for (Collision& collision :
       collisions_at(truth.utime, truth.X_WB, truth.contacts, tick.outputs.estimate)) {
    collision.t_s = t_s_;
    dive_.verdict.collisions.push_back(std::move(collision));
  }
  NearestApproach& nearest = dive_.verdict.nearest;
  if (truth.min_clearance_m < nearest.clearance_m) {
    nearest = {truth.min_clearance_m, t_s_, truth.X_WB.p, truth.nearest};
  }
}

void DiveReader::health(const StepInputs& inputs) {
  if (inputs.health) health_ = inputs.health;
  if (inputs.vision) features_ = inputs.vision->used;
}

void DiveReader::observed(const StepInputs& inputs) {
  for (const planning::ObstacleUpdate& update : inputs.obstacles) {
    if (!map_.apply(update)) continue;
    for (const planning::MapCell& cell : update.cells) {
      if (cell.pieces.empty()) {
        occupied_since_s_.erase(cell.key);
      } else {
        occupied_since_s_.try_emplace(cell.key, t_s_);
      }
    }
  }
}

void DiveReader::executive(const Executive& executive, const StepOutputs& outputs) {
  dive_.rerun_until_s = t_s_;
  result_ = executive.result();
  const behaviors::Trail& trail = executive.trail();
  if (trail.size() > 0 && trail.dropped() > breadcrumbs_) {
    const behaviors::Trail::Breadcrumb& newest = trail.newest();
    dive_.trail.push_back({t_s_, newest.p_W, newest.open_above});
    breadcrumbs_ = trail.dropped();
  }
  if (outputs.estimate.valid) exits(executive.exit_path());
}

void DiveReader::exits(const vehicle::ExitPath& path) {
  const bool has_turned = dive_.exits.empty() || dive_.exits.back().open_above != path.open_above;
  if (!has_turned && (path.revision == exit_revision_ || now_ < next_exit_)) return;
  exit_revision_ = path.revision;
  next_exit_ = now_ + exit_period_;
  ReportExit& exit = dive_.exits.emplace_back(ReportExit{t_s_, path.open_above, {}});
  for (const Pose& pose : path.waypoints) exit.points_W.push_back(pose.p);
  if (dive_.exits.size() >= kMaxExits) thin_out_exits();
}

// Every second one between two changes of open_above.
void DiveReader::thin_out_exits() {
  exit_period_ *= 2;
  std::vector<ReportExit> kept;
  bool is_odd = false;
  for (ReportExit& exit : dive_.exits) {
    const bool has_turned = kept.empty() || kept.back().open_above != exit.open_above;
    is_odd = !is_odd;
    if (has_turned || is_odd) kept.push_back(std::move(exit));
  }
  dive_.exits = std::move(kept);
}

bool DiveReader::is_new_segment(const Status& status) {
  const bool is_new = status.segment > 0 && (status.segment != segment_ || status.goal != goal_);
  segment_ = status.segment;
  goal_ = status.goal;
  return is_new;
}

DiveSample DiveReader::sample(const LoggedTick& tick) {
  const StepOutputs& outputs = tick.outputs;
  const Status& status = outputs.status;
  const estimation::StateEstimate& estimate = outputs.estimate;
  DiveSample sample;
  sample.t_s = t_s_;
  if (tick.truth) sample.truth = tick.truth->X_WB;
  sample.command_mps = outputs.command.v;
  sample.command_depth_m = outputs.command.d;
  sample.state = index_of(dive_.states, status.state);
  sample.rung = index_of(dive_.rungs, status.rung);
  if (status.clearance_m > 0.0) sample.certified_m = status.clearance_m;
  if (health_) sample.battery = health_->battery_fraction;
  sample.under_overhead = !dive_.exits.empty() && !dive_.exits.back().open_above;
  if (!estimate.valid) return sample;
  sample.estimate = estimate.X_WB;
  sample.covariance = estimate.covariance.topLeftCorner<3, 3>();
  sample.speed_mps = estimate.v_WB_B.norm();
  sample.sigma_m = estimation::horizontal_sigma(estimate);
  sample.is_visual = estimate.source == estimation::EstimatorKind::kVisualInertial;
  if (features_) sample.features = *features_;
  if (tick.truth) sample.error_m = horizontal_error(estimate, tick.truth->X_WB);
  if (!is_following_) return sample;
  sample.cross_track_m = status.cross_track_m;
  if (const auto line = followed_line(report_.paths, status, estimate.X_WB.p)) {
    sample.plan = static_cast<int>(line->path);
    if (tick.truth) sample.true_cross_track_m = line->distance(tick.truth->X_WB.p);
  }
  return sample;
}

int DiveReader::index_of(std::vector<std::string>& names, const std::string& name) {
  const auto at = std::ranges::find(names, name);
  if (at != names.end()) return static_cast<int>(at - names.begin());
  names.push_back(name);
  return static_cast<int>(names.size()) - 1;
}

void DiveReader::finish() {
  DiveVerdict& verdict = dive_.verdict;
  verdict.duration_s = t_s_;
  verdict.distance_m = verdict.has_truth ? true_distance_m_ : estimated_distance_m_;
  if (last_estimate_.valid) {
    verdict.final_sigma_m = estimation::horizontal_sigma(last_estimate_);
    if (last_truth_) verdict.final_error_m = horizontal_error(last_estimate_, *last_truth_);
  }
  dive_.sample_period_s = samples_.period_s();
  dive_.samples = samples_.take();
  true_speeds();
  name_outcome();
  collect_observed();
}

// Where the executive was not run again to the end, its last status and rung say how it ended.
void DiveReader::name_outcome() {
  DiveVerdict& verdict = dive_.verdict;
  verdict.final_state = last_status_.state;
  if (is_rerun_to_end_) {
    verdict.outcome = to_string(result_->outcome);
    verdict.final_state = result_->final_state;
    verdict.cause = result_->cause;
  } else if (last_status_.finished) {
    const bool is_own = verdict.final_state == kAbortedState;
    verdict.outcome = to_string(is_own ? Outcome::kAborted : Outcome::kSuccess);
    if (is_own) {
      verdict.cause = fmt::format("failsafe {}: {}", last_failsafe_.cause, last_failsafe_.why);
    }
  } else {
    verdict.outcome = to_string(Outcome::kRunning);
  }
  if (verdict.outcome == to_string(Outcome::kRunning)) {
    const UnfinishedDive dive{verdict.final_state, verdict.duration_s, rest_s(),
                              is_kept(last_status_) && rest_s() >= kMinRest, last_failsafe_.why};
    verdict.outcome = dive.outcome();
    verdict.cause = dive.cause();
  }
  if (!verdict.collisions.empty()) {
    verdict.outcome = "failure";
    verdict.cause = describe(verdict.collisions);
  }
}

double DiveReader::rest_s() const {
  double since_s = t_s_;
  std::optional<Eigen::Vector3d> end_W;
  for (auto sample = dive_.samples.rbegin(); sample != dive_.samples.rend(); ++sample) {
    const std::optional<Pose>& pose = sample->truth ? sample->truth : sample->estimate;
    if (!pose) break;
    if (!end_W) end_W = pose->p;
    if ((pose->p - *end_W).norm() > kSamePlace) break;
    since_s = sample->t_s;
  }
  return t_s_ - since_s;
}

void DiveReader::true_speeds() {
  for (std::size_t i = 1; i < dive_.samples.size(); ++i) {
    const DiveSample& last = dive_.samples[i - 1];
    DiveSample& next = dive_.samples[i];
    const double dt = next.t_s - last.t_s;
    if (!last.truth || !next.truth || dt <= 0.0) continue;
    next.true_speed_mps = (next.truth->p - last.truth->p).norm() / dt;
  }
}

void DiveReader::collect_observed() {
  const std::size_t stride =
      (map_.pieces() + options_.max_observed - 1) / std::max<std::size_t>(options_.max_observed, 1);
  std::size_t count = 0;
  map_.visit_cells([&](planning::CellKey key, std::span<const planning::ObservedMap::Piece> cell) {
    for (const planning::ObservedMap::Piece& piece : cell) {
      if (count++ % std::max<std::size_t>(stride, 1) != 0) continue;
      const auto since = occupied_since_s_.find(key);
      dive_.observed.push_back({since == occupied_since_s_.end() ? 0.0 : since->second,
                                std::get<planning::Polytope>(piece.obstacle.shape)});
    }
  });
  dive_.observed_pieces = map_.pieces();
  std::ranges::stable_sort(dive_.observed, {}, &ObservedPiece::t_s);
}

void describe_mission(const LogHeader& header, const LoggedDive& dive, Report& report) {
  const Mission& mission = dive.mission;
  report.mission = mission.id;
  report.description = mission.description;
  report.dived_by = header.version;
  report.seed = header.seed;
  report.check = header.check;
  report.clearance_required_m = mission.limits.clearance.value;
  report.max_depth_m = mission.limits.max_depth.value;
  report.speed_mps = mission.speed.value;
  report.map_is_simulated = mission.unknown.has_value();
  report.files.push_back({"mission", header.mission_name, sha256(header.mission_xml)});
  if (!header.map_xml.empty()) {
    report.files.push_back({"map", header.map_name, sha256(header.map_xml)});
  }
  report.files.push_back({"vehicle", dive.model.name, sha256(header.vehicle_urdf)});
  report.world = dive.map;
  report.hull = dive.model.hull;
}

std::string rerun_problem(const ReplayReport& replayed) {
  if (!replayed.mathematics_difference.empty()) {
    return "the log was made with other mathematics than this program's";
  }
  if (!replayed.first_divergence.empty()) {
    return "this program decides otherwise than the one that dived: " + replayed.first_divergence;
  }
  return replayed.gaps.empty() ? "" : "the log is damaged";
}

/// The causes of everything that happened, as `dive explain` prints them.
void read_events(const std::string& log_path, double origin_s, DiveReport& dive) {
  tl::expected<LogReader, std::string> log = LogReader::open(log_path);
  if (!log) return;
  dive.events = explain(*log).events;
  for (Explained& event : dive.events) event.t_s -= origin_s;
}

}  // namespace

tl::expected<Report, std::string> read_dive(const std::string& log_path,
                                            const ReadDiveOptions& options) {
  tl::expected<LogReader, std::string> log = LogReader::open(log_path);
  if (!log) return tl::unexpected(log.error());
  const auto error = [&](const std::string& what) {
    return tl::unexpected(fmt::format("{}: {}", log_path, what));
  };
  log->observe(options.progress);
  if (!log->header()) return error("the log's header is damaged, so that its mission is not known");
  tl::expected<LoggedDive, std::string> logged = logged_dive(*log->header());
  if (!logged) return error(logged.error());

  Report report;
  report.title = fmt::format("{}: dive", logged->mission.id);
  describe_mission(*log->header(), *logged, report);
  report.dive.emplace();
  DiveReport& dive = *report.dive;
  DiveReader reader(report, options);
  const ReplayReport replayed = replay(
      *log, *logged,
      [&](const LoggedTick& tick, const Executive* executive) { reader.tick(tick, executive); });
  if (!reader.has_ticks()) return error("the log contains no complete tick");
  dive.rerun_problem = rerun_problem(replayed);
  dive.gaps = replayed.gaps;
  dive.torn = replayed.torn;
  dive.resumed = !log->header()->resume.empty();
  reader.finish();
  // The world of a simulation says nothing about where a real vehicle was.
  if (report.map_is_simulated && !dive.verdict.has_truth) report.world = {};
  measure_clearances(report.world, report.hull, options.max_clearances, dive.samples);
  dive.near_misses = near_misses(report.world, report.hull, report.clearance_required_m,
                                 dive.verdict.nearest.clearance_m, dive.samples);
  read_events(log_path, reader.origin_s(), dive);
  return report;
}

}  // namespace dive::mission
