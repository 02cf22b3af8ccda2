#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/assert.h"
#include "common/diagnostic.h"
#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/document/mission.h"

namespace dive::mission {

// Embedded from missions/templates/: CMakeLists.txt.
extern const char kNewTransect[];
extern const char kNewTransectMap[];
extern const char kNewPenetration[];
extern const char kNewPenetrationMap[];
extern const char kNewGoals[];
extern const char kNewGoalsMap[];

namespace {

struct Template {
  std::string_view kind;
  const char* mission;
  const char* map;
};

const std::array<Template, 3> kTemplates = {{
    {"transect", kNewTransect, kNewTransectMap},
    {"penetration", kNewPenetration, kNewPenetrationMap},
    {"goals", kNewGoals, kNewGoalsMap},
}};

// The text with the name of the mission in place of @NAME@.
std::string named(std::string_view text, const std::string& name) {
  constexpr std::string_view kPlace = "@NAME@";
  std::string result;
  for (std::size_t at = text.find(kPlace); at != std::string_view::npos; at = text.find(kPlace)) {
    result += text.substr(0, at);
    result += name;
    text.remove_prefix(at + kPlace.size());
  }
  result += text;
  return result;
}

// The schema says what a mission's id is.
bool is_id(const std::string& name, const Template& kind) {
  Diagnostics diagnostics;
  const std::optional<Mission> mission =
      parse_mission({name, named(kind.mission, name)}, diagnostics, MapFile::kNotNeeded);
  return mission && mission->id == name;
}

}  // namespace

int run_new(const NewArguments& arguments) {
  const auto* kind = std::ranges::find(kTemplates, arguments.kind, &Template::kind);
  DIVE_DEMAND(kind != kTemplates.end());  // the option admits no other
  const std::filesystem::path path =
      arguments.file.empty() ? arguments.kind + ".xml" : arguments.file;
  const std::string name = path.stem().string();
  if (path.extension() != ".xml" || !is_id(name, *kind)) {
    complain(
        fmt::format("{}: name the file ID.xml; ID becomes the mission's id: at most 64 letters, "
                    "digits, '-' and '_', beginning with a letter",
                    path.string()));
    return kExitUsage;
  }
  const std::string map_path = std::filesystem::path(path).replace_extension(".sdf").string();
  tl::expected<Result, int> mission = open_result(path.string(), arguments.force);
  if (!mission) return mission.error();
  tl::expected<Result, int> map = open_result(map_path, arguments.force);
  if (!map) return map.error();
  if (const int status = write_result(*map, named(kind->map, name))) return status;
  if (const int status = write_result(*mission, named(kind->mission, name))) return status;
  if (arguments.json) {
    print_json({{"mission", path.string()}, {"map", map_path}});
  } else {
    print(fmt::format("{} and {}; next: dive check {}", path.string(), map_path, path.string()));
  }
  return kExitSuccess;
}

}  // namespace dive::mission
