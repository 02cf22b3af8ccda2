#pragma once
// Recursive-descent parser for the text of a guard; guard.h has the grammar. Private to guard.cpp.

#include <string>
#include <string_view>

#include "mission/document/guard.h"
#include "mission/document/guard_table.h"

namespace dive::mission {

class GuardParser {
 public:
  GuardParser(std::string_view text, Guard::Error& error) : text_(text), error_(error) {}

  [[nodiscard]] std::optional<Guard> parse();

 private:
  enum class Token { kEnd, kNumber, kName, kCompare, kMinus, kOpen, kClose, kUnknown };
  /// A parsed part: its node, kind and position.
  struct Part {
    int node = -1;
    GuardKind kind = GuardKind::kNumber;
    std::size_t offset = 0;
  };
  using MaybePart = std::optional<Part>;  ///< Empty after an error.

  MaybePart parse_or();
  MaybePart parse_and();
  MaybePart parse_not();
  MaybePart parse_comparison();
  MaybePart parse_operand();
  MaybePart parse_number(bool negative, std::size_t offset);
  [[nodiscard]] const GuardConstant* parse_unit(std::string_view attached);
  MaybePart parse_name();
  MaybePart join(Guard::Node::Kind kind, const Part& left, const Part& right, std::size_t offset);

  void advance();
  void scan_number();
  [[nodiscard]] bool at_word(std::string_view word) const;
  [[nodiscard]] bool demand_truth(const Part& part, std::string_view where);
  [[nodiscard]] bool demand_alike(const Part& left, int comparison, const Part& right);
  [[nodiscard]] std::string found() const;
  std::nullopt_t fail(std::size_t offset, std::string message, std::string hint = {});
  int add(Guard::Node node);

  std::string_view text_;
  Guard::Error& error_;
  Guard guard_;
  Token token_ = Token::kEnd;
  std::size_t begin_ = 0;  ///< Start of the token.
  std::size_t end_ = 0;
  int depth_ = 0;
};

}  // namespace dive::mission
