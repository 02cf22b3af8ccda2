#include <cstdint>

#include <fmt/format.h>

#include "mission/export/export_format.h"
#include "mission/export/little_endian.h"
#include "mission/export/mesh_lines.h"

namespace dive::mission {
namespace {

void put_vertex(std::string& to, const Eigen::Vector3f& p, const Colour& colour) {
  for (const float coordinate : p) put(to, coordinate);
  for (const std::uint8_t part : colour) put(to, part);
}

}  // namespace

std::string to_ply(const Exported& exported) {
  std::string vertices;
  std::size_t count = 0;
  const auto add = [&](const Eigen::Vector3f& p, const Colour& colour) {
    put_vertex(vertices, p, colour);
    ++count;
  };
  for (const Eigen::Vector3f& p : exported.map.vertices) add(p, kMapColour);
  for (const ColouredLine& line : lines_of(exported)) {
    for (const Eigen::Vector3d& p : line.points_W) add(p.cast<float>(), line.colour);
  }
  for (const Eigen::Vector3f& p : exported.cloud) add(p, kCloudColour);
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment {}: x east, y north, z up (m); the surface is "
      "z = 0\n",
      exported.name);
  if (!exported.cloud_origin.isZero()) {
    text += fmt::format("comment add to every vertex {} {} {}\n", exported.cloud_origin.x(),
                        exported.cloud_origin.y(), exported.cloud_origin.z());
  }
  text += fmt::format(
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
      "red\n"
      "property uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      count, exported.map.triangles.size());
  text += vertices;
  for (const auto& triangle : exported.map.triangles) {
    put(text, std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) put(text, vertex);
  }
  return text;
}

}  // namespace dive::mission
