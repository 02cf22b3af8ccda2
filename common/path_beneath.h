#pragma once
// Whether files lie in a folder, with symbolic links resolved.

#include <filesystem>
#include <string>

namespace dive {

/// The canonical folder that contains `path`; empty if it cannot be resolved.
[[nodiscard]] std::filesystem::path canonical_folder_of(const std::string& path);

/// True if `path`, resolved, lies beneath the canonical folder `folder`, at any depth. False if it
/// cannot be resolved, and for an empty folder.
[[nodiscard]] bool is_beneath(const std::filesystem::path& path,
                              const std::filesystem::path& folder);

}  // namespace dive
