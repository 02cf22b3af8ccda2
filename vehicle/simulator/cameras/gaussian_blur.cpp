#include "vehicle/simulator/cameras/gaussian_blur.h"

#include <algorithm>
#include <cmath>

#include "vehicle/simulator/ray_tracing/ray_batch.h"

namespace dive::vehicle {
namespace {

DIVE_VECTOR_LOOP void scaled(const float* in, float weight, int count, float* out) {
  for (int i = 0; i < count; ++i) out[i] = weight * in[i];
}

DIVE_VECTOR_LOOP void add_pair(const float* a, const float* b, float weight, int count,
                               float* out) {
  for (int i = 0; i < count; ++i) out[i] += weight * (a[i] + b[i]);
}

}  // namespace

GaussianBlur::GaussianBlur(int width, int height, double sigma)
    : width_(width), height_(height), radius_(static_cast<int>(std::ceil(2.5 * sigma))) {
  double sum = 0.0;
  for (int k = 0; k <= radius_; ++k) {
    const double weight = k == 0 ? 1.0 : std::exp(-0.5 * k * k / (sigma * sigma));
    weights_.push_back(static_cast<float>(weight));
    sum += k == 0 ? weight : 2.0 * weight;
  }
  for (float& weight : weights_) weight = static_cast<float>(weight / sum);
  const auto size = static_cast<std::size_t>(width * height);
  row_.resize(static_cast<std::size_t>(width + 2 * radius_));
  across_.resize(size);
  result_.resize(size);
}

const std::vector<float>& GaussianBlur::operator()(const std::vector<float>& image) {
  const auto row_of = [this](auto& all, int row) {
    return all.data() + static_cast<std::ptrdiff_t>(std::clamp(row, 0, height_ - 1)) * width_;
  };
  for (int row = 0; row < height_; ++row) {
    const float* const in = row_of(image, row);
    std::fill_n(row_.begin(), radius_, in[0]);
    std::copy_n(in, width_, row_.begin() + radius_);
    std::fill_n(row_.end() - radius_, radius_, in[width_ - 1]);
    const float* const middle = row_.data() + radius_;
    scaled(middle, weights_[0], width_, row_of(across_, row));
    for (int k = 1; k <= radius_; ++k) {
      add_pair(middle - k, middle + k, weights_[static_cast<std::size_t>(k)], width_,
               row_of(across_, row));
    }
  }
  for (int row = 0; row < height_; ++row) {
    scaled(row_of(across_, row), weights_[0], width_, row_of(result_, row));
    for (int k = 1; k <= radius_; ++k) {
      add_pair(row_of(across_, row - k), row_of(across_, row + k),
               weights_[static_cast<std::size_t>(k)], width_, row_of(result_, row));
    }
  }
  return result_;
}

}  // namespace dive::vehicle
