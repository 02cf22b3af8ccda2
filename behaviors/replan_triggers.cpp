#include "behaviors/replan_triggers.h"

namespace dive::behaviors {
namespace {

constexpr double kNearer = 0.2;  // m: least reduction of the distance that counts as progress

}  // namespace

const char* to_string(ReplanCause cause) {
  switch (cause) {
    case ReplanCause::kNone:
      return "none";
    case ReplanCause::kPeriod:
      return "period";
    case ReplanCause::kDeviation:
      return "deviation";
    case ReplanCause::kClearance:
      return "clearance";
    case ReplanCause::kNoProgress:
      return "no progress";
    case ReplanCause::kMapChanged:
      return "map changed";
    case ReplanCause::kEstimatorSwitched:
      return "estimator switched";
    case ReplanCause::kPositionCorrected:
      return "position corrected";
    case ReplanCause::kDemanded:
      return "failsafe";
  }
  return "none";
}

void ReplanTriggers::path_started(Utime now) {
  path_start_ = now;
  deviating_since_.reset();
  nearest_m_.reset();
}

bool ReplanTriggers::take_one() {
  if (replans_ >= policy_.max_replans) return false;
  ++replans_;
  return true;
}

ReplanCause ReplanTriggers::update(Utime now, const ReplanSignals& signals) {
  const ReplanCause cause = pending(now, signals);
  if (to_seconds(now - path_start_) < policy_.min_interval_s) return ReplanCause::kNone;
  kept_ = ReplanCause::kNone;
  if (cause == ReplanCause::kNone || !take_one()) return ReplanCause::kNone;
  path_start_ = now;  // the interval starts at this request, answered or not
  nearest_m_.reset();
  return cause;
}

// The most urgent cause is the last one set. Events are kept; conditions persist by themselves.
ReplanCause ReplanTriggers::pending(Utime now, const ReplanSignals& signals) {
  if (!policy_.deviation_m || signals.deviation_m <= *policy_.deviation_m) {
    deviating_since_.reset();
  } else if (!deviating_since_) {
    deviating_since_ = now;
  }
  if (!nearest_m_ || signals.distance_to_go_m < *nearest_m_ - kNearer) {
    nearest_m_ = signals.distance_to_go_m;
    nearest_at_ = now;
  }
  if (policy_.estimator_switch && signals.estimator_switched) {
    kept_ = ReplanCause::kEstimatorSwitched;
  }
  if (policy_.clearance_m && signals.new_clearance_m &&
      *signals.new_clearance_m < *policy_.clearance_m) {
    kept_ = ReplanCause::kClearance;
  }
  if (signals.position_corrected) kept_ = ReplanCause::kPositionCorrected;
  if (policy_.map_change && (signals.path_blocked || signals.may_be_shorter)) {
    kept_ = ReplanCause::kMapChanged;
  }

  ReplanCause cause = ReplanCause::kNone;
  if (policy_.period_s && to_seconds(now - path_start_) >= *policy_.period_s) {
    cause = ReplanCause::kPeriod;
  }
  if (policy_.no_progress_s && to_seconds(now - nearest_at_) >= *policy_.no_progress_s) {
    cause = ReplanCause::kNoProgress;
  }
  if (deviating_since_ && to_seconds(now - *deviating_since_) >= policy_.deviation_persistence_s) {
    cause = ReplanCause::kDeviation;
  }
  if (kept_ != ReplanCause::kNone) cause = kept_;
  if (signals.demanded) cause = ReplanCause::kDemanded;
  return cause;
}

}  // namespace dive::behaviors
