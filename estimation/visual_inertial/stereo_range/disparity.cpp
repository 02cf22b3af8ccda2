#include "estimation/visual_inertial/stereo_range/disparity.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>

namespace dive::estimation {
namespace {

constexpr int kWidth = kDisparityWindowWidth;
constexpr int kHeight = kDisparityWindowHeight;
constexpr int kCount = kWidth * kHeight;
constexpr int kUnit = 8;  // of a grey level and of a pixel: sums stay in 32 bits
constexpr int kIterations = 3;
constexpr double kMaxShift = 1.5;          // px, from the start
constexpr double kConverged = 0.1;         // px, of the last step
constexpr double kMinGradient = 2.0;       // sum g^2 over that of noise alone
constexpr double kMinSimilarity = 0.6;     // 1 - sum e^2 / sum L^2
constexpr double kMaxEccentricity = 0.20;  // of the window, offset of the gradients' centre
constexpr double kMinNoise = 0.5;          // grey levels: rounding

using Window = std::array<std::int16_t, kCount>;

struct Sums {
  std::int32_t e = 0;
  std::int32_t ee = 0;
  std::int32_t eg = 0;
};

const std::uint8_t* row_of(const GrayView& image, int u, int v) {
  return image.pixels + static_cast<std::ptrdiff_t>(v) * image.width + u;
}

// e over the window, in units, with the match `whole` pixels and `part` units to the left.
Sums differ(const Window& left, const Window& gradient, const GrayView& right, int u, int v,
            int part) {
  Sums sums;
  for (int row = 0; row < kHeight; ++row) {
    const std::uint8_t* r = row_of(right, u, v + row);
    const std::int16_t* l = &left[static_cast<std::size_t>(row * kWidth)];
    const std::int16_t* g = &gradient[static_cast<std::size_t>(row * kWidth)];
    for (int i = 0; i < kWidth; ++i) {
      const auto result = static_cast<std::int16_t>((kUnit - part) * r[i + 1] + part * r[i]);
      const auto e = static_cast<std::int16_t>(l[i] - result);
      sums.e += e;
      sums.ee += static_cast<std::int32_t>(e) * e;
      sums.eg += static_cast<std::int32_t>(e) * g[i];
    }
  }
  return sums;
}

// Texture only at one side of the window, an edge, gives the range of that side, not of the centre.
template <std::size_t kLength>
bool is_balanced(const std::array<std::int32_t, kLength>& squares) {
  double sum = 0.0;
  double first = 0.0;
  for (std::size_t i = 0; i < kLength; ++i) {
    sum += squares[i];
    first += squares[i] * (static_cast<double>(i) - 0.5 * (kLength - 1));
  }
  return std::abs(first) <= kMaxEccentricity * kLength * sum;
}

double moment(double xy, double x, double y) { return xy - x * y / kCount; }

}  // namespace

std::optional<Disparity> refine_disparity(const GrayView& left, const GrayView& right, int u, int v,
                                          double start) {
  const int first_u = u - kWidth / 2;
  const int first_v = v - kHeight / 2;
  if (first_u < 1 || first_v < 0 || first_u + kWidth + 1 > left.width ||
      first_v + kHeight > left.height) {
    return std::nullopt;
  }
  Window window;
  Window gradient;
  std::array<std::int32_t, kWidth> columns{};  // of gradients squared
  std::array<std::int32_t, kHeight> rows{};
  std::int32_t l = 0, ll = 0, g = 0;
  for (int row = 0; row < kHeight; ++row) {
    const std::uint8_t* at = row_of(left, first_u, first_v + row);
    for (int i = 0; i < kWidth; ++i) {
      const auto k = static_cast<std::size_t>(row * kWidth + i);
      window[k] = static_cast<std::int16_t>(kUnit * at[i]);
      gradient[k] = static_cast<std::int16_t>(kUnit / 2 * (at[i + 1] - at[i - 1]));
      l += window[k];
      ll += static_cast<std::int32_t>(window[k]) * window[k];
      g += gradient[k];
      const std::int32_t squared = static_cast<std::int32_t>(gradient[k]) * gradient[k];
      columns[static_cast<std::size_t>(i)] += squared;
      rows[static_cast<std::size_t>(row)] += squared;
    }
  }
  if (!is_balanced(columns) || !is_balanced(rows)) return std::nullopt;
  const std::int32_t gg = std::accumulate(rows.begin(), rows.end(), 0);
  const double gradients = moment(gg, g, g);
  const double variation = moment(ll, l, l);
  if (!(gradients > 0.0 && variation > 0.0)) return std::nullopt;

  double d = start;
  double step = 0.0;
  double rest = 0.0;  // sum e^2
  for (int i = 0; i < kIterations; ++i) {
    if (!(std::abs(d - start) <= kMaxShift)) return std::nullopt;
    const int units = static_cast<int>(std::lround(kUnit * d));
    const int whole = units >= 0 ? units / kUnit : -((kUnit - 1 - units) / kUnit);
    // R(u - d) is between u - whole - 1 and u - whole.
    const int at = first_u - whole - 1;
    if (at < 0 || at + kWidth + 1 > right.width) return std::nullopt;
    const Sums sums = differ(window, gradient, right, at, first_v, units - whole * kUnit);
    const double slope = moment(sums.eg, sums.e, g);
    step = -slope / gradients;
    rest = moment(sums.ee, sums.e, sums.e) - slope * slope / gradients;
    d = static_cast<double>(units) / kUnit + step;
    if (std::abs(step) < 0.5 / kUnit) break;  // the next would be at the same position
  }
  if (!(std::abs(step) <= kConverged && std::abs(d - start) <= kMaxShift)) return std::nullopt;
  const double least = kMinNoise * kMinNoise * kUnit * kUnit;
  const double variance = std::max(rest / kCount, least);
  const double of_noise = 0.25 * kCount * variance;
  if (gradients < kMinGradient * of_noise || rest > (1.0 - kMinSimilarity) * variation) {
    return std::nullopt;
  }
  return Disparity{d, std::sqrt(variance / (gradients - of_noise))};
}

}  // namespace dive::estimation
