#pragma once
// From images, IMU samples and depth to a visual-inertial estimate: front end and filter, their
// initialisation, and the checks that reject the estimate.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "common/tag.h"
#include "common/velocity_sample.h"
#include "estimation/state_estimate.h"
#include "estimation/vision_estimate.h"
#include "estimation/visual_inertial/filter/visual_inertial_filter.h"
#include "estimation/visual_inertial/front_end/tracker.h"
#include "estimation/visual_inertial/pipeline/restart_memory.h"
#include "estimation/visual_inertial/pipeline/vision_start.h"
#include "estimation/visual_inertial/tags/tag_detector.h"
#include "estimation/visual_inertial/tags/tag_fix.h"

namespace dive::estimation {

struct VisionOptions {
  VisualInertialOptions filter;  ///< Filter with one camera or two.
  TrackerOptions tracker;
  double period_s = 0.05;        ///< Period of the image pairs.
  double blurred_share = 0.35;   ///< Fraction of the usual sharpness below which it is blurred.
  double grace_s = 3.0;          ///< Time for the filter to use a feature after images return.
  double refused_s = 5.0;        ///< Maximum time between used features after that.
  double max_refused_s = 15.0;   ///< The same, after which the filter is re-initialised.
  double max_dark_s = 15.0;      ///< Time without images after which the filter is re-initialised.
  double expected_sigma = 0.12;  ///< Sigma of the expected speed in the dark, m/s per axis.
  double expected_hz = 5.0;      ///< Rate of that update. Its errors persist: more is no better.

  std::vector<Tag> tags;  ///< Tags at known poses; empty: none are searched.
  TagDetectorOptions tag_detector;
  TagFixOptions tag_fix;
  double tag_period_s = 0.2;  ///< Period of the search for tags in the left images.

  /// Empty if usable, else a sentence.
  [[nodiscard]] std::string validate() const;
};

/// All inputs that have arrived since the last one.
struct VisionInput {
  Utime now = 0;  ///< Present time.
  std::vector<ImuSample> imu;
  std::vector<DepthSample> depth;
  std::vector<VelocitySample> velocity;
  /// The newest published estimate, for PublishedStart; not valid if there is none.
  StateEstimate published;
  /// Velocity that the vehicle is expected to have, in B, m/s: used in the dark.
  std::optional<Eigen::Vector3d> expected_v_B;
  std::optional<ImageFrame> left;  ///< Empty if none has arrived.
  std::optional<ImageFrame> right;
};

/// Begins, and begins again, as VisionStart says. Equal options, start, seed and calls give
/// bit-identical estimates on one machine.
class VisionPipeline {
 public:
  /// Time by which the IMU samples must extend beyond an image, us: its stamp may be off by as
  /// much.
  static constexpr Utime kImuBeyondImage = 10'000;
  /// Time for which an image waits for them, us.
  static constexpr Utime kImuPatience = 60'000;
  /// Periods of the images after which there are none, and step() is called without.
  static constexpr double kMissedPeriods = 2.0;

  /// Demands options and a start that validate.
  VisionPipeline(const VisionOptions& options, const VisionStart& start, std::uint64_t seed);

  /// The estimate for the image of `input`, or the fault that there was none. For every input it is
  /// finite or has a fault.
  [[nodiscard]] VisionEstimate step(const VisionInput& input);

  /// Landmarks of the last image, in the filter's frame, which may differ from the published one.
  [[nodiscard]] std::span<const Landmark> landmarks() const { return filter_.landmarks(); }
  /// Pose of the last image by the filter's window, without velocity; its height is that by the
  /// depth sensor. Empty if there was no usable image, or the filter is not trusted.
  [[nodiscard]] std::optional<StateEstimate> at_image() const;
  /// Camera poses as calibrated by the filter, left first.
  [[nodiscard]] std::span<const Pose> cameras_B() const { return filter_.state().cameras_B; }
  /// The cameras with their intrinsics as estimated by the filter; their poses are cameras_B().
  [[nodiscard]] std::span<const CameraModel> models() const { return filter_.state().models; }
  [[nodiscard]] const FilterHealth& health() const { return filter_.health(); }
  /// Biases of the IMU as estimated while the filter was healthy, five to ten seconds ago; empty
  /// before.
  [[nodiscard]] std::optional<ImuBias> imu_bias() const { return memory_.proven_bias(); }
  /// The last image, and what was wrong with it, whatever the filter's fault.
  [[nodiscard]] const ImageQuality& image_quality() const { return image_quality_; }
  [[nodiscard]] VisionFault image_fault() const { return image_fault_; }
  /// Present if the last step began the filter again.
  [[nodiscard]] const std::optional<VisionRestart>& restarted() const { return restarted_; }

 private:
  void begin_if_needed(const VisionInput& input);
  [[nodiscard]] bool can_begin(const VisionInput& input) const;
  [[nodiscard]] std::optional<VisionRestart> reason_to_restart(bool has_image) const;
  void restart(const VisionInput& input);
  [[nodiscard]] std::optional<ImageStart::Speed> known_speed(const VisionInput& input) const;
  void expect_speed(const VisionInput& input);
  void add(const VisionInput& input);
  [[nodiscard]] ImageQuality track(const VisionInput& input);
  [[nodiscard]] std::optional<CameraTurn> turn_to(Utime utime) const;
  [[nodiscard]] VisionFault check_image(const ImageQuality& quality);
  [[nodiscard]] VisionFault check_filter(Utime now);
  void detect_tags(const ImageFrame& image, VisionEstimate& estimate);

  VisionOptions options_;
  bool is_published_;  ///< It begins from the published estimate.
  VisualInertialFilter filter_;
  Tracker tracker_;
  std::optional<TagDetector> tag_detector_;  ///< Present if there are tags.
  TagFix tag_fix_;
  Utime last_tag_detection_;
  RestartMemory memory_;
  std::vector<ImuSample> recent_;           ///< IMU samples for the rotation between images.
  std::optional<VelocitySample> velocity_;  ///< The newest.
  bool has_begun_ = false;
  double gap_s_ = 0.0;   ///< A long gap in the IMU samples; 0 without one.
  double dark_s_ = 0.0;  ///< Long darkness that has ended; 0 without.
  Utime init_utime_ = 0;
  Utime began_at_ = 0;
  double proof_s_ = 0.0;         ///< Time with images before the filter is accepted.
  Utime newest_ = 0;             ///< Time of the newest IMU sample.
  Utime last_image_ = 0;         ///< Time of the last usable image.
  std::optional<Utime> imaged_;  ///< Time of the last step's image, if used and accepted.
  Utime usable_since_ = 0;       ///< Start of the present run of usable images.
  Utime last_speed_update_ = 0;
  double sharpness_ = 0.0;  ///< Usual sharpness.
  ImageQuality image_quality_;
  VisionFault image_fault_ = VisionFault::kNoImages;
  std::optional<VisionRestart> restarted_;
};

}  // namespace dive::estimation
