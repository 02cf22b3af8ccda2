#pragma once
// Result files of a command: opened by common/output_file.h; here their errors become messages and
// exit statuses. Standard output: terminal.h.

#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "common/output_file.h"

namespace dive::mission {

/// What `--force` says about files that exist.
[[nodiscard]] inline Existing existing(bool force) {
  return force ? Existing::kReplace : Existing::kRefuse;
}

/// Prints the error, with what to do, and returns the exit status: 2 if the name cannot be used, 3
/// if the result could not be stored.
[[nodiscard]] int report(const OutputError& error);

/// A result that is written when the work is done.
using Result = std::optional<OutputFile>;

/// Opens a result before the work begins, and after the inputs were read, so that none is taken for
/// an output, in a folder that need not exist. No result if `path` is empty. Prints an error and
/// returns the exit status if it cannot be opened.
[[nodiscard]] tl::expected<Result, int> open_result(const std::string& path, bool force);

/// Writes the whole result, if there is one, and closes it; returns 0 or, after printing an error,
/// the exit status.
[[nodiscard]] int write_result(Result& result, std::string_view text);

/// Creates the folder of a file, and those above it.
void create_folder_of(const std::string& path);

}  // namespace dive::mission
