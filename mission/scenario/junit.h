#pragma once
// JUnit's XML, as read by continuous integration.

#include <string>
#include <vector>

namespace dive::mission {

struct TestCase {
  std::string name;
  std::string folder;  ///< Shown as the class.
  double seconds = 0.0;
  std::vector<std::string> failures;  ///< Expectations that were not met.
  std::string error;                  ///< Reason that the scenario could not be run; empty: it was.
};

/// The result is well-formed for any text: characters that XML does not allow become '?'.
[[nodiscard]] std::string to_junit(const std::vector<TestCase>& cases);

}  // namespace dive::mission
