#include "mission/onboard/loop_service.h"

#include <utility>

#include "common/assert.h"

namespace dive::mission {

LoopService::LoopService(Process process, const LoopSettings& settings, OnLate late)
    : process_(std::move(process)), settings_(settings), worker_(late) {
  DIVE_DEMAND(process_ && settings_.closer.validate().empty() && settings_.latency > 0);
}

void LoopService::submit(estimation::Keyframe keyframe, Utime now) {
  if (!worker_.is_idle()) return;
  const bool is_new = !last_ || keyframe.init_utime != init_utime_;
  if (!is_new && !settings_.closer.is_far(*last_, keyframe.filter.X_WB)) return;
  if (is_new) correction_.reset();
  last_ = keyframe.filter.X_WB;
  init_utime_ = keyframe.init_utime;
  worker_.start(now + settings_.latency,
                [this, keyframe = std::move(keyframe)] { return process_(keyframe); });
}

void LoopService::poll(Utime now) {
  std::optional<estimation::LoopCorrection> found = worker_.poll(now).value_or(std::nullopt);
  if (found) accept(std::move(*found));
}

void LoopService::accept(estimation::LoopCorrection correction) {
  const Pose before = correction_ ? correction_->correction * correction.filter : correction.filter;
  const Pose after = correction.correction * correction.filter;
  ++loops_.count;
  loops_.first_observed = correction.closure.utime_old;
  loops_.recognised = correction.closure.utime_new;
  loops_.moved_m = (after.p - before.p).head<2>().norm();
  loops_.turned_rad = to_rpy(after.q * before.q.conjugate()).z();
  correction_ = std::move(correction);
}

void LoopService::correct(estimation::VisionEstimate& vision) const {
  vision.loops = loops_;
  const estimation::StateEstimate& filter = vision.estimate;
  const bool has_one = correction_ && vision.init_utime == init_utime_;
  if (!has_one || !filter.valid || filter.utime < correction_->utime) return;
  if (!filter.X_WB.is_finite() || !filter.covariance.allFinite()) return;
  vision.estimate = correction_->apply(filter);
}

}  // namespace dive::mission
