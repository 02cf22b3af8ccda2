#include "mission/onboard/vision_service.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <utility>

namespace dive::mission {
namespace {

constexpr std::size_t kMaxImuSamples = 4096;    // twenty seconds that a worker may be late
constexpr std::size_t kMaxDepthSamples = 1024;  // likewise

template <class Sample>
void keep(std::vector<Sample>& samples, const Sample& sample, std::size_t most) {
  if (samples.size() == most) samples.erase(samples.begin());
  samples.push_back(sample);
}

}  // namespace

VisionService::VisionService(const estimation::VisionOptions& options, std::uint64_t seed,
                             Utime latency, OnLate late, RangeMaker make_range,
                             const std::optional<LoopSettings>& loops,
                             const std::optional<estimation::ImuBias>& bias)
    : make_pipeline_([options, bias, seed] {
        return estimation::VisionPipeline(options, estimation::PublishedStart{bias}, seed);
      }),
      pipeline_(make_pipeline_()),
      period_s_(options.period_s),
      latency_(latency),
      make_range_(std::move(make_range)),
      bias_(bias),
      worker_(late) {
  const std::vector<CameraModel>& cameras = options.filter.cameras;
  if (!loops || cameras.size() < 2) return;
  auto finder = std::make_shared<estimation::LoopFinder>(loops->closer, cameras[0], cameras[1]);
  loops_.emplace([finder](const auto& keyframe) { return finder->process(keyframe); }, *loops,
                 late);
}

void VisionService::add(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples) {
    keep(imu_, sample, kMaxImuSamples);
    newest_imu_ = sample.utime;
  }
}

void VisionService::add(const DepthSample& sample) { keep(depth_, sample, kMaxDepthSamples); }

void VisionService::submit(std::optional<ImageFrame> left, std::optional<ImageFrame> right,
                           Utime now) {
  if (!left) return;  // it is missed
  next_ = Pair{std::move(left), std::move(right), now};
}

// The filter can process an image once it has the IMU samples up to it.
bool VisionService::is_ripe(Utime now) const {
  return newest_imu_ >= next_->left->utime + estimation::VisionPipeline::kImuBeyondImage ||
         now - next_->asked >= estimation::VisionPipeline::kImuPatience;
}

void VisionService::observe(const estimation::StateEstimate& published) {
  published_ = published;
  const Utime now = published.utime;
  if (!worker_.may_start()) return;
  if (next_) {
    if (!is_ripe(now)) return;
    const Utime asked = next_->asked;
    launch(asked, std::exchange(next_, std::nullopt));
  } else if (to_seconds(now - launched_) > estimation::VisionPipeline::kMissedPeriods * period_s_) {
    launch(now, std::nullopt);
  }
}

void VisionService::launch(Utime asked, std::optional<Pair> pair) {
  worker_.collect();
  launched_ = published_.utime;
  estimation::VisionInput input;
  input.imu = std::exchange(imu_, {});
  input.depth = std::exchange(depth_, {});
  input.now = published_.utime;
  input.published = published_;
  if (published_.valid) input.expected_v_B = published_.v_WB_B;
  if (pair) {
    input.left = std::move(pair->left);
    input.right = std::move(pair->right);
  }
  worker_.start(asked + latency_,
                [this, input = std::move(input)]() mutable { return work(std::move(input)); });
}

// What has thrown may be half updated: it is replaced by one that begins again.
VisionService::Answer VisionService::work(estimation::VisionInput input) {
  try {
    return process(std::move(input));
  } catch (const std::exception&) {
    pipeline_ = make_pipeline_();
    throw;
  }
}

VisionService::Answer VisionService::process(estimation::VisionInput input) {
  Answer answer{pipeline_.step(input), std::nullopt};
  answer.bias = pipeline_.imu_bias();
  const std::optional<estimation::StateEstimate> filter = pipeline_.at_image();
  if (make_range_ && input.left) {
    answer.scan = make_range_(
        {&*input.left, input.right ? &*input.right : nullptr, filter, pipeline_.landmarks()});
  }
  if (!loops_ || !input.right) return answer;
  if (filter) {
    const std::span<const Pose> cameras_B = pipeline_.cameras_B();
    answer.keyframe.emplace(estimation::Keyframe{std::move(*input.left), std::move(*input.right),
                                                 *filter, cameras_B[0], cameras_B[1],
                                                 answer.estimate.init_utime});
  }
  return answer;
}

std::optional<estimation::VisionEstimate> VisionService::poll(Utime now) {
  if (loops_) loops_->poll(now);
  std::optional<Answer> answer = worker_.poll(now);
  if (!answer) return std::nullopt;
  bias_ = answer->bias;
  if (answer->scan) scan_ = std::move(answer->scan);
  if (loops_) {
    loops_->correct(answer->estimate);
    if (answer->keyframe) loops_->submit(std::move(*answer->keyframe), now);
  }
  return answer->estimate;
}

std::optional<std::string> VisionService::take_failure() {
  if (auto failure = worker_.take_failure()) return failure;
  return loops_ ? loops_->take_failure() : std::nullopt;
}

void VisionService::align(const Eigen::Vector2d& by_W) {
  if (loops_) loops_->align(by_W);
}

std::optional<MapCorrection> VisionService::take_map_correction() {
  return loops_ ? loops_->take_map_correction() : std::nullopt;
}

std::optional<RangeScan> VisionService::take_scan() { return std::exchange(scan_, std::nullopt); }

}  // namespace dive::mission
