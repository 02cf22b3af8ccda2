#pragma once
// What operator new was asked for. A test program that links allocations.cpp counts.

#include <cstddef>

namespace dive::testing {

struct Allocations {
  std::size_t count = 0;
  std::size_t largest = 0;  ///< Bytes.
};

/// Since the last reset, of the whole program; not for several threads.
[[nodiscard]] Allocations allocations();
void reset_allocations();

}  // namespace dive::testing
