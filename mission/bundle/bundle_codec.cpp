#include "mission/bundle/bundle_codec.h"

#include <algorithm>
#include <cmath>

#include <dive/bundle_mesh_t.hpp>
#include <dive/bundle_t.hpp>

#include "vehicle/link/packet_detail.h"

namespace dive::mission {

using namespace link::detail;

namespace {

constexpr Run kBundle[] = {text(kMaxText), text(kMaxFileText), text(kMaxMeshText),
                           text(kMaxFileText)};
constexpr Run kMesh[] = {bytes(1 + 3 * sizeof(double)), text(kMaxText),
                         array(sizeof(double), kMaxMeshValues), array(4, kMaxMeshValues)};

}  // namespace

bool encode(const BundleTexts& texts, Packet& packet) {
  const auto& [name, xml, meshes, verdict] = texts;
  if (std::max(xml.size(), verdict.size()) >= kMaxFileText || meshes.size() >= kMaxMeshText) {
    return false;  // Checked before LCM counts in int.
  }
  bundle_t m;
  m.simulation_name = name;
  m.simulation_xml = xml;
  m.simulation_meshes = meshes;
  m.verdict = verdict;
  return pack(m, kBundle, packet);
}

bool decode(PacketView packet, BundleTexts& texts) {
  auto m = unpack<bundle_t>(packet, kBundle);
  if (!m) return false;
  texts = {std::move(m->simulation_name), std::move(m->simulation_xml),
           std::move(m->simulation_meshes), std::move(m->verdict)};
  return true;
}

bool encode(const BundledMesh& mesh, Packet& packet) {
  const auto& [is_simulation, uri, scale, triangles] = mesh;
  if (3 * std::max(triangles.vertices.size(), triangles.triangles.size()) > kMaxMeshValues) {
    return false;
  }
  bundle_mesh_t m;
  m.simulation = is_simulation ? 1 : 0;
  m.uri = uri;
  write_vector(scale, m.scale);
  for (const Eigen::Vector3d& v : triangles.vertices) {
    m.vertices.insert(m.vertices.end(), v.data(), v.data() + 3);
  }
  for (const auto& corners : triangles.triangles) {
    m.corners.insert(m.corners.end(), corners.begin(), corners.end());
  }
  m.num_values = static_cast<std::int32_t>(m.vertices.size());
  m.num_corners = static_cast<std::int32_t>(m.corners.size());
  return pack(m, kMesh, packet);
}

bool decode(PacketView packet, BundledMesh& mesh) {
  const auto m = unpack<bundle_mesh_t>(packet, kMesh);
  if (!m || m->vertices.size() % 3 != 0 || m->corners.size() % 3 != 0) return false;
  if (!std::ranges::all_of(m->vertices, [](double value) { return std::isfinite(value); })) {
    return false;
  }
  const auto count = static_cast<std::int32_t>(m->vertices.size() / 3);
  const auto is_vertex = [count](std::int32_t corner) { return corner >= 0 && corner < count; };
  if (!std::ranges::all_of(m->corners, is_vertex)) return false;
  mesh = {};
  mesh.uri = m->uri;
  mesh.scale = read_vector(m->scale);
  for (std::size_t i = 0; i < m->vertices.size(); i += 3) {
    mesh.mesh.vertices.emplace_back(m->vertices[i], m->vertices[i + 1], m->vertices[i + 2]);
  }
  for (std::size_t i = 0; i < m->corners.size(); i += 3) {
    mesh.mesh.triangles.push_back({static_cast<std::uint32_t>(m->corners[i]),
                                   static_cast<std::uint32_t>(m->corners[i + 1]),
                                   static_cast<std::uint32_t>(m->corners[i + 2])});
  }
  return read_flag(m->simulation, mesh.is_simulation);
}

}  // namespace dive::mission
