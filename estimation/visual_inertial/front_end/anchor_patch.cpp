#include "estimation/visual_inertial/front_end/anchor_patch.h"

#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace dive::estimation {
namespace {

using Eigen::Matrix2f;
using Eigen::Vector2f;
using Vector6f = Eigen::Matrix<float, 6, 1>;
using Matrix6f = Eigen::Matrix<float, 6, 6>;

constexpr float kMiddle = 0.5F * (AnchorPatch::kSide - 1);
constexpr int kMaxSteps = 6;
constexpr float kConverged_px = 0.02F;
constexpr float kMaxShift_px = 3.0F;  // from the guess
// Regularisation of the shape, relative to the patch's information: a patch with one corner gives
// little.
constexpr float kRidge = 1e-2F;

float offset(int i) { return static_cast<float>(i) - kMiddle; }

std::size_t at(int x, int y) { return static_cast<std::size_t>(y * AnchorPatch::kSide + x); }

}  // namespace

bool AnchorPatch::sample(const GrayView& image, const PatchPlace& place, Samples& samples) {
  const Matrix2f& A = place.shape;
  const Vector2f corner = place.pixel + A * Vector2f(-kMiddle, -kMiddle);
  const float span = 2.0F * kMiddle;
  for (const float x : {0.0F, span}) {
    for (const float y : {0.0F, span}) {
      const Vector2f p = corner + A * Vector2f(x, y);
      if (!(p.x() >= 0.0F && p.y() >= 0.0F && p.x() < static_cast<float>(image.width - 1) &&
            p.y() < static_cast<float>(image.height - 1))) {
        return false;
      }
    }
  }
  const std::ptrdiff_t width = image.width;
  for (int y = 0; y < kSide; ++y) {
    const Vector2f begin = corner + static_cast<float>(y) * A.col(1);
    for (int x = 0; x < kSide; ++x) {
      const float u = begin.x() + static_cast<float>(x) * A(0, 0);
      const float v = begin.y() + static_cast<float>(x) * A(1, 0);
      // Not negative: truncation rounds down.
      const int column = static_cast<int>(u);
      const int row = static_cast<int>(v);
      const float fu = u - static_cast<float>(column);
      const float fv = v - static_cast<float>(row);
      const std::uint8_t* p = image.pixels + row * width + column;
      const float upper = static_cast<float>(p[0]) + fu * static_cast<float>(p[1] - p[0]);
      const float lower =
          static_cast<float>(p[width]) + fu * static_cast<float>(p[width + 1] - p[width]);
      samples[at(x, y)] = upper + fv * (lower - upper);
    }
  }
  return true;
}

bool AnchorPatch::normalise(Samples& samples) {
  constexpr float kMinNorm = 16.0F;  // norm of the deviation in grey levels
  Eigen::Map<Eigen::Array<float, kCount, 1>> values(samples.data());
  values -= values.mean();
  const float norm = values.matrix().norm();
  if (!(norm > kMinNorm)) return false;
  values /= norm;
  return true;
}

std::optional<AnchorPatch> AnchorPatch::cut(const GrayView& image, const Vector2f& pixel) {
  AnchorPatch anchor;
  if (!sample(image, {pixel}, anchor.patch_) || !normalise(anchor.patch_)) return std::nullopt;
  Matrix6f sum = Matrix6f::Zero();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      // Central differences; the rim has none.
      const bool is_rim = x == 0 || y == 0 || x == kSide - 1 || y == kSide - 1;
      float gx = 0.0F;
      float gy = 0.0F;
      if (!is_rim) {
        gx = 0.5F * (anchor.patch_[at(x + 1, y)] - anchor.patch_[at(x - 1, y)]);
        gy = 0.5F * (anchor.patch_[at(x, y + 1)] - anchor.patch_[at(x, y - 1)]);
      }
      anchor.by_x_[at(x, y)] = gx;
      anchor.by_y_[at(x, y)] = gy;
      Vector6f J;
      J << gx, gy, gx * offset(x), gy * offset(x), gx * offset(y), gy * offset(y);
      sum += J * J.transpose();
    }
  }
  sum.diagonal().tail<4>() *= 1.0F + kRidge;
  const Eigen::LLT<Matrix6f> llt(sum);
  if (llt.info() != Eigen::Success) return std::nullopt;
  anchor.inverse_ = llt.solve(Matrix6f::Identity());
  if (!anchor.inverse_.allFinite()) return std::nullopt;
  return anchor;
}

// I(t + A (x + d + D x)) ~ T(x): one step solves for d and D of the patch, which enter t and A
// inverted.
std::optional<PatchPlace> AnchorPatch::find(const GrayView& image, const PatchPlace& guess) const {
  PatchPlace place = guess;
  Samples now;
  for (int step = 0; step < kMaxSteps; ++step) {
    if (!sample(image, place, now) || !normalise(now)) return std::nullopt;
    Vector6f b = Vector6f::Zero();
    float correlation = 0.0F;
    for (int y = 0; y < kSide; ++y) {
      float along_x = 0.0F, along_y = 0.0F, bend_x = 0.0F, bend_y = 0.0F;
      for (int x = 0; x < kSide; ++x) {
        const std::size_t i = at(x, y);
        correlation += now[i] * patch_[i];
        const float r = now[i] - patch_[i];
        along_x += r * by_x_[i];
        along_y += r * by_y_[i];
        bend_x += r * by_x_[i] * offset(x);
        bend_y += r * by_y_[i] * offset(x);
      }
      const float dy = offset(y);
      b += (Vector6f() << along_x, along_y, bend_x, bend_y, along_x * dy, along_y * dy).finished();
    }
    place.correlation = correlation;
    const Vector6f d = inverse_ * b;
    Matrix2f bend = Matrix2f::Identity();
    bend.col(0) += d.segment<2>(2);
    bend.col(1) += d.segment<2>(4);
    const Matrix2f back = bend.inverse();
    const Vector2f shift = place.shape * (back * d.head<2>());
    place.shape = place.shape * back;
    place.pixel -= shift;
    if (!place.pixel.allFinite() || !place.shape.allFinite()) return std::nullopt;
    if ((place.pixel - guess.pixel).squaredNorm() > kMaxShift_px * kMaxShift_px) {
      return std::nullopt;
    }
    if (shift.squaredNorm() < kConverged_px * kConverged_px) return place;
  }
  return std::nullopt;
}

}  // namespace dive::estimation
