#pragma once
// Files that a mission names: all must lie in its folder.

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace dive::mission {

struct FileRefusal {
  bool is_outside = false;  ///< False: the file does not exist.
  std::string reason;       ///< A clause: "there is no file 'x.sdf' beneath ...".
  std::string hint;
};

/// The canonical path of the file named `written` in a file of the folder `from`. It must lie
/// beneath `folder`, with symbolic links resolved; both folders are absolute. `what` names the kind
/// of file: "map".
[[nodiscard]] tl::expected<std::filesystem::path, FileRefusal> file_beneath(
    const std::filesystem::path& folder, const std::filesystem::path& from,
    const std::string& written, const std::string& what);

}  // namespace dive::mission
