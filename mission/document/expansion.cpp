#include "mission/document/expansion.h"

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"
#include "mission/document/file_beneath.h"
#include "mission/document/language.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInclude = "MIS-INCLUDE";
constexpr const char* kParameter = "MIS-PARAMETER";
constexpr std::string_view kOpening = "${";
constexpr std::size_t kMaxName = 32;
constexpr std::size_t kMaxValue = 4096;  // bounds the growth by parameters of parameters

// Values as written in the file between quotes, so that they can stand between other quotes.
using Values = std::map<std::string, std::string, std::less<>>;

// The value that an include passes to a fragment's parameter.
struct Gift {
  std::string value;
  const XmlElement* with = nullptr;
};
using Gifts = std::map<std::string, Gift, std::less<>>;

// A file that is being read, inside the file that includes it.
struct Scope {
  const SourceText* source = nullptr;
  fs::path path;  // canonical
  std::string included_from;
  const Scope* outer = nullptr;
  Values values;
};

bool is_ours(const XmlElement& element, std::string_view name) {
  return element.name == name && element.namespace_uri == kMissionNamespace;
}

bool is_name(std::string_view text) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && text.size() <= kMaxName && is_letter(text.front()) &&
         std::all_of(text.begin(), text.end(), [&](char c) { return is_letter(c) || is_digit(c); });
}

bool has_work(const XmlElement& element) {
  const auto names_a_parameter = [](const XmlAttribute& attribute) {
    return attribute.value.find(kOpening) != std::string::npos;
  };
  return is_ours(element, "include") || is_ours(element, "parameters") ||
         std::any_of(element.attributes.begin(), element.attributes.end(), names_a_parameter) ||
         std::any_of(element.children.begin(), element.children.end(), has_work);
}

std::vector<std::string> names_of(const Values& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  return names;
}

// The expanded text, and the origin of its lines.
class Output {
 public:
  explicit Output(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // Sets the origin of the following text to `offset` of the scope's file: on a new line, at the
  // same column.
  void turn_to(const Scope& scope, std::size_t offset) {
    const Span place = scope.source->span_at(offset, 0);
    if (!text_.empty()) put("\n");
    runs_.push_back({line_, {scope.source->path(), place.line, scope.included_from}});
    put(std::string(static_cast<std::size_t>(place.column - 1), ' '));
  }

  void put(std::string_view text) {
    if (text_.size() + text.size() > max_bytes_) {
      is_full_ = true;
      return;
    }
    text_ += text;
    line_ += static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  }

  [[nodiscard]] bool is_full() const { return is_full_; }

  SourceText take(const std::string& path) { return {path, std::move(text_), std::move(runs_)}; }

 private:
  std::size_t max_bytes_;
  std::string text_;
  std::vector<LineRun> runs_;
  int line_ = 1;
  bool is_full_ = false;
};

class Expander {
 public:
  Expander(const SourceText& mission, const XmlLimits& limits, const ExpansionLimits& expansion,
           Diagnostics& diagnostics)
      : limits_(limits),
        expansion_(expansion),
        diagnostics_(diagnostics),
        output_(limits.max_bytes) {
    mission_.source = &mission;
    std::error_code error;
    mission_.path = fs::weakly_canonical(mission.path(), error);
    if (error) mission_.path = mission.path();
    folder_ = fs::weakly_canonical(fs::absolute(mission.path(), error).parent_path(), error);
  }

  // The expanded text of the mission; empty after an error.
  std::optional<SourceText> run(const XmlElement& root) {
    declare(mission_, root, nullptr, {});
    output_.turn_to(mission_, 0);
    copy(mission_, root, 0, mission_.source->content().size());
    if (output_.is_full()) too_large(mission_, root);
    if (has_failed_) return std::nullopt;
    return output_.take(mission_.source->path());
  }

 private:
  // Copies bytes [begin, end) of the file, which hold `element` or its content.
  void copy(const Scope& scope, const XmlElement& element, std::size_t begin, std::size_t end) {
    std::size_t at = begin;
    copy_attributes(scope, element, at);
    copy_children(scope, element, at);
    put(scope, at, end);
  }

  // Copies up to the last value; does nothing if `at` lies past the start tag.
  void copy_attributes(const Scope& scope, const XmlElement& element, std::size_t& at) {
    std::vector<std::pair<std::size_t, std::size_t>> values;
    for (const XmlAttribute& attribute : element.attributes) {
      const std::size_t begin = offset_of(*scope.source, attribute.value_span);
      values.emplace_back(begin, begin + static_cast<std::size_t>(attribute.value_span.length));
    }
    std::sort(values.begin(), values.end());
    for (const auto& [begin, end] : values) {
      if (begin < at) continue;
      put(scope, at, begin);
      output_.put(filled_in(scope, begin, end));
      at = end;
    }
  }

