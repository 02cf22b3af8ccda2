#include "estimation/dataset/camera_check.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "estimation/visual_inertial/front_end/stereo.h"
#include "estimation/visual_inertial/front_end/tracker.h"

namespace dive::estimation {
namespace {

Diagnostic calibration_error(const RecordedCamera& camera, std::string message, std::string hint) {
  Diagnostic diagnostic;
  diagnostic.code = "CAMERA";
  diagnostic.file = camera.calibration_file;
  diagnostic.span.line = camera.resolution_line;
  diagnostic.message = std::move(message);
  diagnostic.hint = std::move(hint);
  return diagnostic;
}

struct ReadImage {
  std::size_t index = 0;
  ImageFrame image;
};

// The error is that of the first image.
tl::expected<ReadImage, std::string> first_readable(const RecordedCamera& camera, int index) {
  std::string error;
  for (std::size_t i = 0; i < camera.images.size(); ++i) {
    auto image = read_image(camera.images[i], index);
    if (image) return ReadImage{i, std::move(*image)};
    if (i == 0) error = image.error();
  }
  return tl::make_unexpected(error);
}

void check_camera(const RecordedCamera& camera, int index, Diagnostics& diagnostics) {
  const CameraModel& model = camera.model;
  if (std::min(model.width, model.height) < Tracker::kMinSide_px) {
    const std::string message =
        fmt::format("images of {} x {} pixels; the estimator needs at least {} x {}", model.width,
                    model.height, Tracker::kMinSide_px, Tracker::kMinSide_px);
    diagnostics.add(calibration_error(camera, message, ""));
    return;
  }
  const auto first = first_readable(camera, index);
  if (!first) {
    diagnostics.add(camera.images_origin.at(
        0, Severity::kError, "IMAGE",
        fmt::format("{}; none of the {} images can be read", first.error(), camera.images.size()),
        index == 0 ? "" : "use the left camera only: --mono"));
    return;
  }
  const auto& [at, image] = *first;
  if (image.width == model.width && image.height == model.height) return;
  diagnostics.add(camera.images_origin.at(
      at, Severity::kError, "IMAGE-SIZE",
      fmt::format("{}: an image of {} x {} pixels; {}:{} states {} x {}", camera.images[at].path,
                  image.width, image.height, camera.calibration_file, camera.resolution_line,
                  model.width, model.height),
      "calibrate the camera for images of the size that was recorded"));
}

void check_pair(const RecordedCamera& left, const RecordedCamera& right, Diagnostics& diagnostics) {
  const char* const hint = "correct the calibration, or use the left camera only: --mono";
  if (left.model.width != right.model.width || left.model.height != right.model.height) {
    const std::string message =
        fmt::format("the right camera's images have {} x {} pixels, the left one's {} x {}",
                    right.model.width, right.model.height, left.model.width, left.model.height);
    diagnostics.add(calibration_error(right, message, hint));
  }
  const double baseline_m = (left.model.X_BC.p - right.model.X_BC.p).norm();
  if (!(baseline_m > StereoMatcher::kMinBaseline_m)) {
    const std::string message = fmt::format(
        "the right camera is {:g} m from the left one; the two of a pair are more "
        "than {:g} m apart",
        baseline_m, StereoMatcher::kMinBaseline_m);
    diagnostics.add(calibration_error(right, message, hint));
  }
}

void check_together(const std::vector<RecordedImage>& left, const RecordedCamera& right,
                    Diagnostics& diagnostics) {
  const auto pairs =
      static_cast<std::size_t>(std::count_if(left.begin(), left.end(), [&](const auto& image) {
        return image_at(right.images, image.utime) != nullptr;
      }));
  if (pairs == left.size()) return;
  diagnostics.add(right.images_origin.of_all(
      Severity::kWarning, "NO-PAIR",
      fmt::format("{} of {} left images have no right one within a millisecond, and are used alone",
                  left.size() - pairs, left.size()),
      ""));
}

}  // namespace

void check_cameras(Recording& recording, std::size_t most) {
  Diagnostics& diagnostics = recording.diagnostics;
  const std::vector<RecordedCamera>& cameras = recording.cameras;
  const std::size_t used = std::min(most, cameras.size());
  for (std::size_t i = 0; i < used; ++i) check_camera(cameras[i], static_cast<int>(i), diagnostics);
  if (used < 2) return;
  check_pair(cameras[0], cameras[1], diagnostics);
  check_together(cameras[0].images, cameras[1], diagnostics);
}

}  // namespace dive::estimation
