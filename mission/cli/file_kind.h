#pragma once
// The kind of a file, for commands that accept several, so that errors refer to that kind.

#include <string>

#include "common/diagnostic.h"

namespace dive::mission {

enum class FileKind { kUnknown, kMission, kScenario, kMap, kCloud, kLog, kBundle, kJson };

/// "a mission", "a map", ...
[[nodiscard]] const char* in_words(FileKind kind);

/// The kind from the first bytes of the file: the root element of XML, else the magic of a point
/// cloud, a log or a bundle, or the brace of a JSON object. kUnknown if the file cannot be read.
/// The rest of the file may be malformed.
[[nodiscard]] FileKind kind_of_file(const std::string& path);

/// For commands that read a text file of kind `expected`: false, with the error FILE-KIND, if the
/// file is a bundle or a log, which a reader of text would report by its first odd byte.
[[nodiscard]] bool is_text_of(FileKind expected, const std::string& path, Diagnostics& diagnostics);

}  // namespace dive::mission
