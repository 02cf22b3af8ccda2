#pragma once
// Random histories of a filter's covariance: propagations, clones, landmarks and updates of every
// size and precision, in random order.

#include <cstdint>
#include <string>

namespace dive::testing {

/// Makes `updates` updates; returns the first failure, or empty: not symmetric to the last bit, or
/// not positive definite by Cholesky.
[[nodiscard]] std::string break_covariance(std::uint64_t seed, std::int64_t updates);

}  // namespace dive::testing
