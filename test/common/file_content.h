#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace dive::testing {

/// All bytes of a file; empty if it cannot be read.
[[nodiscard]] inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace dive::testing
