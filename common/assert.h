#pragma once
// Assertions for our own mistakes. They stay on in release. A failed one throws, so that whoever
// drives the vehicle can catch it and surface: never a dead process with a live vehicle.

#include <stdexcept>
#include <string>

namespace dive {

/// One of our own invariants did not hold. Not for bad files (Diagnostic) nor for what can go
/// wrong in operation (tl::expected).
class AssertionFailure : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace dive

#define DIVE_DEMAND(condition)                         \
  (static_cast<bool>(condition) ? static_cast<void>(0) \
                                : ::dive::assertion_failed(#condition, __FILE__, __LINE__))
