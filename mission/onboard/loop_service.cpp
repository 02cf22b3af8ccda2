#include "mission/onboard/loop_service.h"

#include <utility>

#include "common/assert.h"

namespace dive::mission {

LoopService::LoopService(Look look, const LoopSettings& settings, Late late)
    : look_(std::move(look)), settings_(settings), worker_(late) {
  DIVE_DEMAND(look_ && settings_.closer.validate().empty() && settings_.latency > 0);
}

void LoopService::submit(estimation::Keyframe keyframe, Utime now) {
  if (!worker_.is_idle()) return;
  const bool is_new = !last_ || keyframe.begun_from != begun_from_;
  if (!is_new && !settings_.closer.is_far(*last_, keyframe.filter.X_WB)) return;
  if (is_new) correction_.reset();
  last_ = keyframe.filter.X_WB;
  begun_from_ = keyframe.begun_from;
  worker_.start(now + settings_.latency,
                [this, keyframe = std::move(keyframe)] { return look_(keyframe); });
}

void LoopService::poll(Utime now) {
  std::optional<estimation::LoopCorrection> found = worker_.poll(now).value_or(std::nullopt);
  if (found) accept(std::move(*found));
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
