#include "mission/link/camera_inbox.h"

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

void CameraInbox::add(ImuSample sample, std::optional<Utime> arrived) {
  if (arrived) sample.utime = clock_.ours(sample.utime, *arrived);
  if (!insert(inertial_, sample, last_inertial_)) ++stats_.imu_samples_dropped;
  if (inertial_.size() <= kMaxImuSamples) return;
  inertial_.pop_front();
  ++stats_.imu_samples_dropped;
}

void CameraInbox::add(ImageFrame frame, std::optional<Utime> arrived) {
  const auto camera = static_cast<std::size_t>(frame.camera);
  if (camera >= images_.size()) return;
  const std::optional<Utime> taken =
      arrived ? clock_.follow(frame.utime, *arrived) : std::optional(frame.utime);
  // A right image that arrives after its left one was delivered is useless.
  const Utime after = camera == 0 ? last_left_ : last_left_ + kTogether;
  if (taken) frame.utime = *taken;
  std::deque<Image>& row = images_[camera];
  Image image{frame.utime, arrived.value_or(0), std::move(frame)};
  if (!taken || !insert(row, std::move(image), after)) ++stats_.images_dropped;
  if (row.size() <= kMaxImages) return;
  row.pop_front();
  ++stats_.images_dropped;
}

std::vector<ImuSample> CameraInbox::take_inertial() {
  std::vector<ImuSample> samples(inertial_.begin(), inertial_.end());
  inertial_.clear();
  if (!samples.empty()) last_inertial_ = samples.back().utime;
  stats_.imu_samples += static_cast<std::int64_t>(samples.size());
  return samples;
}

void CameraInbox::drop_images(std::deque<Image>& row, Utime until) {
  while (!row.empty() && row.front().utime < until) {
    row.pop_front();
    ++stats_.images_dropped;
  }
}

StereoPair CameraInbox::take_pair(Utime now) {
  auto& [left, right] = images_;
  if (left.empty()) return {};
  const Utime taken = left.front().utime;
  drop_images(right, taken - kTogether);  // their left images are lost
  const bool has_right = !right.empty() && right.front().utime <= taken + kTogether;
  const bool is_past = !right.empty() || left.size() > 1;
  if (!has_right && !is_past && now - left.front().arrived < kPatience) return {};
  StereoPair pair;
  pair.left = std::move(left.front().frame);
  left.pop_front();
  last_left_ = taken;
  ++(has_right ? stats_.pairs : stats_.unpaired);
  if (!has_right) return pair;
  pair.right = std::move(right.front().frame);
  right.pop_front();
  return pair;
}

bool CameraInbox::has(const link::SimTick& tick) const {
  const auto has_image = [this](std::size_t camera, const std::optional<Utime>& utime) {
    return !utime ||
           std::ranges::find(images_[camera], *utime, &Image::utime) != images_[camera].end();
  };
  const auto received = std::ranges::count_if(
      inertial_, [&](const ImuSample& sample) { return sample.utime <= tick.last_imu; });
  return has_image(0, tick.left) && has_image(1, tick.right) && received >= tick.imu_samples;
}

StereoPair CameraInbox::take_pair(const link::SimTick& tick) {
  StereoPair pair;
  const auto take = [this](std::size_t camera, const std::optional<Utime>& utime,
                           std::optional<ImageFrame>& to) {
    const auto found = std::ranges::find(images_[camera], utime, &Image::utime);
    if (found != images_[camera].end()) to = std::move(found->frame);
  };
  take(0, tick.left, pair.left);
  take(1, tick.right, pair.right);
  if (!pair.left && !pair.right) return pair;
  for (std::deque<Image>& row : images_) row.clear();
  last_left_ = tick.left.value_or(tick.right.value_or(last_left_));
  return pair;
}

}  // namespace dive::mission
