#include "mission/link/sight_inbox.h"

#include <algorithm>
#include <utility>

namespace dive::mission {
namespace {

// Returns false for a late or duplicate message.
template <typename Stamped>
bool insert(std::deque<Stamped>& row, Stamped one, Utime after) {
  if (one.utime <= after) return false;
  const auto at = std::ranges::lower_bound(row, one.utime, {}, &Stamped::utime);
  if (at != row.end() && at->utime == one.utime) return false;
  row.insert(at, std::move(one));
  return true;
}

}  // namespace

void SightInbox::hear(ImuSample sample, std::optional<Utime> arrived) {
  if (arrived) sample.utime = clock_.ours(sample.utime, *arrived);
  if (!insert(inertial_, sample, last_inertial_)) ++stats_.inertial_dropped;
  if (inertial_.size() <= kMostInertial) return;
  inertial_.pop_front();
  ++stats_.inertial_dropped;
}

void SightInbox::hear(ImageFrame frame, std::optional<Utime> arrived) {
  const auto camera = static_cast<std::size_t>(frame.camera);
  if (camera >= pictures_.size()) return;
  const std::optional<Utime> taken =
      arrived ? clock_.follow(frame.utime, *arrived) : std::optional(frame.utime);
  // A right image that arrives after its left one was delivered is useless.
  const Utime after = camera == 0 ? last_left_ : last_left_ + kTogether;
  if (taken) frame.utime = *taken;
  std::deque<Picture>& row = pictures_[camera];
  Picture picture{frame.utime, arrived.value_or(0), std::move(frame)};
  if (!taken || !insert(row, std::move(picture), after)) ++stats_.pictures_dropped;
  if (row.size() <= kMostPictures) return;
  row.pop_front();
  ++stats_.pictures_dropped;
}

std::vector<ImuSample> SightInbox::take_inertial() {
  std::vector<ImuSample> samples(inertial_.begin(), inertial_.end());
  inertial_.clear();
  if (!samples.empty()) last_inertial_ = samples.back().utime;
  stats_.inertial += static_cast<std::int64_t>(samples.size());
  return samples;
}

void SightInbox::drop_pictures(std::deque<Picture>& row, Utime until) {
  while (!row.empty() && row.front().utime < until) {
    row.pop_front();
    ++stats_.pictures_dropped;
  }
}

StereoPair SightInbox::take_pair(Utime now) {
  auto& [left, right] = pictures_;
  if (left.empty()) return {};
  const Utime taken = left.front().utime;
  drop_pictures(right, taken - kTogether);  // their left images are lost
  const bool has_right = !right.empty() && right.front().utime <= taken + kTogether;
  const bool is_past = !right.empty() || left.size() > 1;
  if (!has_right && !is_past && now - left.front().arrived < kPatience) return {};
  StereoPair pair;
  pair.left = std::move(left.front().frame);
  left.pop_front();
  last_left_ = taken;
  ++(has_right ? stats_.pairs : stats_.alone);
  if (!has_right) return pair;
  pair.right = std::move(right.front().frame);
  right.pop_front();
  return pair;
}

bool SightInbox::has(const link::SimTick& tick) const {
  const auto has_picture = [this](std::size_t camera, const std::optional<Utime>& utime) {
    return !utime ||
           std::ranges::find(pictures_[camera], *utime, &Picture::utime) != pictures_[camera].end();
  };
  const auto heard = std::ranges::count_if(
      inertial_, [&](const ImuSample& sample) { return sample.utime <= tick.last_inertial; });
  return has_picture(0, tick.left) && has_picture(1, tick.right) && heard >= tick.inertial;
}

StereoPair SightInbox::take_pair(const link::SimTick& tick) {
  StereoPair pair;
  const auto take = [this](std::size_t camera, const std::optional<Utime>& utime,
                           std::optional<ImageFrame>& to) {
    const auto found = std::ranges::find(pictures_[camera], utime, &Picture::utime);
    if (found != pictures_[camera].end()) to = std::move(found->frame);
  };
  take(0, tick.left, pair.left);
  take(1, tick.right, pair.right);
  if (!pair.left && !pair.right) return pair;
  for (std::deque<Picture>& row : pictures_) row.clear();
  last_left_ = tick.left.value_or(tick.right.value_or(last_left_));
  return pair;
}

}  // namespace dive::mission
