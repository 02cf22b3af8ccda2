#pragma once
// A recording's images and samples in the order of time, as they reach the estimators in a dive.

#include <optional>
#include <string>
#include <vector>

#include "estimation/dataset/recording.h"
#include "estimation/visual_inertial/pipeline/vision_pipeline.h"

namespace dive::estimation {

struct FeedOptions {
  Utime begin = 0;             ///< Earlier images and samples are left out.
  bool use_depth = true;       ///< Depth samples are fed.
  double depth_datum_m = 0.0;  ///< Taken from every depth.
  bool read_images = true;     ///< Images are read; otherwise only their times matter.
  bool mono = false;           ///< Only the left camera.
};

/// All that has arrived since the last step.
struct FeedStep {
  VisionInput input;
  bool has_image = false;  ///< The image may not have been read. False between images far apart.
  std::size_t image = 0;   ///< Index of the image, or of the next one.
  Utime image_utime = 0;   ///< Its time.
  /// Why the image, or the right one, could not be read; empty if it was, or should not be.
  std::string left_error;
  std::string right_error;
};

class RecordingFeed {
 public:
  /// Keeps a reference to the recording.
  RecordingFeed(const Recording& recording, const FeedOptions& options);

  /// Median time between two images, s.
  [[nodiscard]] double period_s() const { return period_s_; }
  /// Index of the first image that is fed; their number if none is.
  [[nodiscard]] std::size_t first_image() const { return first_image_; }
  /// The next step, one per image, with the IMU samples up to 10 ms beyond it; empty at the end.
  [[nodiscard]] std::optional<FeedStep> next();

 private:
  void add_samples(VisionInput& input);
  [[nodiscard]] Utime last_sample_of(Utime image) const;
  [[nodiscard]] Utime next_missed(Utime image) const;
  void read(const RecordedImage& image, FeedStep& step) const;

  const Recording& recording_;
  FeedOptions options_;
  double period_s_ = 0.05;
  Utime last_ = 0;  ///< Time of the last step; 0 before the first.
  std::size_t first_image_ = 0;
  std::size_t image_ = 0;
  std::size_t imu_ = 0;
  std::size_t depth_ = 0;
  std::size_t velocity_ = 0;
};

}  // namespace dive::estimation
