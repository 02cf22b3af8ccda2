#pragma once
// Counts calls of operator new in a test program that links allocations.cpp.

#include <cstddef>

namespace dive::testing {

struct Allocations {
  std::size_t count = 0;
  std::size_t largest = 0;  ///< Bytes.
};

/// Counts of the whole program since the last reset; not thread-safe.
[[nodiscard]] Allocations allocations();
void reset_allocations();

}  // namespace dive::testing
