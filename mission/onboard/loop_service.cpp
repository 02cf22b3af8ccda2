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
  if (is_new) aligned_.setZero();
  keyframe.filter.X_WB.p += aligned_;
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
  if (settings_.moves_map && !correction.map_correction.nodes.empty()) {
    map_correction_ = std::move(correction.map_correction);
  }
  correction_ = std::move(correction);
}

void LoopService::align(const Eigen::Vector2d& by_W) {
  const Eigen::Vector3d by(by_W.x(), by_W.y(), 0.0);
  aligned_ += correction_ ? correction_->correction.q.conjugate() * by : by;
}

std::optional<MapCorrection> LoopService::take_map_correction() {
  return std::exchange(map_correction_, std::nullopt);
}

void LoopService::correct(estimation::VisionEstimate& vision) const {
  vision.loops = loops_;
  const estimation::StateEstimate& filter = vision.estimate;
  const bool has_one = correction_ && vision.init_utime == init_utime_;
  if (!has_one || !filter.valid || filter.utime < correction_->utime) return;
  if (!filter.X_WB.is_finite() || !filter.covariance.allFinite()) return;
  if (!settings_.moves_map) {
    vision.estimate = correction_->apply(filter);
    return;
  }
  estimation::StateEstimate aligned = filter;
  aligned.X_WB.p += aligned_;
  vision.estimate.covariance = turned_back(correction_->apply(aligned).covariance);
}

// The frame correction turns it with the estimate: position in W, attitude in B.
Matrix6d LoopService::turned_back(const Matrix6d& covariance) const {
  Matrix6d R = Matrix6d::Identity();
  R.topLeftCorner<3, 3>() = correction_->correction.q.conjugate().toRotationMatrix();
  return R * covariance * R.transpose();
}

}  // namespace dive::mission
