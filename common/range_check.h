#pragma once
// For the validate() of options: does each lie in its range?

#include <string>

namespace dive {

/// The first value that does not is what is wrong; those after it are not looked at.
class RangeCheck {
 public:
  /// Both ends are in the range. NaN lies in none.
  void operator()(const char* name, double value, double low, double high);
  /// A sentence with name, value and range; empty while all do.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  std::string problem_;
};

}  // namespace dive