  void copy_children(const Scope& scope, const XmlElement& element, std::size_t& at) {
    const bool is_root =
        scope.outer == nullptr ? is_ours(element, "mission") : is_ours(element, "fragment");
    for (const XmlElement& child : element.children) {
      const bool declares = is_root && is_ours(child, "parameters");
      if (declares || is_ours(child, "include")) {
        const ElementExtent extent = extent_of(*scope.source, child);
        put(scope, at, extent.begin);
        if (!declares) include(scope, child);
        at = extent.end;
        output_.turn_to(scope, at);
      } else {
        copy_attributes(scope, child, at);
        copy_children(scope, child, at);
      }
      if (output_.is_full()) return too_large(scope, child);
    }
  }

  void too_large(const Scope& scope, const XmlElement& element) {
    if (std::exchange(is_too_large_, true)) return;
    error(scope, kInclude, element.span,
          fmt::format("the mission becomes larger than {} KiB here", limits_.max_bytes / 1024));
  }

  void put(const Scope& scope, std::size_t begin, std::size_t end) {
    output_.put(std::string_view(scope.source->content()).substr(begin, end - begin));
  }

  void include(const Scope& scope, const XmlElement& element) {
    const bool is_understood = takes_only(scope, element, kInclude, {"href"}, "with");
    const XmlAttribute* href = element.attribute("href");
    if (href == nullptr) {
      error(scope, kInclude, element.span, "'include' needs the attribute 'href'",
            "href is the path of a fragment, relative to this file");
    }
    if (!is_understood || href == nullptr || !may_include(scope, element)) return;
    const std::optional<fs::path> path = find(scope, *href);
    if (!path) return;
    const XmlDocument* fragment = fragment_at(*path);
    if (fragment == nullptr) {
      has_failed_ = true;
      return;
    }
    Scope inner;
    inner.source = &fragment->source;
    inner.path = *path;
    inner.included_from = fmt::format("{}:{}", scope.source->path(), element.span.line);
    inner.outer = &scope;
    if (!is_fragment(inner, fragment->root)) return;
    if (!declare(inner, fragment->root, &element, given(scope, element))) return;
    const ElementExtent extent = extent_of(fragment->source, fragment->root);
    output_.turn_to(inner, extent.content);
    copy(inner, fragment->root, extent.content, extent.content_end);
  }

  bool may_include(const Scope& scope, const XmlElement& element) {
    int depth = 0;
    for (const Scope* outer = scope.outer; outer != nullptr; outer = outer->outer) ++depth;
    if (expansion_.max_includes == 0) {
      error(scope, kInclude, element.span, "here nothing can be included: the text has no folder");
    } else if (++includes_ > expansion_.max_includes) {
      error(scope, kInclude, element.span,
            fmt::format("more than {} fragments are included, counted each time",
                        expansion_.max_includes));
    } else if (depth >= expansion_.max_depth) {
      error(scope, kInclude, element.span,
            fmt::format("fragments include each other more than {} deep", expansion_.max_depth));
    } else {
      return true;
    }
    return false;
  }

  std::optional<fs::path> find(const Scope& scope, const XmlAttribute& href) {
    if (href.value.find(kOpening) != std::string::npos) {
      error(scope, kInclude, href.value_span, "what is included cannot depend on a parameter",
            "write the path of the fragment");
      return std::nullopt;
    }
    const auto path = file_beneath(folder_, folder_of(scope), href.value, "fragment");
    if (!path) {
      error(scope, kInclude, href.value_span, path.error().reason, path.error().hint);
      return std::nullopt;
    }
    for (const Scope* outer = &scope; outer != nullptr; outer = outer->outer) {
      if (outer->path != *path) continue;
      error(scope, kInclude, href.value_span,
            fmt::format("'{}' would include itself, for ever", href.value));
      return std::nullopt;
    }
    return *path;
  }

  // A fragment may be named by a symbolic link: its relative paths start at the link's target.
  fs::path folder_of(const Scope& scope) const {
    return scope.outer == nullptr ? folder_ : scope.path.parent_path();
  }

