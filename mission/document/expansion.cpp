#include "mission/document/expansion.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "mission/document/current_table.h"
#include "mission/document/file_beneath.h"
#include "mission/document/language.h"
#include "mission/document/parameters.h"
#include "mission/document/source_place.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEmptyTagEnd = "/>";

bool names_a_table(const XmlElement& element) {
  return is_mission_element(element, "current") && element.attribute("table") != nullptr;
}

// The name as written, with its prefix.
std::string_view qualified_name(const SourceText& source, const XmlElement& element) {
  const std::string_view rest =
      std::string_view(source.content()).substr(offset_of(source, element.span));
  return rest.substr(0, rest.find_first_of(" \t\r\n/>"));
}

bool has_work(const XmlElement& element) {
  const auto names_a_parameter = [](const XmlAttribute& attribute) {
    return attribute.value.find(kParameterOpening) != std::string::npos;
  };
  return is_mission_element(element, "include") || is_mission_element(element, "parameters") ||
         names_a_table(element) ||
         std::any_of(element.attributes.begin(), element.attributes.end(), names_a_parameter) ||
         std::any_of(element.children.begin(), element.children.end(), has_work);
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

  // Sets the origin of the following text to a new line of its own.
  void turn_to(LineOrigin origin) {
    put("\n");
    runs_.push_back({line_, std::move(origin)});
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
        errors_before_(diagnostics.error_count()),
        parameters_(limits.max_bytes, diagnostics),
        output_(limits.max_bytes) {
    mission_.source = &mission;
    std::error_code error;
    mission_.path = fs::weakly_canonical(mission.path(), error);
    if (error) mission_.path = mission.path();
    folder_ = fs::weakly_canonical(fs::absolute(mission.path(), error).parent_path(), error);
  }

  // The expanded text of the mission; empty after an error.
  std::optional<SourceText> run(const XmlElement& root) {
    parameters_.declare(mission_, root, nullptr, {});
    output_.turn_to(mission_, 0);
    copy(mission_, root, 0, mission_.source->content().size());
    if (output_.is_full()) too_large(mission_, root);
    if (diagnostics_.error_count() > errors_before_) return std::nullopt;
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
      output_.put(parameters_.replaced(scope, begin, end));
      at = end;
    }
  }

  void copy_children(const Scope& scope, const XmlElement& element, std::size_t& at) {
    const bool is_root = scope.outer == nullptr ? is_mission_element(element, "mission")
                                                : is_mission_element(element, "fragment");
    for (const XmlElement& child : element.children) {
      const bool declares = is_root && is_mission_element(child, "parameters");
      if (declares || is_mission_element(child, "include")) {
        const ElementExtent extent = extent_of(*scope.source, child);
        put(scope, at, extent.begin);
        if (!declares) include(scope, child);
        at = extent.end;
        output_.turn_to(scope, at);
      } else if (names_a_table(child)) {
        const ElementExtent extent = extent_of(*scope.source, child);
        put(scope, at, extent.begin);
        replace_table(scope, child);
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
    error(scope, element.span,
          fmt::format("the mission becomes larger than {} KiB here", limits_.max_bytes / 1024));
  }

  void put(const Scope& scope, std::size_t begin, std::size_t end) {
    output_.put(std::string_view(scope.source->content()).substr(begin, end - begin));
  }

  void include(const Scope& scope, const XmlElement& element) {
    const bool is_understood =
        takes_only(diagnostics_, scope, element, kIncludeCode, {"href"}, "with");
    const XmlAttribute* href = element.attribute("href");
    if (href == nullptr) {
      error(scope, element.span, "'include' needs the attribute 'href'",
            "href is the path of a fragment, relative to this file");
    }
    if (!is_understood || href == nullptr || !may_include(scope, element)) return;
    const std::optional<fs::path> path = find(scope, *href);
    if (!path) return;
    const XmlDocument* fragment = fragment_at(*path);
    if (fragment == nullptr) return;  // reported when it was first read
    Scope inner;
    inner.source = &fragment->source;
    inner.path = *path;
    inner.included_from = fmt::format("{}:{}", scope.source->path(), element.span.line);
    inner.outer = &scope;
    if (!is_fragment(inner, fragment->root)) return;
    if (!parameters_.declare(inner, fragment->root, &element,
                             parameters_.passed_by(scope, element)))
      return;
    const ElementExtent extent = extent_of(fragment->source, fragment->root);
    output_.turn_to(inner, extent.content);
    copy(inner, fragment->root, extent.content, extent.content_end);
  }

  // The element without its `table`, and a line for each row with the origin of that row.
  void replace_table(const Scope& scope, const XmlElement& current) {
    const XmlAttribute& table = *current.attribute("table");
    const CurrentTableFolder folder{folder_, folder_of(scope), mission_.source->path()};
    const CurrentTable loaded =
        load_current_table(scope, current, expansion_.max_includes > 0, folder, diagnostics_);
    const ElementExtent extent = extent_of(*scope.source, current);
    const std::size_t begin = offset_of(*scope.source, table.name_span);
    XmlElement before = current;
    std::erase_if(before.attributes, [&](const XmlAttribute& attribute) {
      return offset_of(*scope.source, attribute.name_span) >= begin;
    });
    std::size_t at = extent.begin;
    copy_attributes(scope, before, at);
    put(scope, at, begin);
    at = offset_of(*scope.source, table.value_span) +
         static_cast<std::size_t>(table.value_span.length) + 1;
    output_.put(std::string(at - begin, ' '));
    copy_attributes(scope, current, at);
    put(scope, at, extent.content - kEmptyTagEnd.size());
    output_.put(">");
    const std::string_view name = qualified_name(*scope.source, current);
    const std::string_view prefix = name.substr(0, name.find(':') + 1);
    for (const CurrentTableRow& row : loaded.rows) {
      output_.turn_to(LineOrigin{loaded.path, row.line, loaded.included_from});
      output_.put(fmt::format("<{}sample time=\"{}\" speed=\"{}\" towards_deg=\"{}\"/>", prefix,
                              row.time, row.speed, row.towards_deg));
    }
    output_.put(fmt::format("</{}>", name));
  }

  bool may_include(const Scope& scope, const XmlElement& element) {
    int depth = 0;
    for (const Scope* outer = scope.outer; outer != nullptr; outer = outer->outer) ++depth;
    if (expansion_.max_includes == 0) {
      error(scope, element.span, "here nothing can be included: the text has no folder");
    } else if (++includes_ > expansion_.max_includes) {
      error(scope, element.span,
            fmt::format("more than {} fragments are included, counted each time",
                        expansion_.max_includes));
    } else if (depth >= expansion_.max_depth) {
      error(scope, element.span,
            fmt::format("fragments include each other more than {} deep", expansion_.max_depth));
    } else {
      return true;
    }
    return false;
  }

  std::optional<fs::path> find(const Scope& scope, const XmlAttribute& href) {
    if (href.value.find(kParameterOpening) != std::string::npos) {
      error(scope, href.value_span, "what is included cannot depend on a parameter",
            "write the path of the fragment");
      return std::nullopt;
    }
    const auto path = file_beneath(folder_, folder_of(scope), href.value, "fragment");
    if (!path) {
      error(scope, href.value_span, path.error().reason, path.error().hint);
      return std::nullopt;
    }
    for (const Scope* outer = &scope; outer != nullptr; outer = outer->outer) {
      if (outer->path != *path) continue;
      error(scope, href.value_span, fmt::format("'{}' includes itself", href.value));
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
    if (!is_mission_element(root, "fragment")) {
      error(scope, root.span,
            fmt::format("what is included must be a 'fragment', not a '{}'", root.name),
            fmt::format("put its content into <fragment xmlns=\"{}\">", kMissionNamespace));
      return false;
    }
    const std::size_t errors_before = diagnostics_.error_count();
    for (const XmlAttribute& attribute : root.attributes) {
      if (!attribute.namespace_uri.empty()) continue;
      error(scope, attribute.name_span,
            fmt::format("'fragment' has no attribute '{}'", attribute.name),
            "declare it in 'parameters'");
    }
    return diagnostics_.error_count() == errors_before;
  }

  void error(const Scope& scope, const Span& span, std::string message, std::string hint = {}) {
    add_error(diagnostics_, scope, kIncludeCode, span, std::move(message), std::move(hint));
  }

  const XmlLimits& limits_;
  const ExpansionLimits& expansion_;
  Diagnostics& diagnostics_;
  std::size_t errors_before_;
  ParameterReader parameters_;
  Output output_;
  Scope mission_;
  fs::path folder_;  // canonical folder of the mission: no file outside of it is read
  std::map<fs::path, std::optional<XmlDocument>> fragments_;
  int includes_ = 0;
  bool is_too_large_ = false;
};

}  // namespace

std::optional<XmlDocument> expand(XmlDocument document, const XmlLimits& limits,
                                  const ExpansionLimits& expansion, Diagnostics& diagnostics) {
  if (!is_mission_element(document.root, "mission") || !has_work(document.root)) return document;
  std::optional<SourceText> text =
      Expander(document.source, limits, expansion, diagnostics).run(document.root);
  if (!text) return std::nullopt;
  return parse_xml(std::move(*text), limits, diagnostics);
}

}  // namespace dive::mission
