#pragma once
// Random lives of a filter's covariance: propagations, clones, landmarks and updates of every size
// and sharpness, in random order.

#include <cstdint>
#include <string>

namespace dive::testing {

/// Does so many updates; empty, or what went wrong: not symmetric to the last bit, or not positive
/// definite by Cholesky.
[[nodiscard]] std::string break_covariance(std::uint64_t seed, std::int64_t updates);

}  // namespace dive::testing
