#pragma once
// AprilTags of family 36h11 in a grey image (Wang and Olson 2016, "AprilTag 2: efficient and robust
// fiducial detection", IROS; the library is theirs). The number of pixels bounds its worst case;
// the caller chooses the images.

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/se3.h"

namespace dive::estimation {

struct TagDetectorOptions {
  double shortest_edge_px = 14.0;  ///< Minimum edge of a tag: smaller ones have unsharp corners.
  double border_px = 3.0;          ///< Minimum distance of a tag from the image's edge.
  int max_wrong_bits = 1;          ///< Maximum of 36 bits; two tags differ in at least eleven.
  double min_margin = 10.0;        ///< Minimum grey-level difference of black and white.
};

struct DetectedTag {
  int id = 0;
  /// Positions of tag_corners(), normalised, without distortion.
  std::array<Eigen::Vector2d, 4> corners;
};

class TagDetector {
 public:
  /// Demands a camera that validates.
  TagDetector(const CameraModel& camera, const TagDetectorOptions& options);
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  /// All readable tags by id; an id may occur twice. Empty if the image does not belong to this
  /// camera. Deterministic.
  [[nodiscard]] std::vector<DetectedTag> find(const ImageFrame& image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct TagPose {
  Pose X_CT;
  double error = 0.0;  ///< RMS error of the corners, normalised.
};

/// Possible poses of such a tag, the likelier first. From afar a square tilted to one side looks
/// like one tilted to the other, so that there are two (Collins and Bartoli 2014, "Infinitesimal
/// plane-based pose estimation"; OpenCV). Empty if the corners are not a square's.
[[nodiscard]] std::vector<TagPose> tag_poses(const DetectedTag& detected, double size_m);

}  // namespace dive::estimation
