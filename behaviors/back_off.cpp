#include "behaviors/back_off.h"

#include <algorithm>
#include <cmath>

namespace dive::behaviors {
namespace {

constexpr double kTooNear = 0.65;   // of D_min; with less than planning::kRoomAtStart only so far
constexpr double kWorthIt = 0.05;   // m more room than here
constexpr double kTryAgain = 2.0;   // s
constexpr double kElsewhere = 3.0;  // m
constexpr double kSpeed = 0.15;     // m/s, bow or stern first
constexpr double kLookahead = 0.4;  // m
constexpr double kArrived = 0.2;    // m
constexpr double kOffCourse = 0.5;  // rad: turns first
constexpr double kGraceSeconds = 15.0;
constexpr double kSlow = 3.0;  // times as long as it should take is not getting on

}  // namespace

// On the way back, headed along `way`, or astern with its nose the other way.
Pose BackOff::pose_at(const Eigen::Vector3d& p_W, const Eigen::Vector3d& way) const {
  const Eigen::Vector3d nose = astern_ ? Eigen::Vector3d(-way) : way;
  return {p_W, from_rpy(0.0, 0.0, std::atan2(nose.y(), nose.x()))};
}

bool BackOff::is_needed(const BehaviorInput& input) {
  const Eigen::Vector3d& p_W = input.estimate->X_WB.p;
  if (last_W_) tight_m_ += (p_W - *last_W_).norm();
  last_W_ = p_W;
  if (!input.map_changed || input.seen == nullptr || input.trail == nullptr) return false;
  room_m_ = input.seen->clearance({&input.estimate->X_WB, 1});
  if (room_m_ >= planning::kRoomAtStart * clearance_) tight_m_ = 0.0;
  if (tried_at_ && to_seconds(input.now - *tried_at_) < kTryAgain) return false;
  return room_m_ < kTooNear * clearance_ || tight_m_ > planning::kWayToRoom;
}

Trail::Way BackOff::way_back(const BehaviorInput& input, const Asked& asked) const {
  const Pose& X_WB = input.estimate->X_WB;
  double most_m = room_m_ + kWorthIt;
  Eigen::Vector3d roomiest_W = X_WB.p;
  const auto has_room = [&](const Trail::Crumb& crumb) {
    const Eigen::Vector3d& p_W = crumb.p_W;
    if ((p_W - X_WB.p).norm() < asked.least_m || (asked.open && !crumb.open_above)) return false;
    const Pose there{p_W, X_WB.q};
    const double room_m = input.seen->clearance({&there, 1});
    if (room_m > most_m) {
      most_m = room_m;
      roomiest_W = p_W;
    }
    return room_m >= planning::kRoomAtStart * clearance_ &&
           (asked.least_m > 0.0 || room_m > room_m_ + kWorthIt);
  };
  const double link_m = kTrailLinkShare * clearance_;
  Trail::Way way = input.trail->way_to(X_WB.p, link_m, asked.most_m, has_room);
  if (way.arrives || roomiest_W == X_WB.p) return way;
  return input.trail->way_to(X_WB.p, link_m, asked.most_m,
                             [&](const Trail::Crumb& crumb) { return crumb.p_W == roomiest_W; });
}

int BackOff::count_at(const Eigen::Vector3d& p_W) const {
  return last_place_W_ && (p_W - *last_place_W_).norm() <= kElsewhere ? count_ : 0;
}

bool BackOff::begin(const BehaviorInput& input, const Asked& asked) {
  tried_at_ = input.now;
  if (input.seen == nullptr || input.trail == nullptr) return false;
  Trail::Way way = way_back(input, asked);
  if (!way.arrives || way.points.size() < 2) return false;
  const Pose& X_WB = input.estimate->X_WB;
  way_ = std::move(way.points);
  next_ = 1;
  astern_ = (X_WB.q * Eigen::Vector3d::UnitX()).dot(way_[1] - X_WB.p) < 0.0;
  if (clearance_of_rest(input) <= 0.0) {
    way_.clear();
    return false;
  }
  until_ = input.now + from_seconds(kGraceSeconds + kSlow * way.length_m / kSpeed);
  count_ = count_at(X_WB.p) + 1;
  last_place_W_ = X_WB.p;
  return true;
}

// From here on, with the turn on the spot to where it begins.
double BackOff::clearance_of_rest(const BehaviorInput& input) const {
  std::vector<Pose> poses = {input.estimate->X_WB};
  Eigen::Vector3d from = poses.front().p;
  for (std::size_t i = next_; i < way_.size(); ++i) {
    poses.push_back(pose_at(from, way_[i] - from));
    from = way_[i];
  }
  poses.push_back({from, poses.back().q});
  return input.seen->clearance(poses);
}

// Leaves behind what is nearer than the lookahead.
Eigen::Vector3d BackOff::point_ahead(const Eigen::Vector3d& p_W) {
  while (next_ + 1 < way_.size() && (way_[next_] - p_W).norm() < kLookahead) ++next_;
  return way_[next_];
}

std::optional<vehicle::Command> BackOff::follow(const BehaviorInput& input) {
  const Pose& X_WB = input.estimate->X_WB;
  const Eigen::Vector3d way = point_ahead(X_WB.p) - X_WB.p;
  const bool arrived = next_ + 1 == way_.size() && way.norm() < kArrived;
  const bool blocked =
      input.map_changed && input.seen != nullptr && clearance_of_rest(input) <= 0.0;
  if (arrived || blocked || input.now >= until_) {
    way_.clear();
    tight_m_ = 0.0;
    last_W_.reset();
    return std::nullopt;
  }
  vehicle::Command command;
  command.o = pose_at(X_WB.p, way).q;
  command.d = std::max(-way_[next_].z(), 0.0);
  const double off = std::abs(wrap_angle(to_rpy(command.o).z() - to_rpy(X_WB.q).z()));
  const double speed = kSpeed * std::max(1.0 - off / kOffCourse, 0.0);
  command.v = astern_ ? -speed : speed;
  return command;
}

}  // namespace dive::behaviors
