#include "planning/world/mesh_extent.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <istream>
#include <string_view>

#include <fmt/format.h>

#include "common/input_file.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

struct TextPlace {
  std::size_t line = 0;
  // Number of the vertex in the file, counted from 1; 0 if it has no lines.
  std::size_t vertex = 0;
};

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// First word of a line with one vertex in this format; empty if the format has none.
std::string_view vertex_word(const std::string& extension) {
  if (extension == ".obj") return "v";
  if (extension == ".stl") return "vertex";
  return {};
}

// True if a number of the line is `value` in single precision; other words are skipped.
bool has_number(const std::string& line, float value) {
  for (const char* at = line.c_str(); *at != '\0';) {
    char* end = nullptr;
    const float number = std::strtof(at, &end);
    if (end != at && number == value) return true;
    at = end != at ? end : at + 1;
  }
  return false;
}

// The first line of a text file with `value` as a coordinate.
std::optional<TextPlace> place_of(const std::string& path, float value) {
  const std::string_view word = vertex_word(extension_of(path));
  const auto stream = open_input_stream(path);
  if (!stream) return std::nullopt;
  TextPlace place;
  for (std::string line; std::getline(**stream, line);) {
    ++place.line;
    if (line.find('\0') != std::string::npos) return std::nullopt;  // Not a text file.
    if (!word.empty()) {
      const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
      const bool is_vertex = line.compare(first, word.size(), word) == 0 &&
                             first + word.size() < line.size() &&
                             std::isspace(static_cast<unsigned char>(line[first + word.size()]));
      if (!is_vertex) continue;
      ++place.vertex;
    }
    if (has_number(line, value)) return place;
  }
  return std::nullopt;
}

}  // namespace

std::optional<MeshExcess> excess_of(const TriangleMesh& mesh, const std::string& path,
                                    const Vector3d& scale) {
  const auto is_beyond = [](const Vector3d& v) { return v.cwiseAbs().maxCoeff() > kMaxMeshExtent; };
  const auto first = std::ranges::find_if(mesh.vertices, is_beyond);
  if (first == mesh.vertices.end()) return std::nullopt;
  Eigen::Index axis = 0;
  first->cwiseAbs().maxCoeff(&axis);
  const double written = (*first)[axis] / scale[axis];
  const auto index = static_cast<std::uint32_t>(first - mesh.vertices.begin());
  const auto triangle = std::ranges::find_if(
      mesh.triangles, [&](const auto& t) { return std::ranges::find(t, index) != t.end(); });

  std::string where = fmt::format("a vertex of triangle {}", triangle - mesh.triangles.begin() + 1);
  if (const auto place = place_of(path, static_cast<float>(written))) {
    where = place->vertex > 0 ? fmt::format("vertex {} (line {})", place->vertex, place->line)
                              : fmt::format("{} (line {})", where, place->line);
  }
  const auto beyond = std::ranges::count_if(mesh.vertices, is_beyond);
  MeshExcess excess;
  excess.message =
      fmt::format("{} cannot be used: {} has {} = {:g} m, and the limit is {:g} m from its origin",
                  path, where, std::string_view("xyz").substr(static_cast<std::size_t>(axis), 1),
                  (*first)[axis], kMaxMeshExtent);
  if (beyond > 1) {
    excess.message +=
        fmt::format("; {} of {} vertices are beyond it", beyond, mesh.vertices.size());
  }
  excess.hint = 2 * static_cast<std::size_t>(beyond) > mesh.vertices.size()
                    ? "give its unit by <scale> (millimetres: 0.001), or move a mesh in map "
                      "coordinates to an origin near the dive"
                    : "delete the stray vertex and its triangles in the file";
  return excess;
}

}  // namespace dive::planning
