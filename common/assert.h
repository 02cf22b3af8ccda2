#pragma once
// Assertions against programming errors, active in release too. A failed one throws, so that the
// caller that drives the vehicle can catch it and surface: the process must not die while the
// vehicle swims.

#include <stdexcept>
#include <string>

namespace dive {

/// A violated invariant of this program. Not used for bad files (Diagnostic) or for failures to
/// expect in operation (tl::expected).
class AssertionFailure : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace dive

#define DIVE_DEMAND(condition)                         \
  (static_cast<bool>(condition) ? static_cast<void>(0) \
                                : ::dive::assertion_failed(#condition, __FILE__, __LINE__))
