#include "mission/document/file_beneath.h"

#include <algorithm>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "common/path_beneath.h"
#include "common/suggest.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;

// maximum number of files of a folder compared for a suggestion
constexpr std::size_t kMaxListed = 1000;

// The file of the same folder with the closest name.
std::string hint_for_missing(const fs::path& path) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(path.parent_path(), error), end;
       !error && it != end && names.size() < kMaxListed; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  if (error) return fmt::format("there is no folder {}", path.parent_path().string());
  std::sort(names.begin(), names.end());
  return did_you_mean(path.filename().string(), names);
}

}  // namespace

tl::expected<fs::path, FileRefusal> file_beneath(const fs::path& folder, const fs::path& from,
                                                 const std::string& written,
                                                 const std::string& what) {
  const auto outside = [&](std::string reason) {
    return tl::unexpected(FileRefusal{
        true, std::move(reason),
        fmt::format("copy the {} beneath the mission's folder and name it relative to that",
                    what)});
  };
  if (fs::path(written).is_absolute()) {
    return outside(fmt::format("the {} is named by an absolute path", what));
  }
  std::error_code error;
  const fs::path root = fs::weakly_canonical(folder, error);
  const fs::path path = error ? fs::path() : fs::weakly_canonical(from / written, error);
  if (error) {
    return tl::unexpected(FileRefusal{
        false, fmt::format("the {} '{}' cannot be found: {}", what, written, error.message()), {}});
  }
  if (!is_beneath(path, root)) {
    return outside(fmt::format("the {} '{}' lies outside of the mission's folder", what, written));
  }
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return tl::unexpected(FileRefusal{
        false,
        fmt::format("'{}' is a folder, a pipe or a device: a regular file is expected", written),
        {}});
  }
  if (!fs::is_regular_file(status)) {
    return tl::unexpected(FileRefusal{
        false, fmt::format("there is no file '{}' beneath the mission's folder", written),
        hint_for_missing(path)});
  }
  return path;
}

}  // namespace dive::mission
