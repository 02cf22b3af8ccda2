// ViSP's headers do not compile as C++20 (a constructor named with its template arguments): this
// file is compiled as C++17.
#include "estimation/visual_inertial/front_end/klt.h"

#include <cmath>
#include <exception>
#include <utility>

#include <opencv2/core.hpp>
#include <visp3/klt/vpKltOpencv.h>

#include "common/assert.h"

namespace dive::estimation {
namespace {

// OpenCV's headers take no const pixels; the result is only read.
cv::Mat as_mat(const GrayView& view) {
  return {view.height, view.width, CV_8UC1, const_cast<std::uint8_t*>(view.pixels)};
}

std::vector<cv::Point2f> as_points(const std::vector<Eigen::Vector2f>& points) {
  std::vector<cv::Point2f> result;
  result.reserve(points.size());
  for (const Eigen::Vector2f& p : points) result.emplace_back(p.x(), p.y());
  return result;
}

}  // namespace

struct Klt::Impl {
  vpKltOpencv tracker;
};

Klt::Klt(int window_px) : impl_(std::make_unique<Impl>()) {
  DIVE_DEMAND(window_px >= 8 && window_px <= 64 && window_px % 8 == 0);
  cv::setNumThreads(1);
  impl_->tracker.setWindowSize(window_px);
}
Klt::Klt(Klt&&) noexcept = default;
Klt& Klt::operator=(Klt&&) noexcept = default;
Klt::~Klt() = default;

tl::expected<std::vector<std::optional<Eigen::Vector2f>>, std::string> Klt::follow(
    const GrayView& from, const GrayView& to, const std::vector<Eigen::Vector2f>& points,
    const std::vector<Eigen::Vector2f>& guesses, int levels) {
  // OpenCV loops for ever on an image of zero size.
  DIVE_DEMAND(from.width > 0 && from.height > 0);
  DIVE_DEMAND(from.width == to.width && from.height == to.height);
  DIVE_DEMAND(points.size() == guesses.size() && levels >= 0 && levels <= 5);
  std::vector<std::optional<Eigen::Vector2f>> found(points.size());
  if (points.empty()) return found;  // ViSP throws
  // The index of a point is its id: the tracker omits lost points.
  std::vector<long> ids(points.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<long>(i);
  try {
    vpKltOpencv& tracker = impl_->tracker;
    const std::vector<cv::Point2f> start = as_points(points);
    tracker.setPyramidLevels(levels);
    tracker.initTracking(as_mat(from), start, ids);
    // The overload with the points: the other one guesses from the call before the last.
    tracker.setInitialGuess(start, as_points(guesses), ids);
    tracker.track(as_mat(to));
    const std::vector<cv::Point2f> tracked = tracker.getFeatures();
    const std::vector<long> kept = tracker.getFeaturesId();
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const cv::Point2f& p = tracked[k];
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      found[static_cast<std::size_t>(kept[k])] = Eigen::Vector2f(p.x, p.y);
    }
    return found;
  } catch (const std::exception& e) {  // includes vpException and cv::Exception
    return tl::make_unexpected(std::string(e.what()));
  }
}

}  // namespace dive::estimation
