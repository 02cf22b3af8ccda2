#pragma once
// Standard deviation of the ranges of a sensor.

namespace dive {

/// constant_m + share r + square r^2 at a range r (m).
struct RangeNoise {
  double constant_m = 0.01;  ///< m
  double share = 0.005;      ///< m/m
  double square = 0.0;       ///< 1/m; of a stereo pair.

  /// One sigma, m.
  template <typename Scalar>
  [[nodiscard]] Scalar sigma(Scalar range) const {
    return static_cast<Scalar>(constant_m) + static_cast<Scalar>(share) * range +
           static_cast<Scalar>(square) * range * range;
  }
};

}  // namespace dive
