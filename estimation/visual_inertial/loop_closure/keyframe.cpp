#include "estimation/visual_inertial/loop_closure/keyframe.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <tuple>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/equalised_image.h"
#include "estimation/visual_inertial/front_end/stereo.h"

namespace dive::estimation {
namespace {

constexpr int kWindow = 16;  // px, of KLT in stereo
constexpr int kColumns = 8;  // of a grid over which points are spread
constexpr int kRows = 5;
constexpr double kClearlyNearer = 0.85;  // best over second best
constexpr int kFarApart = 257;

// An equal number from each part of the image, the strongest of each first.
std::vector<cv::KeyPoint> spread(const std::vector<cv::KeyPoint>& all, int width, int height,
                                 int most) {
  std::vector<std::vector<const cv::KeyPoint*>> cells(std::size_t{kColumns} * kRows);
  for (const cv::KeyPoint& point : all) {
    const int column = std::clamp(static_cast<int>(point.pt.x) * kColumns / width, 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(point.pt.y) * kRows / height, 0, kRows - 1);
    cells[static_cast<std::size_t>(row * kColumns + column)].push_back(&point);
  }
  const auto clearer = [](const cv::KeyPoint* a, const cv::KeyPoint* b) {
    return std::tie(b->response, a->pt.x, a->pt.y) < std::tie(a->response, b->pt.x, b->pt.y);
  };
  std::vector<const cv::KeyPoint*> kept;
  const auto share = static_cast<std::size_t>(std::max(1, most / (kColumns * kRows)));
  for (auto& cell : cells) {
    std::sort(cell.begin(), cell.end(), clearer);
    kept.insert(kept.end(), cell.begin(),
                cell.begin() + static_cast<std::ptrdiff_t>(std::min(share, cell.size())));
  }
  std::sort(kept.begin(), kept.end(), clearer);
  std::vector<cv::KeyPoint> result;
  result.reserve(kept.size());
  for (const cv::KeyPoint* point : kept) result.push_back(*point);
  return result;
}

}  // namespace

int distance(const Descriptor& a, const Descriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) bits += std::popcount(a[i] ^ b[i]);
  return bits;
}

std::string KeyframeExtractorOptions::validate() const {
  RangeCheck check;
  check("max_points", max_points, 40, 5000);
  check("min_depth_m", min_depth_m, 0.01, 10);
  return check.problem();
}

struct KeyframeExtractor::Impl {
  Impl(KeyframeExtractorOptions options_in, const CameraModel& left_in, const CameraModel& right)
      : options(options_in),
        left(left_in),
        matcher({.min_depth_m = options_in.min_depth_m}, left_in, right, kWindow),
        orb(cv::ORB::create(3 * options_in.max_points)) {}

  [[nodiscard]] bool is_agreed(const ImageFrame& frame) const {
    return frame.format == ImageFrame::Format::kGray8 && frame.width == left.width &&
           frame.height == left.height &&
           frame.pixels.size() ==
               static_cast<std::size_t>(left.width) * static_cast<std::size_t>(left.height);
  }

  // Returns a library's exception as text, else empty.
  [[nodiscard]] static std::string set(EqualisedImage& image, const ImageFrame& frame) {
    (void)image.set(frame);
    return image.prepare();
  }