  const XmlDocument* fragment_at(const fs::path& path) {
    const auto known = fragments_.find(path);
    if (known != fragments_.end()) return known->second ? &*known->second : nullptr;
    const fs::path shown =
        fs::path(mission_.source->path()).parent_path() / path.lexically_relative(folder_);
    std::optional<XmlDocument>& fragment = fragments_[path];
    fragment = read_xml(shown.string(), limits_, diagnostics_);
    return fragment ? &*fragment : nullptr;
  }

  bool is_fragment(const Scope& scope, const XmlElement& root) {
    if (!is_ours(root, "fragment")) {
      error(scope, kInclude, root.span,
            fmt::format("what is included must be a 'fragment', not a '{}'", root.name),
            fmt::format("put its content into <fragment xmlns=\"{}\">", kMissionNamespace));
      return false;
    }
    const std::size_t errors_before = diagnostics_.error_count();
    for (const XmlAttribute& attribute : root.attributes) {
      if (!attribute.namespace_uri.empty()) continue;
      error(scope, kInclude, attribute.name_span,
            fmt::format("'fragment' has no attribute '{}'", attribute.name),
            "declare it in 'parameters'");
    }
    return diagnostics_.error_count() == errors_before;
  }

  // The values that an include passes, by name.
  Gifts given(const Scope& scope, const XmlElement& include) {
    Gifts given;
    for (const XmlElement& with : include.children) {
      if (!is_ours(with, "with")) continue;
      const std::optional<Named> named = read_named(scope, with);
      if (!named) continue;
      if (named->value == nullptr) {
        error(scope, kParameter, with.span, "'with' needs the attribute 'value'");
      } else if (!given.emplace(named->name, Gift{value_of(scope, *named->value), &with}).second) {
        error(scope, kParameter, with.span,
              fmt::format("the parameter '{}' is given twice", named->name));
      }
    }
    return given;
  }

  // Reads the file's declarations into the scope. `include` is the element that includes it;
  // nullptr for a mission, which receives no values.
  bool declare(Scope& scope, const XmlElement& root, const XmlElement* include,
               const Gifts& given) {
    const std::size_t errors_before = diagnostics_.error_count();
    const XmlElement* seen = nullptr;
    for (const XmlElement& parameters : root.children) {
      if (!is_ours(parameters, "parameters")) continue;
      if (std::exchange(seen, &parameters) != nullptr) {
        error(scope, kParameter, parameters.span, "'parameters' stands more than once");
        continue;
      }
      takes_only(scope, parameters, kParameter, {}, "parameter");
      for (const XmlElement& parameter : parameters.children) {
        if (is_ours(parameter, "parameter")) declare_one(scope, parameter, include, given);
      }
    }
    for (const auto& [name, gift] : given) {
      if (scope.values.contains(name)) continue;
      error(*scope.outer, kParameter, gift.with->span,
            fmt::format("{} has no parameter '{}'", scope.source->path(), name),
            did_you_mean(name, names_of(scope.values)));
    }
    return diagnostics_.error_count() == errors_before;
  }

  void declare_one(Scope& scope, const XmlElement& parameter, const XmlElement* include,
                   const Gifts& given) {
    const std::optional<Named> named = read_named(scope, parameter);
    if (!named) return;
    std::string value;
    if (const auto found = given.find(named->name); found != given.end()) {
      value = found->second.value;
    } else if (named->value != nullptr) {
      value = value_of(scope, *named->value);
    } else if (include == nullptr) {
      error(scope, kParameter, parameter.span, "a mission's parameter needs the attribute 'value'");
    } else {
      error(*scope.outer, kParameter, include->span,
            fmt::format("{} needs the parameter '{}'", scope.source->path(), named->name),
            fmt::format("write <with name=\"{}\" value=\"...\"/> into it", named->name));
    }
    if (!scope.values.emplace(named->name, std::move(value)).second) {
      error(scope, kParameter, parameter.span,
            fmt::format("the parameter '{}' is declared twice", named->name));
    }
  }

  struct Named {
    std::string name;
    const XmlAttribute* value = nullptr;
  };

  // The name and value of a 'with' or a 'parameter'.
  std::optional<Named> read_named(const Scope& scope, const XmlElement& element) {
    if (!takes_only(scope, element, kParameter, {"name", "value"}, {})) return std::nullopt;
    const XmlAttribute* name = element.attribute("name");
    if (name == nullptr) {
      error(scope, kParameter, element.span,
            fmt::format("'{}' needs the attribute 'name'", element.name));
      return std::nullopt;
    }
    if (!is_name(name->value)) {
      error(scope, kParameter, name->value_span,
            fmt::format("a parameter's name is 1 to {} letters, digits and '_', and does not begin "
                        "with a digit",
                        kMaxName));
      return std::nullopt;
    }
    return Named{name->value, element.attribute("value")};
  }

