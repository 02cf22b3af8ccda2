#include "mission/document/guard_parser.h"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"

namespace dive::mission {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_name_start(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_name_part(char c) { return is_name_start(c) || is_digit(c); }

int comparison_index(std::string_view text) {
  for (std::size_t i = 0; i < kGuardComparisons.size(); ++i) {
    if (kGuardComparisons[i] == text) return static_cast<int>(i);
  }
  return -1;
}

// Symbols of other languages.
std::string hint_for_symbol(std::string_view rest) {
  if (rest.substr(0, 2) == "&&" || rest.substr(0, 1) == "&") return "write 'and'";
  if (rest.substr(0, 1) == "|") return "write 'or'";
  if (rest.substr(0, 1) == "!") return "write 'not'";
  if (rest.substr(0, 1) == "=") return "write '==' to compare";
  if (rest.substr(0, 1) == ",") return "write numbers with a decimal point";
  return {};
}

// The whole character, which may have several bytes.
std::string_view first_character(std::string_view text) {
  std::size_t length = 1;
  while (length < text.size() && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) {
    ++length;
  }
  return text.substr(0, length);
}

}  // namespace

std::optional<Guard> GuardParser::parse() {
  if (text_.size() > Guard::kMaxLength) {
    return fail(Guard::kMaxLength,
                fmt::format("the condition is longer than {} characters", Guard::kMaxLength));
  }
  advance();
  if (token_ == Token::kEnd) {
    return fail(0, "the condition is empty", "leave cond out for a transition without a condition");
  }
  const MaybePart whole = parse_or();
  if (!whole) return std::nullopt;
  if (token_ == Token::kClose) return fail(begin_, "this ')' has no '(' before it");
  if (token_ != Token::kEnd) {
    return fail(begin_, fmt::format("expected 'and', 'or' or the end, but found {}", found()),
                hint_for_symbol(text_.substr(begin_)));
  }
  if (!demand_truth(*whole, "a condition")) return std::nullopt;
  guard_.text_ = std::string(text_);
  return std::move(guard_);
}

GuardParser::MaybePart GuardParser::parse_or() {
  MaybePart left = parse_and();
  while (left && at_word("or")) {
    const std::size_t offset = left->offset;
    if (!demand_truth(*left, "'or'")) return std::nullopt;
    advance();
    const MaybePart right = parse_and();
    if (!right || !demand_truth(*right, "'or'")) return std::nullopt;
    left = join(Guard::Node::Kind::kOr, *left, *right, offset);
  }
  return left;
}

GuardParser::MaybePart GuardParser::parse_and() {
  MaybePart left = parse_not();
  while (left && at_word("and")) {
    const std::size_t offset = left->offset;
    if (!demand_truth(*left, "'and'")) return std::nullopt;
    advance();
    const MaybePart right = parse_not();
    if (!right || !demand_truth(*right, "'and'")) return std::nullopt;
    left = join(Guard::Node::Kind::kAnd, *left, *right, offset);
  }
  return left;
}

GuardParser::MaybePart GuardParser::parse_not() {
  if (!at_word("not")) return parse_comparison();
  const std::size_t offset = begin_;
  if (++depth_ > Guard::kMaxDepth) return fail(offset, "the condition is nested too deeply");
  advance();
  const MaybePart part = parse_not();
  --depth_;
  if (!part || !demand_truth(*part, "'not'")) return std::nullopt;
  Guard::Node node;
  node.kind = Guard::Node::Kind::kNot;
  node.left = part->node;
  return Part{add(node), GuardKind::kTruth, offset};
}

GuardParser::MaybePart GuardParser::parse_comparison() {
  const MaybePart left = parse_operand();
  if (!left || token_ != Token::kCompare) return left;
  const int comparison = comparison_index(text_.substr(begin_, end_ - begin_));
  advance();
  const MaybePart right = parse_operand();
  if (!right || !demand_alike(*left, comparison, *right)) return std::nullopt;
  if (token_ == Token::kCompare) {
    return fail(begin_, "comparisons cannot be chained", "write 'a < b and b < c'");
  }
  MaybePart joined = join(Guard::Node::Kind::kCompare, *left, *right, left->offset);
  guard_.nodes_.back().index = comparison;
  return joined;
}

GuardParser::MaybePart GuardParser::parse_operand() {
  const std::size_t offset = begin_;
  switch (token_) {
    case Token::kNumber:
      return parse_number(false, offset);
    case Token::kMinus:
      advance();
      if (token_ != Token::kNumber) {
        return fail(begin_, fmt::format("expected a number after '-', but found {}", found()));
      }
      return parse_number(true, offset);
    case Token::kName:
      return parse_name();
    case Token::kOpen: {
      if (++depth_ > Guard::kMaxDepth) return fail(offset, "the condition is nested too deeply");
      advance();
      MaybePart part = parse_or();
      if (!part) return std::nullopt;
      if (token_ != Token::kClose) {
        return fail(begin_, fmt::format("expected ')', but found {}", found()),
                    hint_for_symbol(text_.substr(begin_)));
      }
      --depth_;
      advance();
      part->offset = offset;
      return part;
    }
    default:
      return fail(offset, fmt::format("expected a number or a variable, but found {}", found()),
                  hint_for_symbol(text_.substr(offset)));
  }
}

GuardParser::MaybePart GuardParser::parse_number(bool negative, std::size_t offset) {
  const std::string_view written = text_.substr(begin_, end_ - begin_);
  Guard::Node node;
  const auto [end, error] =
      std::from_chars(written.data(), written.data() + written.size(), node.number);
  if (error == std::errc::result_out_of_range) {
    return fail(offset, fmt::format("the number {} is out of range", written));
  }
  const std::string_view rest = written.substr(static_cast<std::size_t>(end - written.data()));
  if (error != std::errc() || (!rest.empty() && !is_name_start(rest.front()))) {
    return fail(offset, fmt::format("'{}' is not a number", written),
                "write numbers with a decimal point");
  }
  const std::size_t unit_at = end_ - rest.size();
  advance();
  Part part{-1, GuardKind::kNumber, offset};
  if (const GuardConstant* unit = parse_unit(rest)) {
    part.kind = unit->kind;
    node.number *= unit->value;
  } else if (!rest.empty()) {
    return fail(unit_at, fmt::format("there is no unit '{}'", rest),
                "the units are m, cm, km, s, min, h and %");
  }
  if (negative) node.number = -node.number;
  part.node = add(node);
  return part;
}

// The unit of the number just read: the suffix written without a blank, or else the next token if
// it is a unit.
const GuardConstant* GuardParser::parse_unit(std::string_view attached) {
  const bool apart = attached.empty();
  const std::string_view written = apart ? text_.substr(begin_, end_ - begin_) : attached;
  const auto unit = std::ranges::find(kGuardUnits, written, &GuardConstant::name);
  if (unit == kGuardUnits.end()) return nullptr;
  if (apart) advance();
  return &*unit;
}

GuardParser::MaybePart GuardParser::parse_name() {
  const std::string_view name = text_.substr(begin_, end_ - begin_);
  Guard::Node node;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kGuardVariables.size(); ++i) {
    names.emplace_back(kGuardVariables[i].name);
    if (kGuardVariables[i].name != name) continue;
    node.kind = Guard::Node::Kind::kVariable;
    node.index = static_cast<int>(i);
    const Part part{add(node), kGuardVariables[i].kind, begin_};
    advance();
    return part;
  }
  for (const GuardConstant& constant : kGuardConstants) {
    if (constant.name != name) continue;
    node.number = constant.value;
    const Part part{add(node), constant.kind, begin_};
    advance();
    return part;
  }
  if (name == "and" || name == "or" || name == "not") {
    return fail(begin_, fmt::format("expected a number or a variable, but found '{}'", name));
  }
  const std::optional<std::string> meant = closest_match(name, names);
  return fail(begin_, fmt::format("there is no variable '{}'", name),
              meant ? fmt::format("did you mean '{}'?", *meant)
                    : fmt::format("the variables are {}", fmt::join(names, ", ")));
}