  [[nodiscard]] tl::expected<KeyframeView, std::string> view(const ImageFrame& left_frame,
                                                             const ImageFrame& right_frame) {
    if (std::string thrown = set(left_image, left_frame); !thrown.empty()) {
      return tl::make_unexpected(thrown);
    }
    if (std::string thrown = set(right_image, right_frame); !thrown.empty()) {
      return tl::make_unexpected(thrown);
    }
    // OpenCV's headers take no const pixels; the image is only read.
    const cv::Mat mat(left.height, left.width, CV_8UC1,
                      const_cast<std::uint8_t*>(left_image.full().pixels));
    std::vector<cv::KeyPoint> found;
    orb->detect(mat, found);
    found = spread(found, left.width, left.height, options.max_points);
    cv::Mat descriptors;
    orb->compute(mat, found, descriptors);
    KeyframeView result;
    result.utime = left_frame.utime;
    std::vector<StereoQuery> queries;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Eigen::Vector2f pixel(found[i].pt.x, found[i].pt.y);
      const auto n = left.undistort(pixel.cast<double>());
      if (!n) continue;
      KeyframePoint point;
      point.left = *n;
      std::memcpy(point.descriptor.data(), descriptors.ptr(static_cast<int>(i)),
                  sizeof(Descriptor));
      result.points.push_back(point);
      queries.push_back({pixel, *n});
    }
    const auto matches = matcher.match(left_image.both(), right_image.both(), queries);
    if (!matches) return tl::unexpected(matches.error());
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if ((*matches)[i]) result.points[i].right = (*matches)[i]->right;
    }
    return result;
  }

  KeyframeExtractorOptions options;
  CameraModel left;
  StereoMatcher matcher;
  EqualisedImage left_image{kWindow, StereoMatcher::kLevels};
  EqualisedImage right_image{kWindow, StereoMatcher::kLevels};
  cv::Ptr<cv::ORB> orb;
};

KeyframeExtractor::KeyframeExtractor(KeyframeExtractorOptions options, const CameraModel& left,
                                     const CameraModel& right) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(options, left, right);
}
KeyframeExtractor::KeyframeExtractor(KeyframeExtractor&&) noexcept = default;
KeyframeExtractor& KeyframeExtractor::operator=(KeyframeExtractor&&) noexcept = default;
KeyframeExtractor::~KeyframeExtractor() = default;

tl::expected<KeyframeView, std::string> KeyframeExtractor::view(const ImageFrame& left,
                                                                const ImageFrame& right) {
  for (const ImageFrame* frame : {&left, &right}) {
    if (!impl_->is_agreed(*frame)) {
      return tl::unexpected(
          fmt::format("an image of {} x {} pixels; the camera's are grey, {} x {}", frame->width,
                      frame->height, impl_->left.width, impl_->left.height));
    }
  }
  try {
    return impl_->view(left, right);
  } catch (const std::exception& error) {
    return tl::unexpected(fmt::format("OpenCV: {}", error.what()));
  }
}

std::vector<std::pair<std::size_t, std::size_t>> match(const KeyframeView& a, const KeyframeView& b,
                                                       int most) {
  struct Best {
    int first = kFarApart;
    int second = kFarApart;
    std::size_t index = 0;
    void offer(int bits, std::size_t other) {
      if (bits < first) {
        second = first;
        first = bits;
        index = other;
      } else {
        second = std::min(second, bits);
      }
    }
    [[nodiscard]] bool is_clear(int limit) const {
      return first <= limit && first < kClearlyNearer * second;
    }
  };
  std::vector<Best> of_a(a.points.size());
  std::vector<Best> of_b(b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    for (std::size_t j = 0; j < b.points.size(); ++j) {
      const int bits = distance(a.points[i].descriptor, b.points[j].descriptor);
      of_a[i].offer(bits, j);
      of_b[j].offer(bits, i);
    }
  }
  std::vector<std::pair<std::size_t, std::size_t>> matches;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].is_clear(most)) continue;
    const std::size_t j = of_a[i].index;
    if (of_b[j].index == i && of_b[j].is_clear(most)) matches.emplace_back(i, j);
  }
  return matches;
}

int likeness(const KeyframeView& a, const KeyframeView& b, std::size_t first, int most) {
  int count = 0;
  for (std::size_t i = 0; i < std::min(first, a.points.size()); ++i) {
    count += std::any_of(b.points.begin(), b.points.end(),
                         [&](const KeyframePoint& other) {
                           return distance(a.points[i].descriptor, other.descriptor) <= most;
                         })
                 ? 1
                 : 0;
  }
  return count;
}

}  // namespace dive::estimation
