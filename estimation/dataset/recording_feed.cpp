#include "estimation/dataset/recording_feed.h"

#include <algorithm>
#include <utility>

#include "estimation/dataset/sample_times.h"

namespace dive::estimation {
namespace {

constexpr double kMinPeriod_s = 0.005;
constexpr double kMaxPeriod_s = 2.0;

double period_of(const std::vector<RecordedImage>& images) {
  if (images.size() < 2) return VisionOptions{}.period_s;
  return std::clamp(median_step(images), kMinPeriod_s, kMaxPeriod_s);
}

// Appends those from `index` on that are not later than `until`.
template <typename Sample>
void take(const std::vector<Sample>& samples, Utime until, std::size_t& index,
          std::vector<Sample>& out) {
  for (; index < samples.size() && samples[index].utime <= until; ++index) {
    out.push_back(samples[index]);
  }
}

template <typename Sample>
std::size_t first_at(const std::vector<Sample>& samples, Utime utime) {
  return static_cast<std::size_t>(
      std::find_if(samples.begin(), samples.end(),
                   [utime](const Sample& sample) { return sample.utime >= utime; }) -
      samples.begin());
}

}  // namespace

RecordingFeed::RecordingFeed(const Recording& recording, const FeedOptions& options)
    : recording_(recording),
      options_(options),
      period_s_(period_of(recording.cameras.at(0).images)),
      first_image_(first_at(recording.cameras[0].images, options.begin)),
      image_(first_image_),
      imu_(first_at(recording.imu, options.begin)),
      depth_(first_at(recording.depth, options.begin)),
      velocity_(first_at(recording.velocity, options.begin)) {}

// An image waits until the samples extend beyond it, and not for those after a gap.
Utime RecordingFeed::last_sample_of(Utime image) const {
  const auto& imu = recording_.imu;
  const Utime beyond = image + VisionPipeline::kImuBeyondImage;
  for (std::size_t i = imu_; i < imu.size(); ++i) {
    if (imu[i].utime < beyond) continue;
    return imu[i].utime <= image + VisionPipeline::kImuPatience ? imu[i].utime : beyond;
  }
  return beyond;
}

// When an image is missing next: after two periods, and not before something arrives. Without that,
// a stamp years later would be waited for in steps of two periods.
Utime RecordingFeed::next_missed(Utime image) const {
  const Utime missed = last_ + from_seconds(VisionPipeline::kMissedPeriods * period_s_);
  const Utime sample = imu_ < recording_.imu.size() ? recording_.imu[imu_].utime : image;
  return std::max(missed, std::min(sample, image));
}

void RecordingFeed::add_samples(VisionInput& input) {
  take(recording_.imu, input.now, imu_, input.imu);
  take(recording_.velocity, input.now, velocity_, input.velocity);
  if (!options_.use_depth) return;
  take(recording_.depth, input.now, depth_, input.depth);
  for (DepthSample& sample : input.depth) sample.depth_m -= options_.depth_datum_m;
}

// An image that cannot be read is left out, as in a dive.
void RecordingFeed::read(const RecordedImage& image, FeedStep& step) const {
  auto left = read_image(image, 0);
  if (!left) {
    step.left_error = left.error();
    return;
  }
  step.input.left = std::move(*left);
  const RecordedImage* const other = options_.mono || recording_.cameras.size() < 2
                                         ? nullptr
                                         : image_at(recording_.cameras[1].images, image.utime);
  if (other == nullptr) return;
  auto right = read_image(*other, 1);
  if (right) {
    step.input.right = std::move(*right);
  } else {
    step.right_error = right.error();
  }
}

std::optional<FeedStep> RecordingFeed::next() {
  const std::vector<RecordedImage>& images = recording_.cameras[0].images;
  if (image_ == images.size()) return std::nullopt;
  FeedStep step;
  step.image = image_;
  const RecordedImage& image = images[image_];
  step.image_utime = image.utime;
  const Utime missed = next_missed(image.utime);
  step.has_image = last_ == 0 || image.utime <= missed;
  last_ = step.has_image ? image.utime : missed;
  step.input.now = step.has_image ? last_sample_of(image.utime) : missed;
  add_samples(step.input);
  if (!step.has_image) return step;
  ++image_;
  if (options_.read_images) read(image, step);
  return step;
}

}  // namespace dive::estimation
