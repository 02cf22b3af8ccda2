#pragma once
// Files that a mission names: none may lie outside of its folder.

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace dive::mission {

struct FileRefusal {
  bool is_outside = false;  ///< Else it is not there.
  std::string reason;       ///< A clause: "there is no file 'x.sdf' beneath ...".
  std::string hint;
};

/// The canonical path of the file called `written` in a file of the folder `from`, which must lie
/// beneath `folder`, symbolic links followed; both are absolute. `what` is what the file is to be:
/// "map".
[[nodiscard]] tl::expected<std::filesystem::path, FileRefusal> file_beneath(
    const std::filesystem::path& folder, const std::filesystem::path& from,
    const std::string& written, const std::string& what);

}  // namespace dive::mission
