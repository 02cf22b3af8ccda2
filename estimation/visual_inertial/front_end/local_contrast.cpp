#include "estimation/visual_inertial/front_end/local_contrast.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/assert.h"

namespace dive::estimation {
namespace {

constexpr int kColumns = 5;  // of tiles
constexpr int kRows = 3;
constexpr float kContrast = 45.0F;  // grey levels, of every tile
constexpr float kMaxGain = 4.0F;    // limits the amplification of noise

struct Tile {
  float gain = 1.0F;
  float offset = 0.0F;  // I' = gain I + offset
};

struct Sums {
  std::uint64_t sum = 0;
  std::uint64_t squares = 0;
  std::uint64_t count = 0;
};

Sums sums_of(const GrayView& image, int x0, int x1, int y0, int y1) {
  Sums sums;
  for (int y = y0; y < y1; ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.width;
    std::uint32_t sum = 0;  // a row is too short to overflow
    std::uint32_t squares = 0;
    for (int x = x0; x < x1; ++x) {
      const std::uint32_t value = row[x];
      sum += value;
      squares += value * value;
    }
    sums.sum += sum;
    sums.squares += squares;
  }
  sums.count = static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0);
  return sums;
}

double variance(const Sums& sums) {
  const double n = static_cast<double>(sums.count);
  const double mean = static_cast<double>(sums.sum) / n;
  return std::max(0.0, static_cast<double>(sums.squares) / n - mean * mean);
}

Tile tile_of(const Sums& sums) {
  const float mean = static_cast<float>(sums.sum) / static_cast<float>(sums.count);
  const float sigma = static_cast<float>(std::sqrt(variance(sums)));
  const float gain = sigma * kMaxGain > kContrast ? kContrast / sigma : kMaxGain;
  return {gain, 128.0F - gain * mean};
}

// Fills the pixels of a row between the centres of two tiles, and beyond the outer ones.
void fill(const std::uint8_t* in, std::uint8_t* out, int x0, int x1, const Tile& start,
          const Tile& step) {
  for (int x = x0; x < x1; ++x) {
    const float t = static_cast<float>(x - x0);
    const float value = (start.gain + t * step.gain) * static_cast<float>(in[x]) +
                        (start.offset + t * step.offset) + 0.5F;
    out[x] = static_cast<std::uint8_t>(std::clamp(static_cast<int>(value), 0, 255));
  }
}

// Every fourth row suffices.
double sharpness(const GrayView& image, double image_variance) {
  if (image_variance <= 0.0) return 0.0;
  std::uint64_t sum = 0;
  std::uint64_t count = 0;
  for (int y = 0; y < image.height; y += 4) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.width;
    std::uint32_t squares = 0;
    for (int x = 1; x < image.width; ++x) {
      const int difference = row[x] - row[x - 1];
      squares += static_cast<std::uint32_t>(difference * difference);
    }
    sum += squares;
    count += static_cast<std::uint64_t>(image.width - 1);
  }
  return static_cast<double>(sum) / static_cast<double>(count) / (2.0 * image_variance);
}

int middle(int tile, int tiles, int size) { return (2 * tile + 1) * size / (2 * tiles); }

}  // namespace

ImageStatistics even_contrast(const GrayView& image, std::vector<std::uint8_t>& out) {
  const int width = image.width;
  const int height = image.height;
  DIVE_DEMAND(width >= 64 && height >= 64);
  Tile tiles[kRows][kColumns];
  Sums all;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const Sums sums = sums_of(image, c * width / kColumns, (c + 1) * width / kColumns,
                                r * height / kRows, (r + 1) * height / kRows);
      tiles[r][c] = tile_of(sums);
      all.sum += sums.sum;
      all.squares += sums.squares;
      all.count += sums.count;
    }
  }

  out.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  int lower = 0;  // the first row of tiles whose centre is not above the row of pixels
  for (int y = 0; y < height; ++y) {
    while (lower < kRows && middle(lower, kRows, height) < y) ++lower;
    const int r0 = std::max(0, lower - 1);
    const int r1 = std::min(kRows - 1, lower);
    const int y0 = middle(r0, kRows, height);
    const int y1 = middle(r1, kRows, height);
    const float t = r0 == r1 ? 0.0F : static_cast<float>(y - y0) / static_cast<float>(y1 - y0);
    const auto at = [&](int c) -> Tile {
      const Tile& a = tiles[r0][c];
      const Tile& b = tiles[r1][c];
      return {a.gain + t * (b.gain - a.gain), a.offset + t * (b.offset - a.offset)};
    };
    const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(y) * width;
    const std::uint8_t* in_row = image.pixels + begin;
    std::uint8_t* out_row = out.data() + begin;
    fill(in_row, out_row, 0, middle(0, kColumns, width), at(0), {0.0F, 0.0F});
    for (int c = 0; c + 1 < kColumns; ++c) {
      const int x0 = middle(c, kColumns, width);
      const int x1 = middle(c + 1, kColumns, width);
      const Tile a = at(c);
      const Tile b = at(c + 1);
      const float n = static_cast<float>(x1 - x0);
      fill(in_row, out_row, x0, x1, a, {(b.gain - a.gain) / n, (b.offset - a.offset) / n});
    }
    fill(in_row, out_row, middle(kColumns - 1, kColumns, width), width, at(kColumns - 1),
         {0.0F, 0.0F});
  }

  ImageStatistics statistics;
  statistics.brightness = static_cast<double>(all.sum) / static_cast<double>(all.count);
  statistics.contrast = std::sqrt(variance(all));
  statistics.sharpness = sharpness(image, variance(all));
  return statistics;
}

void halve(const GrayView& image, std::vector<std::uint8_t>& out) {
  const int width = image.width / 2;
  const int height = image.height / 2;
  out.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* upper = image.pixels + static_cast<std::ptrdiff_t>(2 * y) * image.width;
    const std::uint8_t* lower = upper + image.width;
    std::uint8_t* row = out.data() + static_cast<std::ptrdiff_t>(y) * width;
    for (std::ptrdiff_t x = 0; x < width; ++x) {
      const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
      row[x] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
}

}  // namespace dive::estimation
