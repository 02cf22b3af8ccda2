#include "mission/document/guard.h"

#include <array>
#include <set>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/guard_parser.h"
#include "mission/document/guard_table.h"

namespace dive::mission {
namespace {

bool compare(GuardComparison comparison, double left, double right) {
  switch (comparison) {
    case GuardComparison::kLess:
      return left < right;
    case GuardComparison::kLessEqual:
      return left <= right;
    case GuardComparison::kGreater:
      return left > right;
    case GuardComparison::kGreaterEqual:
      return left >= right;
    case GuardComparison::kEqual:
      return left == right;
    case GuardComparison::kNotEqual:
      return left != right;
  }
  DIVE_DEMAND(false);
}

}  // namespace

std::optional<Guard> Guard::parse(std::string_view text, Error& error) {
  return GuardParser(text, error).parse();
}

// Children precede their parents, so one pass from front to back evaluates the tree; truth is 0 or
// 1. No short-circuit evaluation: there are no side effects to avoid.
bool Guard::evaluate(const GuardVariables& variables) const {
  std::array<double, kMaxLength> values;
  DIVE_DEMAND(!nodes_.empty() && nodes_.size() <= values.size());
  const auto truth = [&values](int node) { return values[static_cast<std::size_t>(node)] != 0.0; };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    switch (node.kind) {
      case Node::Kind::kNumber:
        values[i] = node.number;
        break;
      case Node::Kind::kVariable:
        values[i] = kGuardVariables[static_cast<std::size_t>(node.index)].value(variables);
        break;
      case Node::Kind::kCompare:
        values[i] = compare(static_cast<GuardComparison>(node.index),
                            values[static_cast<std::size_t>(node.left)],
                            values[static_cast<std::size_t>(node.right)])
                        ? 1.0
                        : 0.0;
        break;
      case Node::Kind::kAnd:
        values[i] = truth(node.left) && truth(node.right) ? 1.0 : 0.0;
        break;
      case Node::Kind::kOr:
        values[i] = truth(node.left) || truth(node.right) ? 1.0 : 0.0;
        break;
      case Node::Kind::kNot:
        values[i] = truth(node.left) ? 0.0 : 1.0;
        break;
    }
  }
  return values[nodes_.size() - 1] != 0.0;
}

std::string Guard::script() const {
  std::vector<std::string> parts;
  const auto part = [&parts](int node) { return parts[static_cast<std::size_t>(node)]; };
  for (const Node& node : nodes_) {
    switch (node.kind) {
      case Node::Kind::kNumber:
        parts.push_back(fmt::format("{}", node.number));
        break;
      case Node::Kind::kVariable:
        parts.emplace_back(kGuardVariables[static_cast<std::size_t>(node.index)].name);
        break;
      case Node::Kind::kCompare:
        parts.push_back(fmt::format("({} {} {})", part(node.left),
                                    kGuardComparisons[static_cast<std::size_t>(node.index)],
                                    part(node.right)));
        break;
      case Node::Kind::kAnd:
        parts.push_back(fmt::format("({} && {})", part(node.left), part(node.right)));
        break;
      case Node::Kind::kOr:
        parts.push_back(fmt::format("({} || {})", part(node.left), part(node.right)));
        break;
      case Node::Kind::kNot:
        parts.push_back(fmt::format("(!{})", part(node.left)));
        break;
    }
  }
  return parts.back();
}

std::vector<std::pair<std::string, std::string>> Guard::script_variables() {
  std::vector<std::pair<std::string, std::string>> variables;
  for (const GuardVariable& variable : kGuardVariables) {
    variables.emplace_back(variable.name, variable.kind == GuardKind::kTruth ? "false" : "0");
  }
  return variables;
}

std::string Guard::describe(const GuardVariables& variables) const {
  std::set<int> named;
  std::string text;
  for (const Node& node : nodes_) {
    if (node.kind != Node::Kind::kVariable || !named.insert(node.index).second) continue;
    const GuardVariable& variable = kGuardVariables[static_cast<std::size_t>(node.index)];
    const double value = variable.value(variables);
    if (!text.empty()) text += ", ";
    switch (variable.kind) {
      case GuardKind::kTruth:
        text += fmt::format("{} {}", variable.name, value != 0.0);
        break;
      case GuardKind::kEstimator:
        for (const GuardConstant& constant : kGuardConstants) {
          if (constant.value == value) text += fmt::format("{} {}", variable.name, constant.name);
        }
        break;
      default:
        text += fmt::format("{} {:.2f}", variable.name, value);
    }
  }
  return text;
}

}  // namespace dive::mission
