#include "mission/document/map_file.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxListed = 1000;  // of a folder, for a suggestion

bool is_beneath(const fs::path& path, const fs::path& folder) {
  const auto [in_folder, in_path] =
      std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return in_folder == folder.end() && in_path != path.end();
}

// The file of the same folder whose name is nearest.
std::string hint_for_missing(const fs::path& path) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(path.parent_path(), error), end;
       !error && it != end && names.size() < kMaxListed; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  if (error) return fmt::format("there is no folder {}", path.parent_path().string());
  std::sort(names.begin(), names.end());
  const std::optional<std::string> meant = closest_match(path.filename().string(), names);
  return meant ? fmt::format("did you mean '{}'?", *meant) : std::string();
}

}  // namespace

void resolve_map(Mission& mission, Diagnostics& diagnostics) {
  const std::string& written = mission.map_file.value;
  const auto outside = [&](const std::string& reason) {
    diagnostics.error("MIS-MAP-OUTSIDE", mission.source, mission.map_file.span, reason,
                      "copy the map beneath the mission's folder and name it relative to that");
  };
  if (fs::path(written).is_absolute()) return outside("the map is named by an absolute path");

  std::error_code error;
  const fs::path folder =
      fs::weakly_canonical(fs::absolute(mission.source.path()).parent_path(), error);
  const fs::path path = error ? fs::path() : fs::weakly_canonical(folder / written, error);
  if (error) {
    diagnostics.error("MIS-MAP-NOT-FOUND", mission.source, mission.map_file.span,
                      fmt::format("the map '{}' cannot be found: {}", written, error.message()));
    return;
  }
  if (!is_beneath(path, folder)) {
    return outside(fmt::format("the map '{}' lies outside of the mission's folder", written));
  }
  if (!fs::is_regular_file(path, error)) {
    diagnostics.error("MIS-MAP-NOT-FOUND", mission.source, mission.map_file.span,
                      fmt::format("there is no file '{}' beneath the mission's folder", written),
                      hint_for_missing(path));
    return;
  }
  mission.map_path = path.string();
}

}  // namespace dive::mission
