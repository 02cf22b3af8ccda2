#pragma once
// Parameters of missions and fragments: their declaration, the values that an include passes, and
// ${name} replaced by its value.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/diagnostic.h"
#include "common/source_text.h"
#include "common/xml.h"

namespace dive::mission {

inline constexpr const char* kIncludeCode = "MIS-INCLUDE";
inline constexpr const char* kParameterCode = "MIS-PARAMETER";

/// What begins a parameter in a value; '}' ends it.
inline constexpr std::string_view kParameterOpening = "${";

/// Values as written in the file between quotes, so that they can stand between other quotes.
using ParameterValues = std::map<std::string, std::string, std::less<>>;

/// A value that an include passes to a fragment's parameter.
struct PassedValue {
  std::string value;
  const XmlElement* with = nullptr;  ///< The element that passes it.
};
using PassedValues = std::map<std::string, PassedValue, std::less<>>;

/// A file that is being read, inside the file that includes it.
struct Scope {
  const SourceText* source = nullptr;
  std::filesystem::path path;  ///< Canonical path.
  std::string included_from;   ///< Place of the include, FILE:LINE; empty for a mission.
  const Scope* outer = nullptr;
  ParameterValues values;
};

/// True for an element of this name in the namespace of missions.
[[nodiscard]] bool is_mission_element(const XmlElement& element, std::string_view name);

/// Adds an error at `span` of the scope's file.
void add_error(Diagnostics& diagnostics, const Scope& scope, const char* code, const Span& span,
               std::string message, std::string hint = {});

/// False, with an error each, if the element has an unknown attribute, a child other than
/// `child_name`, or text: nothing may be ignored silently.
bool takes_only(Diagnostics& diagnostics, const Scope& scope, const XmlElement& element,
                const char* code, std::initializer_list<std::string> attributes,
                std::string_view child_name);

/// Reads parameters into scopes. Errors: MIS-PARAMETER.
class ParameterReader {
 public:
  /// No value may become longer than `max_bytes`. `diagnostics` must live longer.
  ParameterReader(std::size_t max_bytes, Diagnostics& diagnostics)
      : max_bytes_(max_bytes), diagnostics_(diagnostics) {}

  /// The values that an include passes, by name.
  [[nodiscard]] PassedValues passed_by(const Scope& scope, const XmlElement& include);

  /// Reads the file's declarations into the scope. `include` is the element that includes it;
  /// nullptr for a mission, which receives no values. False after an error.
  bool declare(Scope& scope, const XmlElement& root, const XmlElement* include,
               const PassedValues& passed);

  /// Bytes [begin, end) of a value with every ${name} replaced.
  [[nodiscard]] std::string replaced(const Scope& scope, std::size_t begin, std::size_t end);

 private:
  struct Named {
    std::string name;
    const XmlAttribute* value = nullptr;
  };

  void declare_one(Scope& scope, const XmlElement& parameter, const XmlElement* include,
                   const PassedValues& passed);
  [[nodiscard]] std::optional<Named> read_named(const Scope& scope, const XmlElement& element);
  [[nodiscard]] std::string value_of(const Scope& scope, const XmlAttribute& attribute);
  void unknown_parameter(const Scope& scope, std::size_t opening, std::string_view name);
  void error(const Scope& scope, const Span& span, std::string message, std::string hint = {});

  std::size_t max_bytes_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::mission