GuardParser::MaybePart GuardParser::join(Guard::Node::Kind kind, const Part& left,
                                         const Part& right, std::size_t offset) {
  Guard::Node node;
  node.kind = kind;
  node.left = left.node;
  node.right = right.node;
  return Part{add(node), GuardKind::kTruth, offset};
}

void GuardParser::advance() {
  begin_ = end_;
  while (begin_ < text_.size() && is_blank(text_[begin_])) ++begin_;
  end_ = begin_;
  if (begin_ == text_.size()) {
    token_ = Token::kEnd;
    return;
  }
  const char c = text_[end_++];
  if (is_digit(c) || c == '.') {
    scan_number();
  } else if (is_name_start(c)) {
    token_ = Token::kName;
    while (end_ < text_.size() && is_name_part(text_[end_])) ++end_;
  } else if (c == '(' || c == ')' || c == '-') {
    token_ = c == '(' ? Token::kOpen : c == ')' ? Token::kClose : Token::kMinus;
  } else {
    if (end_ < text_.size() && text_[end_] == '=') ++end_;
    const bool known = comparison_index(text_.substr(begin_, end_ - begin_)) >= 0;
    token_ = known ? Token::kCompare : Token::kUnknown;
  }
}

// Scans everything that could belong to a number, so that "3m" and "1.2.3" are reported as a whole.
void GuardParser::scan_number() {
  token_ = Token::kNumber;
  while (end_ < text_.size()) {
    const char c = text_[end_];
    const bool exponent_sign = (c == '-' || c == '+') &&
                               (text_[end_ - 1] == 'e' || text_[end_ - 1] == 'E') &&
                               end_ + 1 < text_.size() && is_digit(text_[end_ + 1]);
    if (!is_name_part(c) && c != '.' && !exponent_sign) return;
    ++end_;
  }
}

