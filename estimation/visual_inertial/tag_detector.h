#pragma once
// AprilTags of family 36h11 in a grey picture (Wang and Olson 2016, "AprilTag 2: efficient and
// robust fiducial detection", IROS; the library is theirs). Its worst case is bounded by the number
// of pixels; whoever calls it decides on how many pictures.

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/camera_model.h"
#include "common/measurements.h"
#include "common/se3.h"

namespace dive::estimation {

struct TagDetectorOptions {
  double shortest_edge_px = 14.0;  ///< Smaller tags are left out: their corners are not sharp.
  double border_px = 3.0;          ///< As are those nearer to the edge of the picture.
  int most_wrong_bits = 1;         ///< Of 36; two tags differ in at least eleven.
  double least_margin = 10.0;      ///< Grey levels between what is read as black and as white.
};

struct SeenTag {
  int id = 0;
  /// Where tag_corners() are seen, normalised, without distortion.
  std::array<Eigen::Vector2d, 4> corners;
};

class TagDetector {
 public:
  /// Demands a camera that validates.
  TagDetector(const CameraModel& camera, const TagDetectorOptions& options);
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  /// All that can be read, by id; one id may come twice. Nothing where the picture is not one of
  /// this camera. Deterministic.
  [[nodiscard]] std::vector<SeenTag> find(const ImageFrame& picture);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct TagPose {
  Pose X_CT;
  double error = 0.0;  ///< Of the corners, RMS, normalised.
};

/// Where such a tag could be, the likelier place first. From afar a square that leans to one side
/// looks like one that leans to the other, so that there are two (Collins and Bartoli 2014,
/// "Infinitesimal plane-based pose estimation"; OpenCV). None where the corners are no square's.
[[nodiscard]] std::vector<TagPose> tag_poses(const SeenTag& seen, double size_m);

}  // namespace dive::estimation
