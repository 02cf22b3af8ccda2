#include "mission/executive/loop_service.h"

#include <utility>

#include "common/assert.h"
#include "common/priority.h"

namespace dive::mission {

LoopService::LoopService(Look look, const LoopSettings& settings, Late late)
    : look_(std::move(look)), settings_(settings), late_(late) {
  DIVE_DEMAND(look_ && settings_.closer.validate().empty() && settings_.latency > 0);
}

LoopService::~LoopService() {
  if (working_.valid()) working_.wait();
}

void LoopService::submit(estimation::Keyframe keyframe, Utime now) {
  if (working_.valid()) return;
  const bool is_new = !last_ || keyframe.begun_from != begun_from_;
  if (!is_new && !settings_.closer.is_far(*last_, keyframe.filter.X_WB)) return;
  if (is_new) correction_.reset();
  last_ = keyframe.filter.X_WB;
  begun_from_ = keyframe.begun_from;
  due_ = now + settings_.latency;
  working_ = std::async(std::launch::async, [this, keyframe = std::move(keyframe)] {
    run_as_others();  // a loop may be closed late, a command may not come late
    return look_(keyframe);
  });
}

void LoopService::poll(Utime now) {
  if (!working_.valid() || now < due_) return;
  if (late_ == Late::kNotYet && is_busy(working_)) return;
  if (auto correction = working_.get()) accept(std::move(*correction));
}

void LoopService::accept(estimation::LoopCorrection correction) {
  const Pose before = correction_ ? correction_->correction * correction.filter : correction.filter;
  const Pose after = correction.correction * correction.filter;
  ++loops_.count;
  loops_.seen = correction.closure.utime_old;
  loops_.recognised = correction.closure.utime_new;
  loops_.moved_m = (after.p - before.p).head<2>().norm();
  loops_.turned_rad = to_rpy(after.q * before.q.conjugate()).z();
  correction_ = std::move(correction);
}

void LoopService::correct(estimation::VisionEstimate& word) const {
  word.loops = loops_;
  const estimation::StateEstimate& filter = word.estimate;
  const bool has_one = correction_ && word.begun_from == begun_from_;
  if (!has_one || !filter.valid || filter.utime < correction_->utime) return;
  if (!filter.X_WB.is_finite() || !filter.covariance.allFinite()) return;
  word.estimate = correction_->apply(filter);
}

}  // namespace dive::mission
