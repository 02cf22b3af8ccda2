#include "mission/document/parameters.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/document/language.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

constexpr std::size_t kMaxName = 32;
constexpr std::size_t kMaxValue = 4096;  // bounds the growth by parameters of parameters

bool is_name(std::string_view text) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && text.size() <= kMaxName && is_letter(text.front()) &&
         std::all_of(text.begin(), text.end(), [&](char c) { return is_letter(c) || is_digit(c); });
}

std::vector<std::string> names_of(const ParameterValues& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  return names;
}

}  // namespace

bool is_mission_element(const XmlElement& element, std::string_view name) {
  return element.name == name && element.namespace_uri == kMissionNamespace;
}

void add_error(Diagnostics& diagnostics, const Scope& scope, const char* code, const Span& span,
               std::string message, std::string hint) {
  diagnostics.add({code, Severity::kError, scope.source->path(), span, std::move(message),
                   std::move(hint), std::string(scope.source->line(span.line)),
                   scope.included_from});
}

bool takes_only(Diagnostics& diagnostics, const Scope& scope, const XmlElement& element,
                const char* code, std::initializer_list<std::string> attributes,
                std::string_view child_name) {
  const std::size_t errors_before = diagnostics.error_count();
  const std::vector<std::string> known(attributes);
  for (const XmlAttribute& attribute : element.attributes) {
    if (std::find(known.begin(), known.end(), attribute.name) != known.end()) continue;
    add_error(diagnostics, scope, code, attribute.name_span,
              fmt::format("'{}' has no attribute '{}'", element.name, attribute.name),
              did_you_mean(attribute.name, known));
  }
  for (const XmlElement& child : element.children) {
    if (is_mission_element(child, child_name)) continue;
    add_error(diagnostics, scope, code, child.span,
              child_name.empty()
                  ? fmt::format("'{}' may not stand in '{}': nothing may", child.name, element.name)
                  : fmt::format("'{}' may not stand in '{}': only '{}' may", child.name,
                                element.name, child_name));
  }
  if (!element.text.empty()) {
    add_error(diagnostics, scope, code, place_of_text(*scope.source, element),
              fmt::format("text may not stand in '{}'", element.name));
  }
  return diagnostics.error_count() == errors_before;
}

PassedValues ParameterReader::passed_by(const Scope& scope, const XmlElement& include) {
  PassedValues passed;
  for (const XmlElement& with : include.children) {
    if (!is_mission_element(with, "with")) continue;
    const std::optional<Named> named = read_named(scope, with);
    if (!named) continue;
    if (named->value == nullptr) {
      error(scope, with.span, "'with' needs the attribute 'value'");
    } else if (!passed.emplace(named->name, PassedValue{value_of(scope, *named->value), &with})
                    .second) {
      error(scope, with.span, fmt::format("the parameter '{}' is given twice", named->name));
    }
  }
  return passed;
}

bool ParameterReader::declare(Scope& scope, const XmlElement& root, const XmlElement* include,
                              const PassedValues& passed) {
  const std::size_t errors_before = diagnostics_.error_count();
  const XmlElement* seen = nullptr;
  for (const XmlElement& parameters : root.children) {
    if (!is_mission_element(parameters, "parameters")) continue;
    if (std::exchange(seen, &parameters) != nullptr) {
      error(scope, parameters.span, "'parameters' stands more than once");
      continue;
    }
    takes_only(diagnostics_, scope, parameters, kParameterCode, {}, "parameter");
    for (const XmlElement& parameter : parameters.children) {
      if (is_mission_element(parameter, "parameter"))
        declare_one(scope, parameter, include, passed);
    }
  }
  for (const auto& [name, value] : passed) {
    if (scope.values.contains(name)) continue;
    error(*scope.outer, value.with->span,
          fmt::format("{} has no parameter '{}'", scope.source->path(), name),
          did_you_mean(name, names_of(scope.values)));
  }
  return diagnostics_.error_count() == errors_before;
}