bool GuardParser::at_word(std::string_view word) const {
  return token_ == Token::kName && text_.substr(begin_, end_ - begin_) == word;
}

bool GuardParser::demand_truth(const Part& part, std::string_view where) {
  if (part.kind == GuardKind::kTruth) return true;
  fail(part.offset,
       fmt::format("{} needs something that is true or false, but this is {}", where,
                   name_of(part.kind)),
       part.kind == GuardKind::kEstimator ? "compare it, as in 'estimator == primitive'"
                                          : "compare it, as in 'depth > 3'");
  return false;
}

bool GuardParser::demand_alike(const Part& left, int comparison, const Part& right) {
  for (const Part* part : {&left, &right}) {
    if (part->kind != GuardKind::kTruth) continue;
    fail(part->offset, "only numbers can be compared, but this is true or false",
         "use it alone, as in 'overhead' or 'not overhead'");
    return false;
  }
  const bool has_estimator =
      left.kind == GuardKind::kEstimator || right.kind == GuardKind::kEstimator;
  const bool has_plain = left.kind == GuardKind::kNumber || right.kind == GuardKind::kNumber;
  if (left.kind != right.kind && (has_estimator || !has_plain)) {
    fail(right.offset,
         fmt::format("{} cannot be compared with {}", name_of(left.kind), name_of(right.kind)));
    return false;
  }
  const auto how = static_cast<GuardComparison>(comparison);
  if (has_estimator && how != GuardComparison::kEqual && how != GuardComparison::kNotEqual) {
    fail(right.offset, "estimators have no order", "compare with == or !=");
    return false;
  }
  return true;
}

std::string GuardParser::found() const {
  if (token_ == Token::kEnd) return "the end";
  if (token_ == Token::kUnknown) {
    return fmt::format("'{}'", first_character(text_.substr(begin_)));
  }
  return fmt::format("'{}'", text_.substr(begin_, end_ - begin_));
}

std::nullopt_t GuardParser::fail(std::size_t offset, std::string message, std::string hint) {
  error_ = {offset, std::move(message), std::move(hint)};
  return std::nullopt;
}

int GuardParser::add(Guard::Node node) {
  guard_.nodes_.push_back(node);
  return static_cast<int>(guard_.nodes_.size()) - 1;
}

}  // namespace dive::mission
