#pragma once
// Guards: a small, total, side-effect-free expression language for `cond`.
//
//   cond="depth > 3 and not (battery_fraction < 0.4 or elapsed >= 120)"
//
// Grammar, with blanks between any two tokens:
//
//   or         := and ("or" and)*
//   and        := not ("and" not)*
//   not        := "not" not | comparison
//   comparison := operand (("<" | "<=" | ">" | ">=" | "==" | "!=") operand)?
//   operand    := number | "-" number | variable | "(" or ")"
//
// Numbers are decimal, variables SI, both sides of a comparison are numbers, and the whole is true
// or false. Type-checked when parsed, which takes time linear in the length; bounded in length and
// depth. In XML, < is written &lt;.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dive::mission {

/// The values a guard may ask for.
struct GuardVariables {
  double depth = 0.0;     ///< m
  double altitude = 0.0;  ///< m above the lowest obstacle below; infinite when none
  double battery_fraction = 1.0;
  double elapsed = 0.0;           ///< s since the mission started
  double state_elapsed = 0.0;     ///< s since the innermost state was entered
  double distance_to_goal = 0.0;  ///< m along the path; 0 without one
  double clearance = 0.0;         ///< m, certified, of the path being followed
  bool overhead = false;
};

class Guard {
 public:
  struct Error {
    std::size_t offset = 0;  ///< Byte in the text.
    std::string message;
    std::string hint;
  };

  /// Parses and type-checks; on failure fills `error`.
  [[nodiscard]] static std::optional<Guard> parse(std::string_view text, Error& error);

  static constexpr std::size_t kMaxLength = 512;  ///< Bytes.
  static constexpr int kMaxDepth = 32;            ///< Of parentheses and "not" within each other.

  /// Total: comparisons are IEEE's, so one with NaN is false (and != true). Allocates nothing.
  [[nodiscard]] bool evaluate(const GuardVariables& variables) const;
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  friend class GuardParser;
  struct Node {
    enum class Kind { kNumber, kVariable, kCompare, kAnd, kOr, kNot } kind = Kind::kNumber;
    double number = 0.0;
    int index = 0;  ///< Of the variable or the comparison.
    int left = -1;
    int right = -1;
  };
  std::string text_;
  std::vector<Node> nodes_;  ///< Children before parents; the last is the root.
};

}  // namespace dive::mission