  // The value with its own parameters replaced, escaped for any quotes.
  std::string value_of(const Scope& scope, const XmlAttribute& attribute) {
    const std::size_t begin = offset_of(*scope.source, attribute.value_span);
    const std::string raw =
        filled_in(scope, begin, begin + static_cast<std::size_t>(attribute.value_span.length));
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
      error(scope, kParameter, attribute.value_span,
            fmt::format("the value becomes longer than {} bytes", kMaxValue));
      value.clear();
    }
    return value;
  }

  // Bytes [begin, end) of a value with every ${name} replaced.
  std::string filled_in(const Scope& scope, std::size_t begin, std::size_t end) {
    const std::string_view text = std::string_view(scope.source->content()).substr(0, end);
    std::string result;
    while (begin < end && result.size() <= limits_.max_bytes) {
      const std::size_t opening = std::min(text.find(kOpening, begin), end);
      result += text.substr(begin, opening - begin);
      if (opening == end) break;
      const std::size_t closing = text.find('}', opening);
      if (closing == std::string_view::npos) {
        error(scope, kParameter, scope.source->span_at(opening, kOpening.size()),
              "'${' is not closed",
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

  void unknown_parameter(const Scope& scope, std::size_t opening, std::string_view name) {
    const std::vector<std::string> known = names_of(scope.values);
    std::string hint = did_you_mean(name, known);
    if (hint.empty()) hint = "declare it in 'parameters' of this file";
    error(scope, kParameter, scope.source->span_at(opening, name.size() + 3),
          known.empty() ? fmt::format("there is no parameter '{}' here; there is none", name)
                        : fmt::format("there is no parameter '{}' here; there is {}", name,
                                      fmt::join(known, ", ")),
          std::move(hint));
  }

  // No unknown attribute or element may be ignored silently.
  bool takes_only(const Scope& scope, const XmlElement& element, const char* code,
                  std::initializer_list<std::string> attributes, std::string_view child_name) {
    const std::size_t errors_before = diagnostics_.error_count();
    const std::vector<std::string> known(attributes);
    for (const XmlAttribute& attribute : element.attributes) {
      if (std::find(known.begin(), known.end(), attribute.name) != known.end()) continue;
      error(scope, code, attribute.name_span,
            fmt::format("'{}' has no attribute '{}'", element.name, attribute.name),
            did_you_mean(attribute.name, known));
    }
    for (const XmlElement& child : element.children) {
      if (is_ours(child, child_name)) continue;
      error(scope, code, child.span,
            child_name.empty()
                ? fmt::format("'{}' may not stand in '{}': nothing may", child.name, element.name)
                : fmt::format("'{}' may not stand in '{}': only '{}' may", child.name, element.name,
                              child_name));
    }
    if (!element.text.empty()) {
      error(scope, code, place_of_text(*scope.source, element),
            fmt::format("text may not stand in '{}'", element.name));
    }
    return diagnostics_.error_count() == errors_before;
  }

  void error(const Scope& scope, const char* code, const Span& span, std::string message,
             std::string hint = {}) {
    has_failed_ = true;
    diagnostics_.add({code, Severity::kError, scope.source->path(), span, std::move(message),
                      std::move(hint), std::string(scope.source->line(span.line)),
                      scope.included_from});
  }

  const XmlLimits& limits_;
  const ExpansionLimits& expansion_;
  Diagnostics& diagnostics_;
  Output output_;
  Scope mission_;
  fs::path folder_;  // canonical folder of the mission: no file outside of it is read
  std::map<fs::path, std::optional<XmlDocument>> fragments_;
  int includes_ = 0;
  bool is_too_large_ = false;
  bool has_failed_ = false;
};

}  // namespace

std::optional<XmlDocument> expand(XmlDocument document, const XmlLimits& limits,
                                  const ExpansionLimits& expansion, Diagnostics& diagnostics) {
  if (!is_ours(document.root, "mission") || !has_work(document.root)) return document;
  std::optional<SourceText> text =
      Expander(document.source, limits, expansion, diagnostics).run(document.root);
  if (!text) return std::nullopt;
  return parse_xml(std::move(*text), limits, diagnostics);
}

}  // namespace dive::mission
