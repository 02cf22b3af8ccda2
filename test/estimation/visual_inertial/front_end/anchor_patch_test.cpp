// The first patch of a feature, located in images painted from one smooth function.

#include "estimation/visual_inertial/front_end/anchor_patch.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace dive::estimation {
namespace {

using Eigen::Matrix2f;
using Eigen::Vector2f;

constexpr int kWidth = 120;
constexpr int kHeight = 100;

double paint(double x, double y) {
  return 128.0 + 40.0 * std::sin(0.55 * x + 0.2 * std::sin(0.3 * y)) +
         35.0 * std::sin(0.47 * y - 0.21 * x) + 15.0 * std::sin(0.9 * x + 0.7 * y);
}

struct Painting {
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayView view() const { return {pixels.data(), kWidth, kHeight}; }
};

// The pixel at t + A x has the paint of `middle` + x, `gain` times as bright, plus `more`.
Painting painting(const Vector2f& middle, const Vector2f& t, const Matrix2f& A, double gain = 1.0,
                  double more = 0.0) {
  Painting result;
  const Matrix2f back = A.inverse();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vector2f at =
          middle + back * (Vector2f(static_cast<float>(x), static_cast<float>(y)) - t);
      const double grey =
          gain * paint(static_cast<double>(at.x()), static_cast<double>(at.y())) + more;
      result.pixels.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))));
    }
  }
  return result;
}

const Vector2f kMiddle(60.3F, 50.6F);
const Painting& first() {
  static const Painting image = painting(kMiddle, kMiddle, Matrix2f::Identity());
  return image;
}

TEST(AnchorPatch, IsFoundBentMovedAndInOtherLight) {
  const auto anchor = AnchorPatch::cut(first().view(), kMiddle);
  ASSERT_TRUE(anchor);
  Matrix2f grown_and_turned;
  grown_and_turned << 1.3F, -0.3F, 0.35F, 1.1F;
  Matrix2f foreshortened;
  foreshortened << 1.0F, 0.1F, 0.0F, 0.75F;
  for (const Matrix2f& A : {Matrix2f(Matrix2f::Identity()), grown_and_turned, foreshortened}) {
    const Vector2f t(55.7F, 47.2F);
    const Painting now = painting(kMiddle, t, A, 0.6, 30.0);
    // Nearly the guess from the previous image.
    Matrix2f nearly = A;
    nearly(0, 0) *= 0.97F;
    nearly(1, 0) += 0.02F;
    const auto found = anchor->find(now.view(), {t + Vector2f(0.7F, -0.5F), nearly});
    ASSERT_TRUE(found) << A;
    EXPECT_LT((found->pixel - t).norm(), 0.05F) << A;
    EXPECT_LT((found->shape - A).norm(), 0.06F) << found->shape;
    EXPECT_GT(found->correlation, 0.98F);
  }
}

TEST(AnchorPatch, IsNotFoundWhereSomethingElseIs) {
  const auto anchor = AnchorPatch::cut(first().view(), kMiddle);
  ASSERT_TRUE(anchor);
  for (const float away : {9.0F, 17.0F, 26.0F}) {
    const auto found = anchor->find(first().view(), {kMiddle + Vector2f(away, -0.4F * away)});
    EXPECT_TRUE(!found || found->correlation < 0.8F) << away;
  }
}

TEST(AnchorPatch, TakesNothingOverTheEdgeOrFromAnEmptyImage) {
  EXPECT_FALSE(AnchorPatch::cut(first().view(), {5.0F, 50.0F}));
  EXPECT_FALSE(AnchorPatch::cut(first().view(), {60.0F, kHeight - 6.0F}));
  Painting empty = first();
  std::fill(empty.pixels.begin(), empty.pixels.end(), std::uint8_t{90});
  EXPECT_FALSE(AnchorPatch::cut(empty.view(), kMiddle));
  const auto anchor = AnchorPatch::cut(first().view(), kMiddle);
  ASSERT_TRUE(anchor);
  EXPECT_FALSE(anchor->find(first().view(), {{-1e9F, 3.0F}}));
  EXPECT_FALSE(anchor->find(first().view(), {{std::nanf(""), 3.0F}}));
  EXPECT_FALSE(anchor->find(empty.view(), {kMiddle}));
}

}  // namespace
}  // namespace dive::estimation
