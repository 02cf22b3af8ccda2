#include "planning/mapping/save_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "common/fnv.h"
#include "common/xml.h"
#include "planning/cloud/cloud_file.h"
#include "planning/world/mesh.h"
#include "planning/world/mesh_pieces.h"
#include "planning/world/mesh_source.h"

namespace dive::planning {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr std::size_t kMaxPieces = 1U << 20U;  // limit of the text format for pieces
constexpr double kHalfSliver = 1e-3;           // m: half the width given to a piece that is a line

using Corners = std::array<Vector3d, 3>;

void add_lone_point(const Vector3d& p, double radius, std::vector<Corners>& triangles) {
  for (int side = 0; side < 8; ++side) {
    Corners t{p, p, p};
    for (int axis = 0; axis < 3; ++axis) {
      t[static_cast<std::size_t>(axis)][axis] += (side >> axis & 1) == 0 ? radius : -radius;
    }
    if (std::popcount(static_cast<unsigned>(side)) % 2 == 1) std::swap(t[1], t[2]);
    triangles.push_back(t);
  }
}

void add_line(const Vector3d& a, const Vector3d& b, std::vector<Corners>& triangles) {
  const Vector3d aside = kHalfSliver * (b - a).unitOrthogonal();
  triangles.push_back({a - aside, b, a + aside});
  triangles.push_back({a, b - aside, b + aside});
}

void add_piece(const Polytope& piece, std::vector<Corners>& triangles) {
  const std::vector<Vector3d>& v = piece.vertices;
  if (v.size() == 1) {
    add_lone_point(v[0], std::max(piece.radius, kHalfSliver), triangles);
  } else if (v.size() == 2) {
    add_line(v[0], v[1], triangles);
  }
  for (std::size_t i = 1; i + 1 < v.size(); ++i) triangles.push_back({v[0], v[i], v[i + 1]});
}

void append_bytes(const void* data, std::size_t size, std::string& out) {
  out.append(static_cast<const char*>(data), size);
}

// Binary, little-endian: 80 unused bytes, the number of triangles, and 50 bytes for each.
std::string to_stl(const std::vector<Corners>& triangles) {
  static_assert(std::endian::native == std::endian::little);
  std::string text(80, ' ');
  const auto count = static_cast<std::uint32_t>(triangles.size());
  append_bytes(&count, sizeof count, text);
  for (const Corners& t : triangles) {
    const Eigen::Vector3f normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized().cast<float>();
    append_bytes(normal.data(), 3 * sizeof(float), text);
    for (const Vector3d& corner : t) {
      const Eigen::Vector3f p = corner.cast<float>();
      append_bytes(p.data(), 3 * sizeof(float), text);
    }
    text.append(2, '\0');
  }
  return text;
}

/// Length of the UTF-8 character at the front; 0 if XML does not allow it.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7F ? 1 : 0;
  const std::size_t length = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
  if (byte(0) < 0xC2 || byte(0) > 0xF4 || length > text.size()) return 0;
  std::uint32_t code = byte(0) & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  const bool is_short = code < (length == 4 ? 0x10000U : length == 3 ? 0x800U : 0x80U);
  const bool is_no_character = (code >= 0xD800 && code < 0xE000) || code > 0x10FFFF ||
                               code == 0xFFFE || code == 0xFFFF || code < 0xA0;
  return is_short || is_no_character ? 0 : length;
}

bool is_name(std::string_view name) {
  if (name.empty() || name.front() == ' ' || name.back() == ' ') return false;
  while (!name.empty()) {
    const std::size_t length = character_length(name);
    if (length == 0) return false;
    name.remove_prefix(length);
  }
  return true;
}

// Text that XML allows in a comment: valid characters, no two hyphens in a row.
std::string as_comment(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (text.front() == '-' && !result.empty() && result.back() == '-') result += ' ';
    result += length == 0 ? std::string_view(" ") : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

std::string to_sdf(const std::string& name, const std::string& mesh, const std::string& comment) {
  const std::string geometry =
      fmt::format("<geometry><mesh><uri>{}</uri></mesh></geometry>", escape_xml(mesh));
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<!-- {} -->\n<sdf version=\"1.6\">\n  <world name=\"{}\">\n"
      "    <model name=\"observed\">\n      <static>true</static>\n      <link name=\"link\">\n"
      "        <collision name=\"surface\">{}</collision>\n"
      "        <visual name=\"surface\">{}</visual>\n"
      "      </link>\n    </model>\n  </world>\n</sdf>\n",
      as_comment(comment), escape_xml(name), geometry, geometry);
}

tl::unexpected<OutputError> refuse(const std::string& path, const std::string& reason) {
  return tl::make_unexpected(
      OutputError{OutputError::Kind::kName, fmt::format("{}: {}", path, reason)});
}

}  // namespace

tl::expected<void, OutputError> save_map(const std::string& path, const ObservedMap& map,
                                         std::span<const Eigen::Vector3f> points,
                                         const std::string& comment, Existing existing) {
  const std::string name = fs::path(path).filename().string();
  if (!is_name(name)) return refuse(as_comment(path), "cannot be the name of a map");
  MeshPieces pieces;
  std::vector<Corners> triangles;
  map.visit_cells([&](CellKey, std::span<const ObservedMap::Piece> some) {
    for (const ObservedMap::Piece& observed : some) {
      const auto& piece = std::get<Polytope>(observed.obstacle.shape);
      pieces.pieces.push_back(piece);
      pieces.tolerance = std::max(pieces.tolerance, piece.radius);
      add_piece(piece, triangles);
    }
  });
  if (pieces.pieces.empty()) return refuse(path, "nothing was observed: no map");
  if (pieces.pieces.size() > kMaxPieces || triangles.size() > kMaxTriangles) {
    return refuse(path, fmt::format("{} pieces ({} triangles) are too many for a mesh",
                                    pieces.pieces.size(), triangles.size()));
  }
  const std::string mesh = to_stl(triangles);
  Fnv1a64 digest;
  digest.add(mesh);
  pieces.key = {name + ".stl", Vector3d::Ones(), digest.value()};

  const std::string mesh_path = path + ".stl";
  const std::vector<std::pair<std::string, std::string>> files{
      {path + ".sdf", to_sdf(name, name + ".stl", comment)},
      {mesh_path, mesh},
      {pieces_path(mesh_path, pieces.key.scale), to_text(pieces)},
      {path + ".cloud.ply", to_ply({points.begin(), points.end()}, {as_comment(comment)})}};
  std::vector<OutputFile> outputs;
  for (const auto& [file, content] : files) {
    auto output = OutputFile::create(file, existing);
    if (!output) return tl::unexpected(std::move(output.error()));
    outputs.push_back(std::move(*output));
  }
  for (std::size_t i = files.size(); i-- > 0;) {
    auto written = outputs[i].write(files[i].second);
    if (written) written = outputs[i].close();
    if (!written) return written;
  }
  return {};
}

}  // namespace dive::planning
