#include "estimation/visual_inertial/front_end/corners.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "common/assert.h"

namespace dive::estimation {
namespace {

constexpr int kBlock = 5;   // pixels of the half-size image per corner
constexpr int kMargin = 4;  // of those around a cell, for block and gradient

// OpenCV's units: gradients are twice the grey levels per pixel, divided by 255.
float least_eigenvalue(double gradient) {
  const double g = 2.0 * gradient / 255.0;
  return static_cast<float>(g * g);
}

}  // namespace

CornerGrid::CornerGrid(CornerOptions options, int width, int height, int max_features,
                       int border_px)
    : options_(options), width_(width), height_(height), border_(border_px) {
  DIVE_DEMAND(width > 4 * border_px && height > 4 * border_px && max_features >= kPerCell);
  const double side = std::sqrt(static_cast<double>(width) * height * kPerCell / max_features);
  columns_ = std::max(1, static_cast<int>(std::lround(width / side)));
  rows_ = std::max(1, static_cast<int>(std::lround(height / side)));
}

int CornerGrid::cell_of(const Eigen::Vector2f& pixel) const {
  const int column = static_cast<int>(pixel.x()) * columns_ / width_;
  const int row = static_cast<int>(pixel.y()) * rows_ / height_;
  return std::clamp(row, 0, rows_ - 1) * columns_ + std::clamp(column, 0, columns_ - 1);
}

void CornerGrid::find_in(const GrayView& half, int cell, int count,
                         std::vector<Eigen::Vector2f>& all) const {
  const auto edge = [](int i, int n, int size, int border) {
    return std::clamp(i * size / n, border, size - border) / 2;
  };
  const int column = cell % columns_;
  const int row = cell / columns_;
  const cv::Rect inner(
      cv::Point(edge(column, columns_, width_, border_), edge(row, rows_, height_, border_)),
      cv::Point(edge(column + 1, columns_, width_, border_),
                edge(row + 1, rows_, height_, border_)));
  const cv::Mat image(half.height, half.width, CV_8UC1, const_cast<std::uint8_t*>(half.pixels));
  const cv::Rect outer = cv::Rect(inner.x - kMargin, inner.y - kMargin, inner.width + 2 * kMargin,
                                  inner.height + 2 * kMargin) &
                         cv::Rect(0, 0, half.width, half.height);
  cv::Mat quality;
  cv::cornerMinEigenVal(image(outer), quality, kBlock);
  cv::Mat cell_quality = quality(inner - outer.tl());

  const int distance = static_cast<int>(std::lround(0.5 * options_.min_distance_px));
  const auto take_out = [&](const Eigen::Vector2f& pixel) {
    const Eigen::Vector2f p = 0.5F * (pixel - Eigen::Vector2f(0.5F, 0.5F));
    const cv::Point middle(static_cast<int>(std::lround(p.x())) - inner.x,
                           static_cast<int>(std::lround(p.y())) - inner.y);
    cv::circle(cell_quality, middle, distance, cv::Scalar(0.0), cv::FILLED);
  };
  const float reach = static_cast<float>(2 * distance + 2);
  for (const Eigen::Vector2f& pixel : all) {
    if (pixel.x() > 2.0F * static_cast<float>(inner.x) - reach &&
        pixel.x() < 2.0F * static_cast<float>(inner.br().x) + reach &&
        pixel.y() > 2.0F * static_cast<float>(inner.y) - reach &&
        pixel.y() < 2.0F * static_cast<float>(inner.br().y) + reach) {
      take_out(pixel);
    }
  }
  const float least = least_eigenvalue(options_.min_gradient);
  for (int k = 0; k < count; ++k) {
    double best = 0.0;
    cv::Point at;
    cv::minMaxLoc(cell_quality, nullptr, &best, nullptr, &at);
    if (best < static_cast<double>(least)) return;
    all.emplace_back(static_cast<float>(2 * (inner.x + at.x)) + 0.5F,
                     static_cast<float>(2 * (inner.y + at.y)) + 0.5F);
    take_out(all.back());
  }
}

tl::expected<std::vector<Eigen::Vector2f>, std::string> CornerGrid::find(
    const GrayView& half, const std::vector<Eigen::Vector2f>& taken, int wanted, int max_cells) {
  DIVE_DEMAND(half.width == width_ / 2 && half.height == height_ / 2);
  std::vector<int> occupied(static_cast<std::size_t>(cells()), 0);
  for (const Eigen::Vector2f& pixel : taken) ++occupied[static_cast<std::size_t>(cell_of(pixel))];

  std::vector<Eigen::Vector2f> all = taken;
  try {
    int tried = 0;
    const int begin = next_;
    for (int k = 0; k < cells() && tried < max_cells; ++k) {
      const int left = wanted - static_cast<int>(all.size() - taken.size());
      if (left <= 0) break;
      const int cell = (begin + k) % cells();
      next_ = (cell + 1) % cells();
      const int free = kPerCell - occupied[static_cast<std::size_t>(cell)];
      if (free <= 0) continue;
      ++tried;
      find_in(half, cell, std::min(free, left), all);
    }
  } catch (const cv::Exception& e) {
    return tl::make_unexpected(std::string(e.what()));
  }
  all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(taken.size()));
  return all;
}

}  // namespace dive::estimation