void ParameterReader::declare_one(Scope& scope, const XmlElement& parameter,
                                  const XmlElement* include, const PassedValues& passed) {
  const std::optional<Named> named = read_named(scope, parameter);
  if (!named) return;
  std::string value;
  if (const auto found = passed.find(named->name); found != passed.end()) {
    value = found->second.value;
  } else if (named->value != nullptr) {
    value = value_of(scope, *named->value);
  } else if (include == nullptr) {
    error(scope, parameter.span, "a mission's parameter needs the attribute 'value'");
  } else {
    error(*scope.outer, include->span,
          fmt::format("{} needs the parameter '{}'", scope.source->path(), named->name),
          fmt::format("write <with name=\"{}\" value=\"...\"/> into it", named->name));
  }
  if (!scope.values.emplace(named->name, std::move(value)).second) {
    error(scope, parameter.span, fmt::format("the parameter '{}' is declared twice", named->name));
  }
}

// The name and value of a 'with' or a 'parameter'.
std::optional<ParameterReader::Named> ParameterReader::read_named(const Scope& scope,
                                                                  const XmlElement& element) {
  if (!takes_only(diagnostics_, scope, element, kParameterCode, {"name", "value"}, {}))
    return std::nullopt;
  const XmlAttribute* name = element.attribute("name");
  if (name == nullptr) {
    error(scope, element.span, fmt::format("'{}' needs the attribute 'name'", element.name));
    return std::nullopt;
  }
  if (!is_name(name->value)) {
    error(scope, name->value_span,
          fmt::format("a parameter's name is 1 to {} letters, digits and '_', and does not begin "
                      "with a digit",
                      kMaxName));
    return std::nullopt;
  }
  return Named{name->value, element.attribute("value")};
}

// The value with its own parameters replaced, escaped for any quotes.
std::string ParameterReader::value_of(const Scope& scope, const XmlAttribute& attribute) {
  const std::size_t begin = offset_of(*scope.source, attribute.value_span);
  const std::string raw =
      replaced(scope, begin, begin + static_cast<std::size_t>(attribute.value_span.length));
  std::string value;
  for (const char c : raw) {
    if (c == '"') {
      value += "&quot;";
    } else if (c == '\'') {
      value += "&apos;";
    } else {
      value += c == '\n' || c == '\r' || c == '\t' ? ' ' : c;  // as XML normalises it
    }
  }
  if (value.size() > kMaxValue) {
    error(scope, attribute.value_span,
          fmt::format("the value becomes longer than {} bytes", kMaxValue));
    value.clear();
  }
  return value;
}

std::string ParameterReader::replaced(const Scope& scope, std::size_t begin, std::size_t end) {
  const std::string_view text = std::string_view(scope.source->content()).substr(0, end);
  std::string result;
  while (begin < end && result.size() <= max_bytes_) {
    const std::size_t opening = std::min(text.find(kParameterOpening, begin), end);
    result += text.substr(begin, opening - begin);
    if (opening == end) break;
    const std::size_t closing = text.find('}', opening);
    if (closing == std::string_view::npos) {
      error(scope, scope.source->span_at(opening, kParameterOpening.size()), "'${' is not closed",
            "write ${name} for a parameter, and &#36;{ for the two characters");
      break;
    }
    const std::string_view name = text.substr(opening + 2, closing - opening - 2);
    if (const auto value = scope.values.find(name); value != scope.values.end()) {
      result += value->second;
    } else {
      unknown_parameter(scope, opening, name);
    }
    begin = closing + 1;
  }
  return result;
}

void ParameterReader::unknown_parameter(const Scope& scope, std::size_t opening,
                                        std::string_view name) {
  const std::vector<std::string> known = names_of(scope.values);
  std::string hint = did_you_mean(name, known);
  if (hint.empty()) hint = "declare it in 'parameters' of this file";
  error(scope, scope.source->span_at(opening, name.size() + 3),
        known.empty() ? fmt::format("there is no parameter '{}' here; none is declared", name)
                      : fmt::format("there is no parameter '{}' here; there is {}", name,
                                    fmt::join(known, ", ")),
        std::move(hint));
}

void ParameterReader::error(const Scope& scope, const Span& span, std::string message,
                            std::string hint) {
  add_error(diagnostics_, scope, kParameterCode, span, std::move(message), std::move(hint));
}

}  // namespace dive::mission
