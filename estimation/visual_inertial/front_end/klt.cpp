// ViSP's headers do not compile as C++20 (a constructor named with its template arguments): this
// file is compiled as C++17.
#include "estimation/visual_inertial/front_end/klt.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
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

struct KltImage::Impl {
  int window_px;
  int levels;
  cv::Size size;
  std::vector<cv::Mat> pyramid;  // of each level the image and its gradients
};

KltImage::KltImage(int window_px, int levels)
    : impl_(std::make_unique<Impl>(Impl{window_px, levels, {}, {}})) {
  DIVE_DEMAND(levels >= 0 && levels <= 5);
}
KltImage::KltImage(KltImage&&) noexcept = default;
KltImage& KltImage::operator=(KltImage&&) noexcept = default;
KltImage::~KltImage() = default;

std::string KltImage::set(const GrayView& image) {
  // OpenCV loops for ever on an image of zero size.
  DIVE_DEMAND(image.width > 0 && image.height > 0);
  try {
    const cv::Mat mat = as_mat(image);
    impl_->size = mat.size();
    // Without a copy the pyramid would refer to the caller's pixels.
    constexpr bool kWithGradients = true;
    constexpr bool kMayReferToImage = false;
    cv::buildOpticalFlowPyramid(mat, impl_->pyramid, {impl_->window_px, impl_->window_px},
                                impl_->levels, kWithGradients, cv::BORDER_REFLECT_101,
                                cv::BORDER_CONSTANT, kMayReferToImage);
  } catch (const std::exception& e) {
    impl_->pyramid.clear();
    return e.what();
  }
  return {};
}

namespace {

// ViSP's tracker for pyramids that exist: its own track() makes both again.
class PyramidTracker : public vpKltOpencv {
 public:
  void track_between(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to) {
    std::vector<std::uint8_t> is_found;
    std::vector<float> errors;
    cv::calcOpticalFlowPyrLK(from, to, m_points[0], m_points[1], is_found, errors,
                             {m_winSize, m_winSize}, m_pyrMaxLevel, m_termcrit,
                             cv::OPTFLOW_USE_INITIAL_FLOW, m_minEigThreshold);
    m_initial_guess = false;
    for (std::size_t i = is_found.size(); i-- > 0;) {
      if (is_found[i] != 0) continue;
      const auto at = static_cast<std::ptrdiff_t>(i);
      m_points[0].erase(m_points[0].begin() + at);
      m_points[1].erase(m_points[1].begin() + at);
      m_points_id.erase(m_points_id.begin() + at);
    }
  }
};

}  // namespace

struct Klt::Impl {
  PyramidTracker tracker;
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
    const KltImage& from, const KltImage& to, const std::vector<Eigen::Vector2f>& points,
    const std::vector<Eigen::Vector2f>& guesses, int levels) {
  const KltImage::Impl& before = *from.impl_;
  const KltImage::Impl& after = *to.impl_;
  DIVE_DEMAND(before.size == after.size && before.window_px == after.window_px &&
              before.window_px == impl_->tracker.getWindowSize());
  DIVE_DEMAND(points.size() == guesses.size() && levels >= 0 &&
              levels <= std::min(before.levels, after.levels));
  std::vector<std::optional<Eigen::Vector2f>> found(points.size());
  if (points.empty()) return found;
  DIVE_DEMAND(!before.pyramid.empty() && !after.pyramid.empty());
  // The index of a point is its id: the tracker omits lost points.
  std::vector<long> ids(points.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<long>(i);
  try {
    PyramidTracker& tracker = impl_->tracker;
    tracker.setPyramidLevels(levels);
    tracker.setInitialGuess(as_points(points), as_points(guesses), ids);
    tracker.track_between(before.pyramid, after.pyramid);
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
