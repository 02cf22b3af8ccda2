#pragma once
// Range checks for the validate() of options.

#include <string>

namespace dive {

/// Keeps the first value that is out of range and ignores those after it.
class RangeCheck {
 public:
  /// The range includes both ends and excludes NaN.
  void operator()(const char* name, double value, double low, double high);
  /// A sentence with name, value and range; empty if all are in range.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  std::string problem_;
};

}  // namespace dive
