#pragma once
// The tables of the mission files in test/mission/malformed and test/mission/accepted.

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace dive::mission::testing {

struct Expected {
  std::string code;
  int line = 0;
  std::string phrase;  ///< Part of the message or hint.
};

struct MissionFile {
  std::string folder;  ///< "malformed" or "accepted"
  std::string name;
  std::vector<Expected> expected;

  [[nodiscard]] std::string path() const {
    return std::string(DIVE_SOURCE_DIR) + "/test/mission/" + folder + "/" + name;
  }
};

/// For GoogleTest's messages.
inline void PrintTo(const MissionFile& file, std::ostream* stream) { *stream << file.path(); }

inline std::vector<MissionFile> mission_files(const std::string& folder) {
  std::vector<MissionFile> files;
  std::ifstream table(std::string(DIVE_SOURCE_DIR) + "/test/mission/" + folder +
                      "/expectations.txt");
  for (std::string line; std::getline(table, line);) {
    std::istringstream words(line);
    std::string name;
    Expected expected;
    words >> name >> expected.code;
    if (files.empty() || files.back().name != name) files.push_back({folder, name, {}});
    if (expected.code == "OK") continue;
    words >> expected.line >> std::ws;
    std::getline(words, expected.phrase);
    files.back().expected.push_back(expected);
  }
  return files;
}

}  // namespace dive::mission::testing
