#pragma once
// JUnit's XML, as continuous integration reads it.

#include <string>
#include <vector>

namespace dive::mission {

struct TestCase {
  std::string name;
  std::string folder;  ///< Shown as the class.
  double seconds = 0.0;
  std::vector<std::string> failures;  ///< What did not hold, one by one.
  std::string error;                  ///< It could not be tried; empty: it was.
};

/// Whatever is in the texts, the result is well-formed: what XML cannot hold becomes '?'.
[[nodiscard]] std::string to_junit(const std::vector<TestCase>& cases);

}  // namespace dive::mission
