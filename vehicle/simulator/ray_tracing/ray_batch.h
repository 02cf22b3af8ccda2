#pragma once
// Camera rays in batches of 128, field by field, so that loops over them become vector
// instructions.
//
// Every stage is plain IEEE arithmetic without reductions: the results are bit-identical for every
// instruction set (the compiler contracts nothing, see cmake/DiveLibrary.cmake).

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

// Compiles a loop for several instruction sets, selected at start. Incompatible with sanitizers.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DIVE_VECTOR_LOOP __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define DIVE_VECTOR_LOOP
#endif
#define DIVE_INLINE inline __attribute__((always_inline))

namespace dive::vehicle {

struct RayBatch {
  static constexpr int kSize = 128;
  using Floats = std::array<float, kSize>;
  using Ints = std::array<std::int32_t, kSize>;

  int count = 0;
  alignas(64) Floats u{}, v{};          ///< Position in the image, pixels.
  alignas(64) Floats dx{}, dy{}, dz{};  ///< Direction, unit, W.
  alignas(64) Floats distance{};        ///< Distance to the object met, m; kFar: none.
  alignas(64) Floats nx{}, ny{}, nz{};  ///< Unit normal there, in W, on the side of the lens.
  alignas(64) Floats tx{}, ty{}, tz{};  ///< The point in the frame of the object met, m.
  alignas(64) Floats footprint{};       ///< Size of a pixel there, m, along its longer side.
  alignas(64) Ints texture{};           ///< Index of the surface's texture; 0: none.
  alignas(64) Floats tone{};            ///< Factor of the object met on the albedo of its texture.
  alignas(64) Floats sky{};             ///< Fraction of the daylight that reaches the point.
  alignas(64) Floats glow{};            ///< Fraction of the daylight emitted from the point.
  alignas(64) Floats red{}, green{}, blue{};  ///< Albedo.
  alignas(64) Floats lamp_veil{};  ///< Radiance of the vehicle's own lamps scattered by the water.
  alignas(64) Floats radiance{};   ///< Radiance at the lens.

  static constexpr float kFar = 1e4F;
};

/// e^x for x in [-80, 80], relative error 3e-6.
DIVE_INLINE float fast_exp(float x) {
  const float t = std::clamp(x, -80.0F, 80.0F) * 1.44269504F;
  const int i = static_cast<int>(t + 1024.5F) - 1024;
  const float f = (t - static_cast<float>(i)) * 0.69314718F;
  const float p =
      1.0F +
      f * (1.0F + f * (0.5F + f * (0.16666667F +
                                   f * (0.041666668F + f * (0.008333334F + f * 0.0013888889F)))));
  return p * std::bit_cast<float>((i + 127) << 23);
}

/// 0 below `low`, 1 above `high`, smooth between.
DIVE_INLINE float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// The largest integer not above x, |x| < 2^31.
DIVE_INLINE std::int32_t floor_to_int(float x) {
  const auto i = static_cast<std::int32_t>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

/// A pseudo-random number in [-1, 1) for each point of a lattice.
DIVE_INLINE float lattice_value(std::uint32_t mixed) {
  std::uint32_t h = mixed;
  h ^= h >> 15U;
  h *= 0x2c1b3c6dU;
  h ^= h >> 12U;
  h *= 0x297a2d39U;
  return static_cast<float>(static_cast<std::int32_t>(h)) * 0x1.0p-31F;
}

/// Value noise (Perlin's lattice with values instead of gradients) of spacing 1, within [-1, 1].
DIVE_INLINE float value_noise(float x, float y, float z, std::uint32_t seed) {
  const std::int32_t ix = floor_to_int(x);
  const std::int32_t iy = floor_to_int(y);
  const std::int32_t iz = floor_to_int(z);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const float fz = z - static_cast<float>(iz);
  const float sx = fx * fx * (3.0F - 2.0F * fx);
  const float sy = fy * fy * (3.0F - 2.0F * fy);
  const float sz = fz * fz * (3.0F - 2.0F * fz);
  constexpr std::uint32_t kX = 0x8da6b343U;
  constexpr std::uint32_t kY = 0xd8163841U;
  constexpr std::uint32_t kZ = 0xcb1ab31fU;
  const std::uint32_t x0 = (static_cast<std::uint32_t>(ix) * kX) ^ seed;
  const std::uint32_t x1 = (static_cast<std::uint32_t>(ix) * kX + kX) ^ seed;
  const std::uint32_t y0 = static_cast<std::uint32_t>(iy) * kY;
  const std::uint32_t y1 = y0 + kY;
  const std::uint32_t z0 = static_cast<std::uint32_t>(iz) * kZ;
  const std::uint32_t z1 = z0 + kZ;
  const auto along_x = [&](std::uint32_t yz) {
    const float a = lattice_value(x0 ^ yz);
    return a + sx * (lattice_value(x1 ^ yz) - a);
  };
  const float a = along_x(y0 ^ z0);
  const float b = along_x(y1 ^ z0);
  const float c = along_x(y0 ^ z1);
  const float d = along_x(y1 ^ z1);
  const float low = a + sy * (b - a);
  const float high = c + sy * (d - c);
  return low + sz * (high - low);
}

}  // namespace dive::vehicle
