#pragma once
// The kind of a file, for commands that accept several, so that errors refer to that kind.

#include <string>

namespace dive::mission {

enum class FileKind { kUnknown, kMission, kScenario, kMap, kCloud, kLog, kBundle, kJson };

/// "a mission", "a map", ...
[[nodiscard]] const char* in_words(FileKind kind);

/// The kind from the first bytes of the file: the root element of XML, else the magic of a point
/// cloud, a log or a bundle, or the brace of a JSON object. kUnknown if the file cannot be read.
/// The rest of the file may be malformed.
[[nodiscard]] FileKind kind_of_file(const std::string& path);

}  // namespace dive::mission
