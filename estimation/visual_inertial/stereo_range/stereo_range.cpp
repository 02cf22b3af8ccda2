#include "estimation/visual_inertial/stereo_range/stereo_range.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"
#include "estimation/visual_inertial/stereo_range/disparity.h"
#include "estimation/visual_inertial/stereo_range/rectified_pair.h"

namespace dive::estimation {
namespace {

constexpr int kBlock = 9;  // pixels of the half-size image
constexpr int kEdge = 24;  // sixteenths of a pixel of the half-size image
constexpr std::array<std::array<int, 2>, 12> kAround{{{-5, 0},
                                                      {5, 0},
                                                      {0, -5},
                                                      {0, 5},
                                                      {-5, -5},
                                                      {5, -5},
                                                      {-5, 5},
                                                      {5, 5},
                                                      {-9, 0},
                                                      {9, 0},
                                                      {0, -9},
                                                      {0, 9}}};
constexpr int kFlatness = 31;          // limit of the Sobel gradients
constexpr int kLeftRight = 1;          // px of the half-size image
constexpr int kStep = 16;              // disparities come in multiples of it
constexpr Utime kTogether = 1000;      // us
constexpr double kSurelyBeyond = 2.0;  // sigma
constexpr double kTurned = 1e-3;       // rad, of both cameras in the body
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

cv::Mat as_mat(const ImageFrame& frame) {
  return {frame.height, frame.width, CV_8UC1, const_cast<std::uint8_t*>(frame.pixels.data())};
}

GrayView as_view(const cv::Mat& image) { return {image.data, image.cols, image.rows}; }

}  // namespace

std::string StereoRangeOptions::validate() const {
  RangeCheck check;
  check("columns", columns, 1, 1000);
  check("rows", rows, 1, 1000);
  check("rays", static_cast<double>(columns) * rows, 1, kMaxScanPoints);
  check("min_depth_m", min_depth_m, 0.05, 10);
  check("calibration_px", calibration_px, 0, 2);
  check("optimism", optimism, 0.1, 10);
  check("most_sigma_px", max_sigma_px, std::max(0.01, calibration_px), 2);
  check("trusted_share", trusted_share, 0.001, 0.5);
  check("max_reach_m", max_reach_m, 0.1, 1000);
  check("uniqueness_percent", uniqueness_percent, 0, 100);
  check("speckle_px", speckle_px, 0, 100'000);
  check("texture", texture, 0, 100'000);
  return check.problem();
}

struct StereoRange::Impl {
  Impl(StereoRangeOptions options_in, const RectifiedPair& pair_in, const CameraModel& left,
       const CameraModel& right)
      : options(options_in), pair(pair_in), cameras{left, right} {
    cv::setNumThreads(1);
    for (std::size_t i = 0; i < 2; ++i) map(seen_from(pair, cameras[i]), i);
    const double most = 0.5 * pair.f * pair.baseline_m / options.min_depth_m;
    disparities = kStep * std::max(1, static_cast<int>(std::ceil(most / kStep)));
    disparities = std::min(disparities, kStep * (pair.width / 2 / kStep));
    matcher = cv::StereoBM::create(disparities, kBlock);
    matcher->setPreFilterType(cv::StereoBM::PREFILTER_XSOBEL);
    matcher->setPreFilterCap(kFlatness);
    matcher->setTextureThreshold(options.texture);
    matcher->setUniquenessRatio(options.uniqueness_percent);
    matcher->setSpeckleWindowSize(options.speckle_px);
    matcher->setSpeckleRange(1);
    matcher->setDisp12MaxDiff(kLeftRight);
  }

  // Stores the maps for cv::remap, in its own fast format, and the pixels inside the field of view.
  void map(const std::vector<Eigen::Vector2f>& from, std::size_t camera) {
    cv::Mat xy(pair.height, pair.width, CV_32FC2);
    in_view[camera].create(pair.height, pair.width, CV_8UC1);
    for (int v = 0; v < pair.height; ++v) {
      for (int u = 0; u < pair.width; ++u) {
        const Eigen::Vector2f& p = from[static_cast<std::size_t>(v * pair.width + u)];
        const bool is_in_view = p.allFinite();
        in_view[camera].at<std::uint8_t>(v, u) = is_in_view ? 1 : 0;
        xy.at<cv::Vec2f>(v, u) = is_in_view ? cv::Vec2f(p.x(), p.y()) : cv::Vec2f(-10.0F, -10.0F);
      }
    }
    cv::convertMaps(xy, cv::noArray(), maps[camera], weights[camera], CV_16SC2);
  }

  [[nodiscard]] std::string question(const ImageFrame& left, const ImageFrame& right) const {
    for (const ImageFrame* frame : {&left, &right}) {
      if (frame->format != ImageFrame::Format::kGray8 || frame->width != pair.width ||
          frame->height != pair.height ||
          frame->pixels.size() !=
              static_cast<std::size_t>(pair.width) * static_cast<std::size_t>(pair.height)) {
        return fmt::format("an image of {} x {} pixels in {} bytes; the camera's are grey, {} x {}",
                           frame->width, frame->height, frame->pixels.size(), pair.width,
                           pair.height);
      }
    }
    if (std::abs(left.utime - right.utime) > kTogether) {
      return fmt::format("images taken at {} and {} us are no pair", left.utime, right.utime);
    }
    return {};
  }

  // Computes disparities of the half-size images, in sixteenths of a pixel. The border on the left
  // permits matches there with small disparities: StereoBM omits as many columns as it has
  // disparities.
  void match(const ImageFrame& left, const ImageFrame& right) {
    const std::array<cv::Mat, 2> taken{as_mat(left), as_mat(right)};
    for (std::size_t i = 0; i < 2; ++i) {
      cv::remap(taken[i], full[i], maps[i], weights[i], cv::INTER_LINEAR, cv::BORDER_CONSTANT);
      halve(as_view(full[i]), half[i]);
      const cv::Mat small(pair.height / 2, pair.width / 2, CV_8UC1, half[i].data());
      cv::copyMakeBorder(small, wide[i], 0, 0, disparities, 0, cv::BORDER_REPLICATE);
    }
    matcher->compute(wide[0], wide[1], coarse);
  }

  [[nodiscard]] bool sees_window(std::size_t camera, int u, int v) const {
    for (const int du : {-kDisparityWindowWidth / 2, kDisparityWindowWidth / 2 - 1}) {
      for (const int dv : {-(kDisparityWindowHeight / 2), kDisparityWindowHeight / 2}) {
        const int x = u + du;
        const int y = v + dv;
        if (x < 0 || y < 0 || x >= pair.width || y >= pair.height) return false;
        if (in_view[camera].at<std::uint8_t>(y, x) == 0) return false;
      }
    }
    return true;
  }

  // A block with the edge of a near object gives the background the object's disparity, too.
  [[nodiscard]] bool is_at_edge(int x, int y, int sixteenths) const {
    for (const auto& [dx, dy] : kAround) {
      const int x_there = x + dx;
      const int y_there = y + dy;
      if (x_there < 0 || y_there < 0 || x_there >= pair.width / 2 || y_there >= pair.height / 2) {
        continue;
      }
      const int there = coarse.at<std::int16_t>(y_there, x_there + disparities);
      if (there >= 0 && there < sixteenths - kEdge) return true;
    }
    return false;
  }

  [[nodiscard]] std::optional<Disparity> disparity(int u, int v) const {
    const int x = u / 2;
    const int y = v / 2;
    if (x >= pair.width / 2 || y >= pair.height / 2) return std::nullopt;
    const std::int16_t sixteenths = coarse.at<std::int16_t>(y, x + disparities);
    if (sixteenths < 0) return std::nullopt;
    if (is_at_edge(x, y, sixteenths)) return std::nullopt;
    const double start = sixteenths / 8.0;
    if (!sees_window(0, u, v) || !sees_window(1, u - static_cast<int>(start), v)) {
      return std::nullopt;
    }
    auto found = refine_disparity(as_view(full[0]), as_view(full[1]), u, v, start);
    if (!found) return std::nullopt;
    found->sigma_px = std::hypot(options.optimism * found->sigma_px, options.calibration_px);
    if (!(found->sigma_px <= options.max_sigma_px)) return std::nullopt;
    return found;
  }

  void measure(int u, int v, StereoScan& result) const {
    const auto found = disparity(u, v);
    // The window is one pixel wider to the left.
    const Eigen::Vector3d ray_B = pair.X_BV.q * pair.ray(u - 0.5, v);
    float sigma = kNaN;
    Eigen::Vector3f point = Eigen::Vector3f::Constant(kNaN);
    if (found) {
      const double fb = pair.f * pair.baseline_m;
      const double nearest = fb / (found->px + kSurelyBeyond * found->sigma_px) * ray_B.norm();
      const double range =
          found->px > 0.0 ? fb / found->px * ray_B.norm() : std::numeric_limits<double>::infinity();
      if (found->px + kSurelyBeyond * found->sigma_px <= 0.0 || nearest > reach) {
        point = (pair.X_BV.p + 2.0 * reach * ray_B.normalized()).cast<float>();
        sigma = std::numeric_limits<float>::infinity();
        ++result.beyond;
      } else if (range <= reach && fb / found->px >= options.min_depth_m) {
        point = (pair.X_BV.p + range * ray_B.normalized()).cast<float>();
        sigma = static_cast<float>(range * found->sigma_px / found->px);
        ++result.measured;
      }
    }
    result.scan.points_B.push_back(point);
    result.sigma_m.push_back(sigma);
  }

  [[nodiscard]] StereoScan measure(const ImageFrame& left, const ImageFrame& right) {
    match(left, right);
    StereoScan result;
    result.scan.utime = left.utime;
    result.scan.origin_B = pair.X_BV.p.cast<float>();
    result.scan.reach = static_cast<float>(reach);
    const auto rays = static_cast<std::size_t>(options.columns * options.rows);
    result.scan.points_B.reserve(rays);
    result.sigma_m.reserve(rays);
    for (int row = 0; row < options.rows; ++row) {
      for (int column = 0; column < options.columns; ++column) {
        measure((2 * column + 1) * pair.width / (2 * options.columns),
                (2 * row + 1) * pair.height / (2 * options.rows), result);
      }
    }
    return result;
  }

  StereoRangeOptions options;
  RectifiedPair pair;
  std::array<CameraModel, 2> cameras;
  double reach = 0.0;
  int disparities = 0;
  cv::Ptr<cv::StereoBM> matcher;
  std::array<cv::Mat, 2> maps;
  std::array<cv::Mat, 2> weights;
  std::array<cv::Mat, 2> in_view;
  // Results of the last pair.
  std::array<cv::Mat, 2> full;
  std::array<std::vector<std::uint8_t>, 2> half;
  std::array<cv::Mat, 2> wide;
  cv::Mat coarse;
};

StereoRange::StereoRange(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StereoRange::StereoRange(StereoRange&&) noexcept = default;
StereoRange& StereoRange::operator=(StereoRange&&) noexcept = default;
StereoRange::~StereoRange() = default;

tl::expected<StereoRange, std::string> StereoRange::create(StereoRangeOptions options,
                                                           const CameraModel& left,
                                                           const CameraModel& right) {
  DIVE_DEMAND(options.validate().empty());
  const auto pair = rectify(left, right);
  if (!pair) return tl::unexpected(pair.error());
  auto impl = std::make_unique<Impl>(options, *pair, left, right);
  const double most = options.max_sigma_px / (pair->f * pair->baseline_m);
  impl->reach = std::min(options.trusted_share / most, options.max_reach_m);
  return StereoRange(std::move(impl));
}

tl::expected<StereoScan, std::string> StereoRange::measure(const ImageFrame& left,
                                                           const ImageFrame& right) {
  if (std::string why = impl_->question(left, right); !why.empty()) {
    return tl::unexpected(std::move(why));
  }
  try {
    return impl_->measure(left, right);
  } catch (const std::exception& error) {
    return tl::unexpected(fmt::format("OpenCV: {}", error.what()));
  }
}

double StereoRange::reach() const { return impl_->reach; }

double StereoRange::noise_square() const {
  return impl_->options.max_sigma_px / (impl_->pair.f * impl_->pair.baseline_m);
}

bool StereoRange::fits(const CameraModel& left, const CameraModel& right) const {
  const auto pair = rectify(left, right);
  if (!pair || pair->width != impl_->pair.width || pair->height != impl_->pair.height) return false;
  const std::array<const CameraModel*, 2> others{&left, &right};
  constexpr int kSamples = 5;
  for (std::size_t camera = 0; camera < 2; ++camera) {
    for (int i = 0; i < kSamples * kSamples; ++i) {
      // Positions of the same ray by the maps of creation and by the new ones.
      const int row = i / kSamples;
      const double u = (i % kSamples + 0.5) / kSamples * pair->width;
      const double v = (row + 0.5) / kSamples * pair->height;
      const auto seen_by = [&](const CameraModel& model, const RectifiedPair& rectified) {
        const Eigen::Vector3d ray = impl_->pair.ray(u, v);
        return model.project(model.X_BC.q.conjugate() * (rectified.X_BV.q * ray));
      };
      const auto then = seen_by(impl_->cameras[camera], impl_->pair);
      const auto now = seen_by(*others[camera], *pair);
      if (then.has_value() != now.has_value()) return false;
      if (then && (*then - *now).norm() > 0.5 * impl_->options.calibration_px) return false;
    }
  }
  return std::abs(pair->baseline_m / impl_->pair.baseline_m - 1.0) < 0.01 &&
         angle_between(pair->X_BV.q, impl_->pair.X_BV.q) < kTurned;
}

}  // namespace dive::estimation
