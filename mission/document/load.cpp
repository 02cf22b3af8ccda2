#include <string_view>
#include <utility>

#include "mission/document/expansion.h"
#include "mission/document/language.h"
#include "mission/document/map_file.h"
#include "mission/document/mission.h"
#include "mission/document/reader.h"
#include "mission/document/rules.h"
#include "mission/document/schema.h"

namespace dive::mission {
namespace {

constexpr XmlLimits kLimits{};
constexpr ExpansionLimits kExpansion{};
constexpr ExpansionLimits kNoIncludes{.max_includes = 0, .max_depth = 0};

// The XML parser's message for a condition with a bare '<'.
constexpr std::string_view kBareLessThan = "Unescaped '<' not allowed in attributes";

// Passes on the XML reader's findings, with hints for frequent mistakes in missions.
void hand_on(const Diagnostics& found, Diagnostics& diagnostics) {
  for (Diagnostic diagnostic : found.list()) {
    if (diagnostic.message.find(kBareLessThan) != std::string::npos) {
      diagnostic.hint = "inside a value write &lt; for <";
    }
    diagnostics.add(std::move(diagnostic));
  }
}

std::optional<Mission> from_document(XmlDocument written, MapFile map_file,
                                     Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  const bool has_folder = map_file == MapFile::kMustExist;
  std::optional<XmlDocument> document =
      expand(std::move(written), kLimits, has_folder ? kExpansion : kNoIncludes, diagnostics);
  const Language language(mission_schema());
  if (!document || !check_schema(*document, language, diagnostics)) {
    diagnostics.sort();
    return std::nullopt;
  }
  Mission mission = read_mission(std::move(*document), language, diagnostics);
  if (has_folder) resolve_maps(mission, diagnostics);
  check_rules(mission, diagnostics);
  diagnostics.sort();
  if (diagnostics.error_count() != errors_before) return std::nullopt;
  return mission;
}

}  // namespace

std::optional<Mission> load_mission(const std::string& path, Diagnostics& diagnostics) {
  Diagnostics found;
  std::optional<XmlDocument> document = read_xml(path, kLimits, found);
  hand_on(found, diagnostics);
  if (!document) return std::nullopt;
  return from_document(std::move(*document), MapFile::kMustExist, diagnostics);
}

std::optional<Mission> parse_mission(SourceText source, Diagnostics& diagnostics,
                                     MapFile map_file) {
  Diagnostics found;
  std::optional<XmlDocument> document = parse_xml(std::move(source), kLimits, found);
  hand_on(found, diagnostics);
  if (!document) return std::nullopt;
  return from_document(std::move(*document), map_file, diagnostics);
}

}  // namespace dive::mission
