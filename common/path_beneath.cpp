#include "common/path_beneath.h"

#include <algorithm>
#include <system_error>

namespace dive {

namespace fs = std::filesystem;

fs::path canonical_folder_of(const std::string& path) {
  std::error_code error;
  const fs::path all = fs::absolute(path, error);
  const fs::path folder = error ? fs::path() : fs::weakly_canonical(all.parent_path(), error);
  return error ? fs::path() : folder;
}

bool is_beneath(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(path, error);
  if (error || folder.empty()) return false;
  const auto [in_folder, in_path] =
      std::mismatch(folder.begin(), folder.end(), resolved.begin(), resolved.end());
  return in_folder == folder.end() && in_path != resolved.end();
}

}  // namespace dive
