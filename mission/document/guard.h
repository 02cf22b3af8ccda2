#pragma once
// Guards: a small, total, side-effect-free expression language for `cond`.
//
//   cond="depth > 3 m and not (battery_fraction < 40 % or elapsed >= 2 min)"
//
// Grammar, with blanks between any two tokens:
//
//   or         := and ("or" and)*
//   and        := not ("and" not)*
//   not        := "not" not
// comparison
//   comparison := operand (("<"
// "<="
// ">"
// ">="
// "=="
// "!=") operand)?
//   operand    := "-"? number unit?
// variable
// estimator
// "(" or ")"
//   unit       := "m"
// "cm"
// "km"
// "s"
// "min"
// "h"
// "%"
//   estimator  := "primitive"
// "visual_inertial"
//
// Numbers are decimal; a number without a unit has the SI unit of the other operand. Both operands
// of a comparison have the same kind (a length is not compared with a time; estimators are only
// equal or not), and the result is a boolean. Parsing checks the types, in time linear in the
// length; length and depth are bounded. In XML, < is written &lt;.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace dive::mission {

enum class EstimatorName { kPrimitive, kVisualInertial };

/// Values of the variables that a guard may use.
struct GuardVariables {
  double depth = 0.0;     ///< m
  double altitude = 0.0;  ///< m above the lowest obstacle below; infinite when none
  double battery_fraction = 1.0;
  double temperature = 20.0;      ///< degrees Celsius, in the hull
  double elapsed = 0.0;           ///< s since the mission started
  double state_elapsed = 0.0;     ///< s since the innermost state was entered
  double distance_to_goal = 0.0;  ///< m along the path; 0 without one
  double clearance = 0.0;         ///< m, certified clearance of the path being followed
  double cross_track = 0.0;       ///< m from the path being followed
  double position_sigma = 0.0;    ///< m, one sigma of the horizontal position, larger axis
  double penetration = 0.0;       ///< m back along the trail to open water; 0 in open water
  double budget_used = 0.0;  ///< fraction used of the usable time or energy (the larger) at entry
                             ///< under the overhead; 0 in open water
  bool overhead = false;
  EstimatorName estimator = EstimatorName::kPrimitive;
};

class Guard {
 public:
  struct Error {
    std::size_t offset = 0;  ///< Byte offset in the text.
    std::string message;
    std::string hint;
  };

  /// Parses and type-checks; sets `error` on failure.
  [[nodiscard]] static std::optional<Guard> parse(std::string_view text, Error& error);

  static constexpr std::size_t kMaxLength = 512;  ///< Bytes.
  static constexpr int kMaxDepth = 32;            ///< Nesting of parentheses and "not".

  /// Total: comparisons follow IEEE 754, so a comparison with NaN is false (and != true). Allocates
  /// nothing.
  [[nodiscard]] bool evaluate(const GuardVariables& variables) const;
  [[nodiscard]] const std::string& text() const { return text_; }
  /// The guard in ECMAScript, over script_variables().
  [[nodiscard]] std::string script() const;
  /// Names and initial values, in the syntax of script(), of all guard variables.
  [[nodiscard]] static std::vector<std::pair<std::string, std::string>> script_variables();
  /// The values used: "depth 2.41, overhead true".
  [[nodiscard]] std::string describe(const GuardVariables& variables) const;

 private:
  friend class GuardParser;
  struct Node {
    enum class Kind { kNumber, kVariable, kCompare, kAnd, kOr, kNot } kind = Kind::kNumber;
    double number = 0.0;
    int index = 0;  ///< Index of the variable or comparison.
    int left = -1;
    int right = -1;
  };
  std::string text_;
  std::vector<Node> nodes_;  ///< Children before parents; the last is the root.
};

}  // namespace dive::mission
