#pragma once
// Pictures, inertial samples and depth to a word of vision: front end and filter, how they begin,
// and when they are not to be believed.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "common/tag.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/tag_detector.h"
#include "estimation/visual_inertial/tag_fix.h"
#include "estimation/visual_inertial/tracker.h"
#include "estimation/visual_inertial/visual_inertial_filter.h"

namespace dive::estimation {

struct VisionOptions {
  VisualInertialOptions filter;  ///< With one camera, or two.
  TrackerOptions tracker;
  double period_s = 0.05;        ///< From one pair of pictures to the next.
  double blurred_share = 0.35;   ///< Of the sharpness that there was: less is a blurred picture.
  double grace_s = 3.0;          ///< So soon after it sees again the filter has used a feature,
  double refused_s = 5.0;        ///< and then at least so often.
  double max_dark_s = 15.0;      ///< After a longer time without a picture it begins anew.
  double expected_sigma = 0.12;  ///< m/s per axis, of the speed expected where nothing is seen;
  double expected_hz = 5.0;      ///< told so often. Its errors last: more often is not better.

  std::vector<Tag> tags;  ///< Where they are known to be; none: none are looked for,
  TagDetectorOptions tag_detector;
  TagFixOptions tag_fix;
  double tag_period_s = 0.2;  ///< and else so often, by the left camera.

  /// Empty when usable, else a sentence.
  [[nodiscard]] std::string validate() const;
};

/// All that has come since the last one.
struct VisionInput {
  std::vector<ImuSample> imu;
  std::vector<DepthSample> depth;
  /// The newest estimate that was published, from which it begins, and what speed to expect.
  StateEstimate published;
  std::optional<ImageFrame> left;  ///< None: none has come.
  std::optional<ImageFrame> right;
};

/// Same options and seed, same calls: the same words, bit for bit, on one machine.
class VisionPipeline {
 public:
  /// Demands options that validate.
  VisionPipeline(const VisionOptions& options, std::uint64_t seed);

  /// Its word on the picture of `input`, or that there was none. Whatever comes in, it is finite
  /// or says that it is not to be believed.
  [[nodiscard]] VisionEstimate step(const VisionInput& input);

  /// Of the last picture, in the filter's frame, which may be some way off the published one.
  [[nodiscard]] std::span<const Landmark> landmarks() const { return filter_.landmarks(); }
  /// Where the last picture was taken, by the filter's window: no velocity. Nothing where there was
  /// none of use, or the filter is not to be believed.
  [[nodiscard]] std::optional<StateEstimate> at_picture() const;
  /// As the filter has calibrated them, left first.
  [[nodiscard]] std::span<const Pose> cameras_B() const { return filter_.state().cameras_B; }
  [[nodiscard]] const FilterHealth& health() const { return filter_.health(); }
  /// Begun so many times.
  [[nodiscard]] int beginnings() const { return beginnings_; }

 private:
  void begin(const StateEstimate& published);
  void expect_speed(const StateEstimate& published);
  void hear(const VisionInput& input);
  [[nodiscard]] PictureQuality look(const VisionInput& input);
  [[nodiscard]] std::optional<Eigen::Quaterniond> turn_to(Utime utime) const;
  [[nodiscard]] VisionFault judge_picture(const PictureQuality& quality);
  [[nodiscard]] VisionFault judge_filter(Utime now);
  void look_for_tags(const ImageFrame& picture, VisionEstimate& word);

  VisionOptions options_;
  VisualInertialFilter filter_;
  Tracker tracker_;
  std::optional<TagDetector> tag_detector_;  ///< Where there are tags.
  TagFix tag_fix_;
  Utime looked_for_tags_;
  std::vector<ImuSample> recent_;  ///< For the turn from one picture to the next.
  bool has_begun_ = false;
  bool has_gap_ = false;  ///< The IMU was silent for long.
  int beginnings_ = 0;
  Utime begun_from_ = 0;
  Utime began_at_ = 0;
  double proof_s_ = 0.0;           ///< That it has to see before it is believed.
  Utime newest_ = 0;               ///< IMU sample.
  Utime last_picture_ = 0;         ///< That was of use.
  std::optional<Utime> pictured_;  ///< Of the last step, where the filter has it and is believed.
  Utime sees_since_ = 0;           ///< But for single pictures.
  Utime told_speed_ = 0;
  double sharpness_ = 0.0;  ///< Usual.
};

}  // namespace dive::estimation
