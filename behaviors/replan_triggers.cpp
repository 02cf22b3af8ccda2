#include "behaviors/replan_triggers.h"

namespace dive::behaviors {

const char* to_string(ReplanCause cause) {
  switch (cause) {
    case ReplanCause::kNone:
      return "none";
    case ReplanCause::kPeriod:
      return "period";
    case ReplanCause::kDeviation:
      return "deviation";
  }
  return "none";
}

void ReplanTriggers::path_started(Utime now) {
  path_start_ = now;
  deviating_since_.reset();
}

bool ReplanTriggers::take_one() {
  if (replans_ >= policy_.max_replans) return false;
  ++replans_;
  return true;
}

ReplanCause ReplanTriggers::update(Utime now, double deviation_m) {
  if (!policy_.deviation_m || deviation_m <= *policy_.deviation_m) {
    deviating_since_.reset();
  } else if (!deviating_since_) {
    deviating_since_ = now;
  }
  const double age = to_seconds(now - path_start_);
  if (age < policy_.min_interval_s) return ReplanCause::kNone;

  ReplanCause cause = ReplanCause::kNone;
  if (policy_.period_s && age >= *policy_.period_s) cause = ReplanCause::kPeriod;
  if (deviating_since_ && to_seconds(now - *deviating_since_) >= policy_.deviation_persistence_s) {
    cause = ReplanCause::kDeviation;
  }
  if (cause == ReplanCause::kNone || !take_one()) return ReplanCause::kNone;
  path_start_ = now;  // the next one counts from this request, answered or not
  return cause;
}

}  // namespace dive::behaviors
