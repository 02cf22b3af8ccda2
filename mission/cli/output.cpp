#include "mission/cli/output.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "mission/cli/commands.h"
#include "mission/cli/terminal.h"

namespace dive::mission {

int report(const OutputError& error) {
  const bool is_replaceable = error.kind == OutputError::Kind::kExists;
  complain(error.message + (is_replaceable ? "; give another name, or --force to replace it" : ""));
  return error.kind == OutputError::Kind::kNotKept ? kExitInternal : kExitUsage;
}

tl::expected<Result, int> open_result(const std::string& path, bool force) {
  if (path.empty()) return Result();
  create_folder_of(path);
  tl::expected<OutputFile, OutputError> file = OutputFile::create(path, existing(force));
  if (!file) return tl::unexpected(report(file.error()));
  return Result(std::move(*file));
}

int write_result(Result& result, std::string_view text) {
  if (!result) return kExitSuccess;
  tl::expected<void, OutputError> written = result->write(text);
  if (written) written = result->close();
  return written ? kExitSuccess : report(written.error());
}

void create_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;  // a problem with the folder is reported when the file is created
  if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
}

}  // namespace dive::mission
