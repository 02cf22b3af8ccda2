#include "estimation/visual_inertial/tags/tag_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <opencv2/calib3d.hpp>

#include "common/assert.h"
#include "common/tag.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float kDecimation = 1.0F;  // tags are few pixels wide: all of them are needed
constexpr double kSharpening = 0.25;

// The library's origin is the corner of the first pixel, and its first corner the bottom left one.
constexpr double kHalfPixel = 0.5;
constexpr std::array<std::size_t, 4> kTheirs{3, 2, 1, 0};

struct FamilyDeleter {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};
struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct DetectionsDeleter {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};

double shortest_edge(const std::array<Vector2d, 4>& pixels) {
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 4; ++i) {
    shortest = std::min(shortest, (pixels[(i + 1) % 4] - pixels[i]).norm());
  }
  return shortest;
}

}  // namespace

struct TagDetector::Impl {
  Impl(const CameraModel& camera_, const TagDetectorOptions& options_)
      : camera(camera_),
        options(options_),
        family(tag36h11_create()),
        detector(apriltag_detector_create()) {
    DIVE_DEMAND(camera.validate().empty() && family && detector);
    apriltag_detector_add_family_bits(detector.get(), family.get(), options.max_wrong_bits);
    detector->nthreads = 1;
    detector->quad_decimate = kDecimation;
    detector->decode_sharpening = kSharpening;
  }

  [[nodiscard]] std::optional<DetectedTag> taken(const apriltag_detection_t& found) const {
    if (found.hamming > options.max_wrong_bits) return std::nullopt;
    if (!(static_cast<double>(found.decision_margin) >= options.min_margin)) return std::nullopt;
    DetectedTag detected;
    detected.id = found.id;
    std::array<Vector2d, 4> pixels;
    for (std::size_t i = 0; i < 4; ++i) {
      const double* const p = found.p[kTheirs[i]];
      pixels[i] = Vector2d(p[0], p[1]).array() - kHalfPixel;
      const std::optional<Vector2d> straight = camera.undistort(pixels[i]);
      if (!straight || !camera.in_image(pixels[i], options.border_px)) return std::nullopt;
      detected.corners[i] = *straight;
    }
    if (shortest_edge(pixels) < options.shortest_edge_px) return std::nullopt;
    return detected;
  }

  CameraModel camera;
  TagDetectorOptions options;
  std::unique_ptr<apriltag_family_t, FamilyDeleter> family;
  std::unique_ptr<apriltag_detector_t, DetectorDeleter> detector;  // released before the family
};

TagDetector::TagDetector(const CameraModel& camera, const TagDetectorOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;
TagDetector::~TagDetector() = default;

std::vector<DetectedTag> TagDetector::find(const ImageFrame& image) {
  const CameraModel& camera = impl_->camera;
  const bool is_as_agreed =
      image.format == ImageFrame::Format::kGray8 && image.width == camera.width &&
      image.height == camera.height &&
      image.pixels.size() == static_cast<std::size_t>(camera.width * camera.height);
  if (!is_as_agreed) return {};
  // The library only reads it.
  image_u8_t gray{image.width, image.height, image.width,
                  const_cast<std::uint8_t*>(image.pixels.data())};
  const std::unique_ptr<zarray_t, DetectionsDeleter> found(
      apriltag_detector_detect(impl_->detector.get(), &gray));
  std::vector<DetectedTag> result;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&detection));
    if (const auto detected = impl_->taken(*detection)) result.push_back(*detected);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const DetectedTag& a, const DetectedTag& b) { return a.id < b.id; });
  return result;
}

std::vector<TagPose> tag_poses(const DetectedTag& detected, double size_m) {
  // OpenCV's y points up and z to the viewer: a half turn about x.
  std::vector<cv::Point3d> corners_O;
  std::vector<cv::Point2d> image;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d corner = tag_corners(size_m)[i];
    corners_O.emplace_back(corner.x(), -corner.y(), 0.0);
    image.emplace_back(detected.corners[i].x(), detected.corners[i].y());
  }
  std::vector<TagPose> poses;
  try {
    std::vector<cv::Mat> turns;
    std::vector<cv::Mat> places;
    std::vector<double> errors;
    cv::solvePnPGeneric(corners_O, image, cv::Matx33d::eye(), cv::noArray(), turns, places, false,
                        cv::SOLVEPNP_IPPE_SQUARE, cv::noArray(), cv::noArray(), errors);
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const Vector3d turn(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
      const Vector3d p(places[i].at<double>(0), places[i].at<double>(1), places[i].at<double>(2));
      const Eigen::Quaterniond q_OT(0.0, 1.0, 0.0, 0.0);
      const TagPose pose{{p, (so3_exp(turn) * q_OT).normalized()}, errors.at(i)};
      const bool is_before = pose.X_CT.is_finite() && p.z() > 0.0;
      if (is_before && std::isfinite(pose.error)) poses.push_back(pose);
    }
  } catch (const cv::Exception&) {
    return {};
  }
  return poses;
}

}  // namespace dive::estimation
