#pragma once
// Seeded random numbers, equal for equal seeds with every standard library: the engine is the
// standard's mt19937_64, whose output is fixed, and the distributions are our own, because the
// standard's are not fixed.

#include <cstdint>
#include <random>

namespace dive {

class Random {
 public:
  /// `stream` separates independent users of one seed (sensor noise, planner, ...).
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  /// Uniform in [0, 1).
  [[nodiscard]] double uniform();
  /// Uniform in [low, high).
  [[nodiscard]] double uniform(double low, double high);
  /// Standard normal, by Marsaglia's polar method.
  [[nodiscard]] double normal();
  /// Raw 64 bits.
  [[nodiscard]] std::uint64_t bits();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace dive
