#include "test/common/allocations.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {
dive::testing::Allocations so_far;
}  // namespace

// The form used by std::stable_sort. Replaced too because the sanitizer replaces it as well.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++so_far.count;
  so_far.largest = std::max(so_far.largest, size);
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
// GCC takes the standard library's operator new for the one that allocated.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace dive::testing {

Allocations allocations() { return so_far; }
void reset_allocations() { so_far = {}; }

}  // namespace dive::testing
